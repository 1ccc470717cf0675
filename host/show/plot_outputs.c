/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_outputs.c — the files of a picture, and whether they may be replaced. */
#include "plot_gnuplot.h"
#include "show.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

/* NAME of "STEM-NAME.dat"; no NAME has a '-', so that data of "tap-residual" are none of "tap". */
static bool is_data_of(const char *file, const char *stem)
{
    const size_t n = strlen(stem), length = strlen(file);
    return length > n + 5 && strncmp(file, stem, n) == 0 && file[n] == '-' && strchr(file + n + 1, '-') == NULL &&
           strcmp(file + length - 4, ".dat") == 0;
}

static char *path_of(const char *directory, const char *stem, const char *tail)
{
    const size_t size = strlen(directory) + strlen(stem) + strlen(tail) + 2;
    char *path = bf_alloc(size, 1);
    (void)snprintf(path, size, "%s/%s%s", directory, stem, tail);
    return path;
}

static enum bf_status may_replace(const char *directory, const char *stem, const char *tail, struct bf_error *err)
{
    char *path = path_of(directory, stem, tail);
    const enum bf_status status = outputs_may_replace(path, err);
    free(path);
    return status;
}

enum bf_status picture_may_be_made(const char *directory, const char *stem, struct bf_error *err)
{
    static const char *const tails[] = {".gp", ".png", ".pdf"};
    char *script = path_of(directory, stem, tails[0]);
    const int known = outputs_own(script) ? 1 : 3; /* pictures have no room for a mark: their script has it */
    free(script);
    enum bf_status status = BF_OK;
    for (int i = 0; i < known && status == BF_OK; i++)
        status = may_replace(directory, stem, tails[i], err);
    DIR *all = status == BF_OK ? opendir(directory) : NULL;
    const struct dirent *entry;
    while (all != NULL && status == BF_OK && (entry = readdir(all)) != NULL)
        if (is_data_of(entry->d_name, stem))
            status = may_replace(directory, entry->d_name, "", err);
    if (all != NULL)
        (void)closedir(all);
    return status;
}
