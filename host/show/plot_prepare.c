/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_prepare.c — before the work: can pictures be made in this directory, and would one replace what it may not? */
#include "plot_gnuplot.h"
#include "show.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The directory, or the nearest above it that exists, in which it would be made. */
static enum bf_status directory_can_be_made(const char *directory, struct bf_error *err)
{
    char *part = bf_strdup(directory), *slash = NULL;
    struct stat info;
    int found;
    while ((found = stat(part, &info)) != 0 && errno == ENOENT && (slash = strrchr(part, '/')) != NULL && slash != part)
        *slash = '\0';
    const int why = found != 0 && errno != ENOENT          ? errno
                    : found == 0 && !S_ISDIR(info.st_mode) ? ENOTDIR
                    : access(found == 0 ? part : ".", W_OK | X_OK) != 0 ? errno
                                                                        : 0;
    free(part);
    if (why == 0)
        return BF_OK;
    return bf_fail(err, BF_BAD_FILE, "%s: pictures cannot be put there (%s); choose another directory for --plot",
                   directory, why == ENOTDIR ? "it is a file" : strerror(why));
}

enum bf_status plot_prepare(const char *directory, const char *const stems[], size_t n, struct bf_error *err)
{
    char name[PICTURE_STEM];
    if (directory == NULL)
        return BF_OK;
    enum bf_status status = directory_can_be_made(directory[0] != '\0' ? directory : ".", err);
    for (size_t i = 0; i < n && status == BF_OK; i++) {
        picture_name(stems[i], name);
        status = picture_may_be_made(directory[0] != '\0' ? directory : ".", name, err);
    }
    if (status == BF_OK)
        (void)plot_can_draw(directory);
    return status;
}

void plot_forget(const char *directory, const char *stem)
{
    static const char *const tails[] = {".png", ".pdf"};
    char name[PICTURE_STEM];
    picture_name(stem, name);
    const size_t size = strlen(directory) + sizeof name + 8;
    char *path = bf_alloc(size, 1);
    for (int i = 0; i < 2; i++) {
        (void)snprintf(path, size, "%s/%s%s", directory[0] != '\0' ? directory : ".", name, tails[i]);
        (void)unlink(path);
    }
    free(path);
}
