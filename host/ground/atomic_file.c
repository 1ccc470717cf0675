/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "ground.h"

static void forget(struct atomic_file *af)
{
    free(af->path);
    free(af->target);
    free(af->temporary);
    memset(af, 0, sizeof *af);
}

static enum bf_status fail_to_write(struct atomic_file *af, int error_number, struct bf_error *err)
{
    const char *remedy = error_number == ENOENT    ? "create the directory first"
                         : error_number == ENOSPC  ? "free some disk space or choose another directory"
                         : error_number == EFBIG   ? "raise the file size limit or choose another directory"
                         : error_number == EDQUOT  ? "free some of the quota or choose another directory"
                         : error_number == ENOTDIR ? "a part of the path is a file, not a directory"
                                                   : "choose a writable place with -o";
    return bf_fail_at(err, af->path, 0, "cannot be written: %s; %s", strerror(error_number), remedy);
}

/* Resolved path of an existing target; of a new one the path as given. A dangling link counts as new. */
static char *resolve(const char *path)
{
    char *resolved = realpath(path, NULL);
    return resolved != NULL ? resolved : bf_strdup(path);
}

/* A new file beside the target, created with the mode that the umask leaves. */
static int create_temporary(struct atomic_file *af)
{
    static unsigned counter;
    const char *slash = strrchr(af->target, '/');
    size_t directory = slash != NULL ? (size_t)(slash - af->target) + 1 : 0;
    size_t size = directory + 64;
    af->temporary = bf_alloc(size, 1);
    for (int attempt = 0; attempt < 1000; attempt++) {
        unsigned serial = __atomic_fetch_add(&counter, 1, __ATOMIC_RELAXED);
        snprintf(af->temporary, size, "%.*s.beamfit-%ld-%u.tmp", (int)directory, af->target, (long)getpid(), serial);
        int fd = open(af->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
        if (fd >= 0 || errno != EEXIST)
            return fd;
    }
    return -1;
}

static enum bf_status open_standard_output(struct atomic_file *af, struct bf_error *err)
{
    (void)fflush(stdout);
    const int fd = dup(STDOUT_FILENO);
    af->f = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (af->f != NULL)
        return BF_OK;
    fail_to_write(af, errno, err);
    if (fd >= 0)
        close(fd);
    forget(af);
    return err->status;
}

enum bf_status atomic_open(const char *path, struct atomic_file *af, struct bf_error *err)
{
    memset(af, 0, sizeof *af);
    if (path[0] == '\0')
        return bf_fail(err, BF_USAGE, "the output file has an empty name; give one with -o");
    af->path = bf_strdup(path);
    if (strcmp(path, "-") == 0)
        return open_standard_output(af, err);
    af->target = resolve(path);
    struct stat info;
    bool exists = stat(af->target, &info) == 0;
    int fd = -1;
    if (exists && S_ISDIR(info.st_mode))
        bf_fail_at(err, path, 0, "is a directory; give the name of a file in it");
    if (exists && (S_ISDIR(info.st_mode) || outputs_may_replace(path, err) != BF_OK)) {
        forget(af);
        return err->status;
    }
    if (exists && !S_ISREG(info.st_mode))
        fd = open(af->target, O_WRONLY | O_CLOEXEC);
    else if (exists && access(af->target, W_OK) != 0)
        fd = -1;
    else
        fd = create_temporary(af);
    if (fd >= 0 && af->temporary != NULL && exists)
        (void)!fchmod(fd, info.st_mode & 0777); /* a file system without modes is no reason to fail */
    if (fd >= 0)
        af->f = fdopen(fd, "w");
    if (af->f == NULL) {
        fail_to_write(af, errno, err);
        if (fd >= 0)
            close(fd);
        if (fd >= 0 && af->temporary != NULL)
            unlink(af->temporary);
        forget(af);
        return err->status;
    }
    return BF_OK;
}

/* The name itself must survive a power cut too. */
static void sync_directory(const char *target)
{
    const char *slash = strrchr(target, '/');
    char *directory = slash == NULL ? bf_strdup(".") : strndup(target, (size_t)(slash - target) + 1);
    int fd = directory != NULL ? open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
    if (fd >= 0) {
        (void)!fsync(fd); /* some file systems refuse; the data are safe already */
        close(fd);
    }
    free(directory);
}

enum bf_status atomic_commit(struct atomic_file *af, struct bf_error *err)
{
    errno = 0;
    bool ok = fflush(af->f) == 0 && ferror(af->f) == 0;
    if (ok && af->temporary != NULL)
        ok = outputs_seal(af) && fsync(fileno(af->f)) == 0;
    int error_number = errno;
    if (fclose(af->f) != 0 && ok) {
        ok = false;
        error_number = errno;
    }
    if (ok && af->temporary != NULL && rename(af->temporary, af->target) != 0) {
        ok = false;
        error_number = errno;
    }
    if (!ok) {
        fail_to_write(af, error_number != 0 ? error_number : EIO, err);
        if (af->temporary != NULL)
            unlink(af->temporary);
    } else if (af->temporary != NULL) {
        sync_directory(af->target);
    }
    forget(af);
    return ok ? BF_OK : err->status;
}

void atomic_abort(struct atomic_file *af)
{
    if (af->f != NULL)
        fclose(af->f);
    if (af->temporary != NULL)
        unlink(af->temporary);
    forget(af);
}

enum bf_status atomic_check(const char *path, struct bf_error *err)
{
    struct atomic_file out;
    if (path == NULL || strcmp(path, "-") == 0)
        return BF_OK;
    const enum bf_status status = atomic_open(path, &out, err);
    if (status == BF_OK)
        atomic_abort(&out);
    return status;
}

enum bf_status atomic_check_file(const char *path, struct bf_error *err)
{
    if (path != NULL && strcmp(path, "-") == 0)
        return bf_fail(err, BF_USAGE, "-: standard output has the answer of this command; give the name of a file");
    return atomic_check(path, err);
}
