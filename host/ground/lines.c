/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "ground.h"

enum { PIECE = 1 << 18 };

static enum bf_status open_for_reading(const char *path, int *fd, struct bf_error *err)
{
    struct stat info;
    *fd = open(path, O_RDONLY | O_CLOEXEC);
    if (*fd < 0 && errno == ENOENT)
        return bf_fail_at(err, path, 0, "there is no such file; check the name");
    if (*fd < 0)
        return bf_fail_at(err, path, 0, "cannot be read: %s; check its permissions", strerror(errno));
    if (fstat(*fd, &info) == 0 && S_ISDIR(info.st_mode)) {
        close(*fd);
        return bf_fail_at(err, path, 0, "is a directory; give the name of a file in it");
    }
    outputs_note_input(path);
    return BF_OK;
}

/* Up to `room` more bytes; *got is 0 at the end. */
static enum bf_status read_some(const char *path, int fd, char *at, size_t room, size_t *got, struct bf_error *err)
{
    ssize_t n;
    do
        n = read(fd, at, room);
    while (n < 0 && errno == EINTR);
    if (n < 0)
        return bf_fail_at(err, path, 0, "cannot be read: %s; copy it to another disk and try again", strerror(errno));
    *got = (size_t)n;
    return BF_OK;
}

enum bf_status lines_open(const char *path, struct lines *out, struct bf_error *err)
{
    memset(out, 0, sizeof *out);
    out->path = path;
    if (open_for_reading(path, &out->fd, err) != BF_OK)
        return err->status;
    out->capacity = PIECE;
    out->buffer = bf_alloc(out->capacity, 1);
    hash_start(&out->hash);
    return BF_OK;
}

void lines_from_memory(const char *path, const char *text, size_t n, struct lines *out)
{
    memset(out, 0, sizeof *out);
    out->path = path;
    out->fd = -1;
    out->buffer = (char *)(uintptr_t)text; /* only ever read */
    out->end = n;
    out->at_end = true;
}

/* More bytes behind those already in the buffer. */
static enum bf_status refill(struct lines *lines, struct bf_error *err)
{
    if (lines->start > 0) {
        memmove(lines->buffer, lines->buffer + lines->start, lines->end - lines->start);
        lines->end -= lines->start;
        lines->start = 0;
    }
    if (lines->end == lines->capacity) {
        lines->capacity *= 2;
        lines->buffer = bf_grow(lines->buffer, lines->capacity, 1);
    }
    size_t got = 0;
    if (read_some(lines->path, lines->fd, lines->buffer + lines->end, lines->capacity - lines->end, &got, err) != BF_OK)
        return err->status;
    hash_add(&lines->hash, lines->buffer + lines->end, got);
    lines->end += got;
    lines->at_end = got == 0;
    return BF_OK;
}

static enum bf_status check_start(struct lines *lines, struct bf_error *err)
{
    const char *s = lines->buffer + lines->start;
    size_t n = lines->end - lines->start;
    if (n >= 2 && (memcmp(s, "\xff\xfe", 2) == 0 || memcmp(s, "\xfe\xff", 2) == 0))
        return bf_fail_at(err, lines->path, 1,
                          "is text in UTF-16; save it as UTF-8 (iconv -f UTF-16 -t UTF-8 IN > OUT) and try again");
    if (n >= 3 && memcmp(s, "\xef\xbb\xbf", 3) == 0)
        lines->start += 3;
    return BF_OK;
}

enum bf_status lines_next(struct lines *lines, const char **text, size_t *n, struct bf_error *err)
{
    size_t searched = 0;
    const char *newline = NULL;
    *text = NULL;
    *n = 0;
    while (lines->number == 0 && !lines->at_end && lines->end - lines->start < 3)
        if (refill(lines, err) != BF_OK)
            return err->status;
    if (lines->number == 0 && check_start(lines, err) != BF_OK)
        return err->status;
    for (;;) {
        size_t have = lines->end - lines->start;
        newline = have > searched ? memchr(lines->buffer + lines->start + searched, '\n', have - searched) : NULL;
        if (newline != NULL || lines->at_end || have > LINES_LONGEST)
            break;
        searched = have;
        if (refill(lines, err) != BF_OK)
            return err->status;
    }
    const char *line = lines->buffer + lines->start;
    size_t length = newline != NULL ? (size_t)(newline - line) : lines->end - lines->start;
    if (newline == NULL && length == 0)
        return BF_OK;
    lines->number++;
    if (length > 0 && memchr(line, '\0', length) != NULL)
        return bf_fail_at(
            err, lines->path, lines->number,
            "has a zero byte: this is a binary file, not text; 'beamfit import' reads UFF, MAT, LVM and WAV");
    if (length > LINES_LONGEST)
        return bf_fail_at(err, lines->path, lines->number, "is longer than %d bytes; a record has one sample in a line",
                          LINES_LONGEST);
    lines->start += length + (newline != NULL ? 1 : 0);
    if (length > 0 && line[length - 1] == '\r')
        length--;
    *text = line;
    *n = length;
    return BF_OK;
}

void lines_close(struct lines *lines)
{
    if (lines->fd >= 0) {
        close(lines->fd);
        free(lines->buffer);
    }
    lines->fd = -1;
    lines->buffer = NULL;
}

enum bf_status lines_read_all(const char *path, char **data, size_t *n, char sha256[65], struct bf_error *err)
{
    int fd;
    size_t capacity = PIECE, got = 1;
    *data = NULL;
    *n = 0;
    if (open_for_reading(path, &fd, err) != BF_OK)
        return err->status;
    char *all = bf_alloc(capacity, 1);
    while (got > 0) {
        if (*n + 1 == capacity)
            all = bf_grow(all, capacity *= 2, 1);
        if (read_some(path, fd, all + *n, capacity - *n - 1, &got, err) != BF_OK) {
            close(fd);
            free(all);
            return err->status;
        }
        *n += got;
    }
    close(fd);
    all[*n] = '\0';
    hash_sha256_hex(all, *n, sha256);
    *data = all;
    return BF_OK;
}
