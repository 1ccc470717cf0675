/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <dirent.h>
#include <signal.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include "ground/ground.h"
#include "test_files.h"

/* Entries of the tests' directory, '.' and '..' not counted: no temporary file may stay. */
static int count_files(void)
{
    struct dirent **entries;
    int n = scandir(temporary_directory(), &entries, NULL, alphasort);
    assert_true(n >= 2);
    for (int i = 0; i < n; i++)
        free(entries[i]);
    free(entries);
    return n - 2;
}

static char *in_directory(const char *name)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", temporary_directory(), name);
    return strdup(path);
}

static void the_new_content_appears_at_commit(void **state)
{
    (void)state;
    struct atomic_file af;
    struct bf_error err;
    char *path = temporary_file("target", "old", 3);
    assert_int_equal(atomic_open(path, &af, &err), BF_OK);
    fprintf(af.f, "new");
    fflush(af.f);
    assert_file_is(path, "old");
    assert_int_equal(count_files(), 2);
    assert_int_equal(atomic_commit(&af, &err), BF_OK);
    assert_file_is(path, "new");
    assert_int_equal(count_files(), 1);
    atomic_abort(&af); /* harmless afterwards */
    assert_file_is(path, "new");
    unlink(path);
    free(path);
}

static void abort_leaves_the_old_file_or_none(void **state)
{
    (void)state;
    struct atomic_file af;
    struct bf_error err;
    char *path = temporary_file("target", "old", 3), *fresh = in_directory("fresh");
    assert_int_equal(atomic_open(path, &af, &err), BF_OK);
    fprintf(af.f, "new");
    atomic_abort(&af);
    assert_file_is(path, "old");
    assert_int_equal(atomic_open(fresh, &af, &err), BF_OK);
    atomic_abort(&af);
    assert_int_not_equal(access(fresh, F_OK), 0);
    assert_int_equal(count_files(), 1);
    unlink(path);
    free(path);
    free(fresh);
}

static void two_writers_do_not_meet(void **state)
{
    (void)state;
    struct atomic_file one, two;
    struct bf_error err;
    char *path = in_directory("shared");
    assert_int_equal(atomic_open(path, &one, &err), BF_OK);
    assert_int_equal(atomic_open(path, &two, &err), BF_OK);
    fprintf(one.f, "one");
    fprintf(two.f, "two");
    assert_int_equal(atomic_commit(&two, &err), BF_OK);
    assert_file_is(path, "two");
    assert_int_equal(atomic_commit(&one, &err), BF_OK);
    assert_file_is(path, "one");
    assert_int_equal(count_files(), 1);
    unlink(path);
    free(path);
}

static void permissions_and_links_are_kept(void **state)
{
    (void)state;
    struct atomic_file af;
    struct bf_error err;
    struct stat info;
    char *path = temporary_file("target", "old", 3), *link = in_directory("link"), *fresh = in_directory("fresh");
    assert_int_equal(chmod(path, 0640), 0);
    assert_int_equal(symlink("target", link), 0);
    assert_int_equal(atomic_open(link, &af, &err), BF_OK);
    fprintf(af.f, "new");
    assert_int_equal(atomic_commit(&af, &err), BF_OK);
    assert_file_is(path, "new");
    assert_int_equal(lstat(link, &info), 0);
    assert_true(S_ISLNK(info.st_mode));
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0640);
    mode_t old = umask(027);
    assert_int_equal(atomic_open(fresh, &af, &err), BF_OK);
    assert_int_equal(atomic_commit(&af, &err), BF_OK);
    umask(old);
    assert_int_equal(stat(fresh, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0640);
    unlink(link);
    unlink(path);
    unlink(fresh);
    free(link);
    free(path);
    free(fresh);
}

static void refuses(const char *path, const char *phrase)
{
    struct atomic_file af;
    struct bf_error err;
    assert_int_equal(atomic_open(path, &af, &err), BF_BAD_FILE);
    assert_contains(err.text, path);
    assert_contains(err.text, phrase);
    assert_null(af.f);
}

static void places_that_cannot_be_written_are_named(void **state)
{
    (void)state;
    struct atomic_file af;
    struct bf_error err;
    char *file = temporary_file("file", "x", 1), *below = in_directory("file/below");
    refuses("/nonexistent/a", "create the directory first");
    refuses("/tmp", "is a directory");
    refuses(below, "not a directory");
    refuses("/proc/beamfit", "cannot be written");
    assert_int_equal(atomic_open("", &af, &err), BF_USAGE);
    assert_file_is(file, "x");
    unlink(file);
    free(file);
    free(below);
}

static void an_unwritable_directory_or_file_is_refused(void **state)
{
    (void)state;
    if (geteuid() == 0) { /* root may write anywhere: try as nobody */
        char *directory = in_directory("locked"), *path = in_directory("locked/a"),
             *fixed = temporary_file("fixed", "f", 1);
        assert_int_equal(mkdir(directory, 0555), 0);
        assert_int_equal(chmod(temporary_directory(), 0777), 0);
        chmod(fixed, 0444);
        fflush(NULL);
        pid_t child = fork();
        if (child == 0) {
            struct atomic_file af;
            struct bf_error err;
            int ok = setuid(65534) == 0 && atomic_open(path, &af, &err) == BF_BAD_FILE &&
                     strstr(err.text, "Permission denied") != NULL && atomic_open(fixed, &af, &err) == BF_BAD_FILE &&
                     strstr(err.text, "writable place") != NULL;
            _exit(ok ? 0 : 1);
        }
        int status;
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
        assert_file_is(fixed, "f");
        rmdir(directory);
        unlink(fixed);
        free(directory);
        free(path);
        free(fixed);
        return;
    }
    refuses("/beamfit-test", "Permission denied");
}

/* A full disk: writes beyond a limit fail, at the latest at commit; the old file stays and no other is left. */
static void a_full_disk_leaves_the_old_file(void **state)
{
    (void)state;
    char *path = temporary_file("target", "old", 3);
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        struct rlimit limit = {1000, 1000};
        struct atomic_file af;
        struct bf_error err;
        signal(SIGXFSZ, SIG_IGN);
        int ok = setrlimit(RLIMIT_FSIZE, &limit) == 0 && atomic_open(path, &af, &err) == BF_OK;
        for (int i = 0; ok && i < 100000; i++)
            fprintf(af.f, "%d\n", i);
        ok = ok && atomic_commit(&af, &err) == BF_BAD_FILE && strstr(err.text, path) != NULL &&
             strstr(err.text, "cannot be written") != NULL;
        _exit(ok ? 0 : 1);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    assert_file_is(path, "old");
    assert_int_equal(count_files(), 1);
    unlink(path);
    free(path);
}

static void devices_are_written_directly(void **state)
{
    (void)state;
    struct atomic_file af;
    struct bf_error err;
    struct stat info;
    assert_int_equal(atomic_open("/dev/null", &af, &err), BF_OK);
    assert_null(af.temporary);
    fprintf(af.f, "gone");
    assert_int_equal(atomic_commit(&af, &err), BF_OK);
    assert_int_equal(stat("/dev/null", &info), 0);
    assert_true(S_ISCHR(info.st_mode));
    assert_int_equal(atomic_open("/dev/full", &af, &err), BF_OK);
    fprintf(af.f, "no room");
    assert_int_equal(atomic_commit(&af, &err), BF_BAD_FILE);
    assert_contains(err.text, "No space left");
    assert_contains(err.text, "free some disk space");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_new_content_appears_at_commit),
        cmocka_unit_test(abort_leaves_the_old_file_or_none),
        cmocka_unit_test(two_writers_do_not_meet),
        cmocka_unit_test(permissions_and_links_are_kept),
        cmocka_unit_test(places_that_cannot_be_written_are_named),
        cmocka_unit_test(an_unwritable_directory_or_file_is_refused),
        cmocka_unit_test(a_full_disk_leaves_the_old_file),
        cmocka_unit_test(devices_are_written_directly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
