/* SPDX-License-Identifier: GPL-3.0-or-later */
/* test_files.h — files that tests make and read. Include after cmocka.h. */
#ifndef BEAMFIT_TEST_FILES_H
#define BEAMFIT_TEST_FILES_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A new directory of this process under TMPDIR, made once; caller removes the files it puts there. */
static inline const char *temporary_directory(void)
{
    static char path[256];
    if (path[0] == '\0') {
        const char *base = getenv("TMPDIR");
        snprintf(path, sizeof path, "%s/beamfit-test-XXXXXX", base != NULL ? base : "/tmp");
        assert_non_null(mkdtemp(path));
    }
    return path;
}

static inline void remove_temporary_directory(void)
{
    rmdir(temporary_directory());
}

/* Path of a file with this name and content; caller unlinks and frees. */
static inline char *temporary_file(const char *name, const void *data, size_t n)
{
    char path[512];
    static int registered;
    if (!registered)
        registered = atexit(remove_temporary_directory) == 0;
    snprintf(path, sizeof path, "%s/%s", temporary_directory(), name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, n, f), n);
    assert_int_equal(fclose(f), 0);
    return strdup(path);
}

/* A file of the recordings kept outside the project (../shared, or $BEAMFIT_SHARED); NULL, said aloud, when absent. */
static inline char *shared_file(const char *name)
{
    char path[512];
    const char *base = getenv("BEAMFIT_SHARED");
    snprintf(path, sizeof path, "%s/%s", base != NULL ? base : "../shared", name);
    if (access(path, R_OK) == 0)
        return strdup(path);
    print_message("SKIPPED: %s is not there (set BEAMFIT_SHARED to the directory that has data/)\n", path);
    return NULL;
}

static inline void assert_contains(const char *text, const char *part)
{
    if (strstr(text, part) == NULL)
        fail_msg("'%s' does not contain '%s'", text, part);
}

static inline void assert_file_is(const char *path, const char *content)
{
    char got[256] = "";
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    got[fread(got, 1, sizeof got - 1, f)] = '\0';
    fclose(f);
    assert_string_equal(got, content);
}

#endif
