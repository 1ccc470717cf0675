/* SPDX-License-Identifier: GPL-3.0-or-later */
/* outputs.c — which existing file an output may replace, and the mark by which the program knows its own files. */
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include "beam_image.h"
#include "ground.h"

#define MARK   OUTPUTS_KEY ": beamfit "
#define SHA256 ", sha256 "
enum { HEX = 64, COMMAND = 24, MOST_MARKS = 8 };
static const char no_sum[HEX + 1] = "0000000000000000000000000000000000000000000000000000000000000000";

/* What a file says of its maker. */
enum origin { FOREIGN, CHANGED, OF_ANOTHER_COMMAND, OWN };

struct identity {
    dev_t device;
    ino_t inode;
};

static struct {
    const char *command; /* NULL: no rule is in force */
    bool unrepeatable, force;
    size_t n_inputs;
    struct identity *inputs;
} rule; /* of the process; set by its main thread, but for the inputs, which are noted by whatever thread opens them, under the lock */
static pthread_mutex_t inputs_lock = PTHREAD_MUTEX_INITIALIZER;

void outputs_protect(const char *command, bool unrepeatable)
{
    rule.command = command;
    rule.unrepeatable = unrepeatable;
}

void outputs_force(void)
{
    rule.force = true;
}

void outputs_note_input(const char *path)
{
    struct stat info;
    if (rule.command == NULL || stat(path, &info) != 0 || !S_ISREG(info.st_mode))
        return;
    (void)pthread_mutex_lock(&inputs_lock);
    rule.inputs = bf_grow(rule.inputs, rule.n_inputs + 1, sizeof *rule.inputs);
    rule.inputs[rule.n_inputs++] = (struct identity){info.st_dev, info.st_ino};
    (void)pthread_mutex_unlock(&inputs_lock);
}

static bool is_input(const struct stat *info)
{
    bool found = false;
    (void)pthread_mutex_lock(&inputs_lock);
    for (size_t i = 0; i < rule.n_inputs; i++)
        found = found || (rule.inputs[i].device == info->st_dev && rule.inputs[i].inode == info->st_ino);
    (void)pthread_mutex_unlock(&inputs_lock);
    return found;
}

/* ---- The mark ---- */

/* The sum of a file whose sum at `at` counts as zeros. */
static void sum_without(const char *bytes, size_t n, size_t at, char sum[HEX + 1])
{
    struct hash hash;
    hash_start(&hash);
    hash_add(&hash, bytes, at);
    hash_add(&hash, no_sum, HEX);
    hash_add(&hash, bytes + at + HEX, n - at - HEX);
    hash_end(&hash, sum);
}

/* Of one mark, which begins behind MARK: who made it, and whether the file is as it was made. */
static enum origin origin_of_mark(const char *bytes, size_t n, size_t at, char command[COMMAND])
{
    char sum[HEX + 1];
    size_t length = 0;
    while (length + 1 < COMMAND && at + length < n && bytes[at + length] >= 'a' && bytes[at + length] <= 'z')
        length++;
    const size_t sum_at = at + length + strlen(SHA256);
    if (length == 0 || sum_at + HEX > n || memcmp(bytes + at + length, SHA256, strlen(SHA256)) != 0)
        return FOREIGN;
    memcpy(command, bytes + at, length);
    command[length] = '\0';
    sum_without(bytes, n, sum_at, sum);
    if (memcmp(sum, bytes + sum_at, HEX) != 0)
        return CHANGED;
    return rule.command != NULL && strcmp(command, rule.command) == 0 ? OWN : OF_ANOTHER_COMMAND;
}

/* Pages quote other files, so the best of the first few marks counts. */
static enum origin origin_of_bytes(const char *bytes, size_t n, char command[COMMAND])
{
    enum origin best = FOREIGN;
    const char *from = bytes, *found;
    for (int i = 0; i < MOST_MARKS && (found = memmem(from, n - (size_t)(from - bytes), MARK, strlen(MARK))) != NULL;
         i++) {
        char one[COMMAND];
        from = found + strlen(MARK);
        const enum origin origin = origin_of_mark(bytes, n, (size_t)(from - bytes), one);
        if (origin > best) {
            best = origin;
            memcpy(command, one, sizeof one);
        }
    }
    return best;
}

static bool is_target_image(const char *bytes, size_t n)
{
    const uint32_t magic = BEAM_IMAGE_MAGIC; /* a target image has no room for a mark, and nobody edits one */
    return n == BEAM_IMAGE_BYTES && memcmp(bytes, &magic, sizeof magic) == 0;
}

static enum origin origin_of_file(const char *path, char command[COMMAND])
{
    enum origin origin = FOREIGN;
    struct stat info;
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0 || fstat(fd, &info) != 0 || !S_ISREG(info.st_mode) || info.st_size == 0) {
        if (fd >= 0)
            close(fd);
        return FOREIGN;
    }
    const size_t n = (size_t)info.st_size;
    char *bytes = mmap(NULL, n, PROT_READ, MAP_PRIVATE, fd, 0);
    if (bytes != MAP_FAILED) {
        origin = is_target_image(bytes, n) ? OWN : origin_of_bytes(bytes, n, command);
        munmap(bytes, n);
    }
    close(fd);
    return origin;
}

void outputs_mark(struct atomic_file *out, const char *before, const char *after)
{
    if (rule.command == NULL || rule.unrepeatable || out->temporary == NULL || out->sum_at > 0)
        return;
    fprintf(out->f, "%s" MARK "%s" SHA256, before, rule.command);
    out->sum_at = ftell(out->f);
    fprintf(out->f, "%s%s", no_sum, after);
}

bool outputs_seal(const struct atomic_file *out)
{
    char sum[HEX + 1];
    struct bf_error err;
    if (out->sum_at <= 0)
        return true;
    const int fd = open(out->temporary, O_WRONLY | O_CLOEXEC);
    const bool sealed = fd >= 0 && hash_file(out->temporary, sum, &err) == BF_OK &&
                        pwrite(fd, sum, HEX, out->sum_at) == HEX && fsync(fd) == 0;
    return (fd < 0 || close(fd) == 0) && sealed;
}

bool outputs_is_mark(const char *line, size_t n)
{
    const char *mark = memmem(line, n, MARK, strlen(MARK));
    return mark != NULL && memmem(mark, n - (size_t)(mark - line), SHA256, strlen(SHA256)) != NULL;
}

/* ---- The rule ---- */

bool outputs_own(const char *path)
{
    char command[COMMAND];
    return origin_of_file(path, command) == OWN;
}

static enum bf_status refuse(const char *path, const char *why, struct bf_error *err)
{
    return bf_fail(err, BF_USAGE, "%s: %s; choose another name, or say --force to replace it", path, why);
}

enum bf_status outputs_may_replace(const char *path, struct bf_error *err)
{
    struct stat info;
    char command[COMMAND] = "", why[100];
    if (rule.command == NULL || rule.force || stat(path, &info) != 0 || !S_ISREG(info.st_mode) || info.st_size == 0)
        return BF_OK;
    if (is_input(&info))
        return refuse(path, "is read by this command", err);
    if (rule.unrepeatable)
        return refuse(path, "exists, and what was measured cannot be made again", err);
    switch (origin_of_file(path, command)) {
    case OWN:
        return BF_OK;
    case CHANGED:
        (void)snprintf(why, sizeof why, "was changed after `beamfit %s` had made it", command);
        return refuse(path, why, err);
    case OF_ANOTHER_COMMAND:
        (void)snprintf(why, sizeof why, "was made by `beamfit %s`, not by `beamfit %s`", command, rule.command);
        return refuse(path, why, err);
    case FOREIGN:
    default:
        return refuse(path, "exists, and beamfit has not made it", err);
    }
}
