/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Readers that rest on outside libraries run in a child process with limits on memory and time: when a file makes the
 * library crash, only the child ends, and this process reports a damaged file. What the child sends is checked as a file is.
 */
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include "import_channel.h"
#include "import_isolated.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer) /* clang's way to say it */
#define WITH_SANITIZER
#endif
#endif
#ifdef __SANITIZE_ADDRESS__ /* gcc's */
#define WITH_SANITIZER
#endif

enum { MOST_CHANNELS = 8192, LONGEST_TEXT = 4096, CPU_SECONDS = 600, PIECE = 1 << 16 };

static void put_text(FILE *f, const char *text)
{
    size_t n = strlen(text) < LONGEST_TEXT ? strlen(text) : LONGEST_TEXT;
    fwrite(&n, sizeof n, 1, f);
    fwrite(text, 1, n, f);
}

/* NULL when the child has ended or the text is too long. */
static char *take_text(FILE *f)
{
    size_t n;
    if (fread(&n, sizeof n, 1, f) != 1 || n > LONGEST_TEXT)
        return NULL;
    char *raw = bf_alloc(n + 1, 1), *text = NULL;
    if (fread(raw, 1, n, f) == n)
        import_set_text(&text, raw, n);
    free(raw);
    return text;
}

/* The child's answer: status and error, rate, metadata, channels. */
static void send_answer(FILE *f, const struct import_file *file, enum bf_status status, const struct bf_error *err)
{
    int code = (int)status;
    fwrite(&code, sizeof code, 1, f);
    put_text(f, status == BF_OK ? "" : err->text);
    fwrite(&file->rate_Hz, sizeof file->rate_Hz, 1, f);
    put_text(f, file->rate_from != NULL ? file->rate_from : "");
    fwrite(&file->n_meta, sizeof file->n_meta, 1, f);
    for (size_t i = 0; i < file->n_meta; i++) {
        put_text(f, file->meta[i].key);
        put_text(f, file->meta[i].value);
    }
    fwrite(&file->n_channels, sizeof file->n_channels, 1, f);
    for (size_t i = 0; i < file->n_channels; i++) {
        const struct import_channel *c = &file->channels[i];
        put_text(f, c->name);
        put_text(f, c->unit);
        put_text(f, c->about);
        fwrite(&c->dt_s, sizeof c->dt_s, 1, f);
        fwrite(&c->n, sizeof c->n, 1, f);
        if (c->n > 0)
            fwrite(c->x, sizeof *c->x, c->n, f);
    }
}

/* n numbers, as they come: the memory for them is asked for when they are there. */
static double *take_numbers(FILE *f, size_t n)
{
    size_t got = 0, capacity = 0;
    double *x = NULL;
    while (got < n) {
        size_t piece = n - got < PIECE ? n - got : PIECE;
        if (got + piece > capacity) {
            capacity = 2 * capacity > got + piece ? 2 * capacity : got + piece;
            x = bf_grow(x, capacity, sizeof *x);
        }
        if (fread(x + got, sizeof *x, piece, f) != piece) {
            free(x);
            return NULL;
        }
        got += piece;
    }
    return x != NULL ? x : bf_alloc(1, sizeof *x);
}

static bool take_channel(FILE *f, struct import_file *file)
{
    char *name = take_text(f), *unit = take_text(f), *about = take_text(f);
    double dt_s, *x = NULL;
    size_t n;
    bool ok = name != NULL && unit != NULL && about != NULL && fread(&dt_s, sizeof dt_s, 1, f) == 1 &&
              fread(&n, sizeof n, 1, f) == 1;
    if (ok)
        x = take_numbers(f, n);
    if (x != NULL) {
        struct import_channel *c = import_add(file, name, strlen(name), x, n);
        import_set_text(&c->unit, unit, strlen(unit));
        import_set_text(&c->about, about, strlen(about));
        c->dt_s = isfinite(dt_s) && dt_s > 0 ? dt_s : 0;
    }
    free(name);
    free(unit);
    free(about);
    return x != NULL;
}

static bool take_meta(FILE *f, struct import_file *file)
{
    char *key = take_text(f), *value = take_text(f);
    bool ok = key != NULL && value != NULL;
    if (ok)
        import_add_meta(file, key, value, strlen(value));
    free(key);
    free(value);
    return ok;
}

/* False: the answer is not whole. */
static bool take_answer(FILE *f, struct import_file *file, enum bf_status *status, struct bf_error *err)
{
    int code;
    double rate_Hz;
    size_t n;
    if (fread(&code, sizeof code, 1, f) != 1)
        return false;
    char *text = take_text(f);
    *status = code == BF_OK ? BF_OK : BF_BAD_FILE;
    if (text != NULL && *status != BF_OK)
        bf_fail(err, BF_BAD_FILE, "%s", text);
    bool ok = text != NULL && fread(&rate_Hz, sizeof rate_Hz, 1, f) == 1;
    free(text);
    text = ok ? take_text(f) : NULL;
    ok = text != NULL && fread(&n, sizeof n, 1, f) == 1 && n <= MOST_CHANNELS;
    if (ok && rate_Hz > 0)
        import_set_rate(file, rate_Hz, text);
    free(text);
    for (size_t i = 0; ok && i < n; i++)
        ok = take_meta(f, file);
    ok = ok && fread(&n, sizeof n, 1, f) == 1 && n <= MOST_CHANNELS;
    for (size_t i = 0; ok && i < n; i++)
        ok = take_channel(f, file);
    return ok;
}

#ifndef WITH_SANITIZER
/* Bytes of address space that this process has already, libraries and all. */
static rlim_t used_so_far(void)
{
    char line[64] = "";
    FILE *f = fopen("/proc/self/statm", "r");
    if (f == NULL)
        return 0;
    unsigned long pages = fgets(line, sizeof line, f) != NULL ? strtoul(line, NULL, 10) : 0;
    fclose(f);
    return (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE);
}
#endif

/* Room for the numbers of a compressed file many times over, and no more. A sanitizer needs all addresses for itself. */
static void limit_self(size_t file_bytes)
{
    struct rlimit none = {0, 0}, cpu = {CPU_SECONDS, CPU_SECONDS};
    setrlimit(RLIMIT_CORE, &none);
    setrlimit(RLIMIT_CPU, &cpu);
#ifndef WITH_SANITIZER
    rlim_t room = used_so_far() + ((rlim_t)1 << 30) + 64 * (rlim_t)file_bytes;
    struct rlimit memory = {room, room};
    setrlimit(RLIMIT_AS, &memory);
#else
    (void)file_bytes;
#endif
}

_Noreturn static void be_the_child(int fd, import_reader *reader, struct import_file *file, const char *data, size_t n,
                                   const struct import_reading *how)
{
    struct bf_error err = {0};
    limit_self(n);
    enum bf_status status = reader(file, data, n, how, &err);
    FILE *f = fdopen(fd, "wb");
    if (f == NULL)
        _exit(1);
    send_answer(f, file, status, &err);
    _exit(fclose(f) == 0 ? 0 : 1);
}

enum bf_status import_isolated(import_reader *reader, struct import_file *file, const char *data, size_t n,
                               const struct import_reading *how, struct bf_error *err)
{
    int ends[2], ended;
    if (pipe(ends) != 0)
        return bf_fail(err, BF_NUMERIC, "no pipe for reading %s: %s", file->path, strerror(errno));
    pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        be_the_child(ends[1], reader, file, data, n, how);
    }
    close(ends[1]);
    FILE *f = child > 0 ? fdopen(ends[0], "rb") : NULL;
    if (f == NULL) {
        close(ends[0]);
        return bf_fail(err, BF_NUMERIC, "no process for reading %s: %s", file->path, strerror(errno));
    }
    enum bf_status status = BF_OK;
    bool whole = take_answer(f, file, &status, err);
    fclose(f);
    while (waitpid(child, &ended, 0) < 0 && errno == EINTR)
        ;
    if (whole)
        return status;
    return bf_fail_at(err, file->path, 0, "is damaged, and its reader failed on it (%s); export it again",
                      WIFSIGNALED(ended) ? strsignal(WTERMSIG(ended)) : "no answer");
}
