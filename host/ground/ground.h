/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * ground.h — what every stage uses, and what knows nothing of beams. Section by section:
 *
 *     ERROR                  (ground_error.h) how a function fails; memory that is never NULL
 *     TEXT, NUMBER, DECIMAL  words and numbers, read and printed alike in every locale
 *     HASH, LINES            SHA-256; the lines of a text file of any size
 *     OPTIONS                (ground_command.h) the command line
 *     PROGRESS               (the same) a progress bar and Ctrl-C
 *     WORKERS                several threads
 *     ATOMIC FILE            a file written whole or not at all
 *     OUTPUTS                which existing file may be replaced
 *     DEVICE KEY             the secret of a controller, and what it signs
 *     JSON                   machine-readable answers
 */
#ifndef BEAMFIT_GROUND_H
#define BEAMFIT_GROUND_H

#include <getopt.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "ground/ground_command.h"
#include "ground/ground_error.h"

/* TEXT — words for people: "did you mean", wrapping to the terminal, column widths of UTF-8. */

/* The known word closest to `word` when it is close enough to be a typing error, else NULL. */
const char *text_closest(const char *word, const char *const known[], size_t n);

/* Columns of the terminal on standard output, or of COLUMNS; 80 when neither is known; within 40 … 120. */
size_t text_columns(void);

/* The last part of a path, in the path itself; "" for NULL. */
const char *text_base_name(const char *path);

/* Characters (code points) of UTF-8 text. */
size_t text_width(const char *text);

/* The text followed by blanks up to `width` characters. */
void text_print_padded(FILE *out, const char *text, size_t width);

/*
 * Paragraph wrapped at `columns`; every line but the first starts with `indent` blanks, and the first is taken to
 * begin at column `indent` already. Ends with a newline.
 */
void text_print_wrapped(FILE *out, const char *text, size_t indent, size_t columns);

/*
 * The help text of a command in so many columns. In the text, lines from the left edge make paragraphs; "  TERM  words" is an
 * entry, which lines with a deeper indent continue; lines that begin with "beamfit" are commands and are continued behind a backslash; other
 * indented lines are printed as they are.
 */
void text_print_help(FILE *out, const char *text, size_t columns);

/* NUMBER — decimal numbers in text that is not NUL-terminated. Correctly rounded, whatever the locale. */

/*
 * Reads [+-]digits[POINTdigits][e[+-]digits] from the start of [s, end). Returns the first character after it, NULL
 * when there is no number. No blanks are skipped; no hexadecimal, nan, inf. Too large a number gives ±INFINITY, too
 * small a one the nearest subnormal or 0. About 20 ns for up to 15 digits, 200 ns beyond.
 */
const char *number_scan(const char *s, const char *end, char point, double *x);

/* The whole of [s, end), blanks around it allowed. */
bool number_parse(const char *s, const char *end, char point, double *x);

/* How exactly a number was printed: its significant digits (of 0: none), and the decimal places of its last digit. */
struct number_digits {
    int significant, decimals;
};
struct number_digits number_digits(const char *s, const char *end, char point);

/* DECIMAL — numbers as a person and a YAML reader expect them, whatever the locale. */

enum { DECIMAL_TEXT = 32 };

/*
 * The whole text must be one decimal number ("1.050", "0.8e-5", "-3", ".5") or ".inf", "-.inf". False otherwise, and when
 * the number is too large for a double.
 */
bool decimal_parse(const char *text, double *out);

/* Shortest decimal text that reads back as exactly x: "0.05", "8.25e-6", "1.0e+7"; YAML 1.1 and 1.2 both read it. */
void decimal_print(char text[DECIMAL_TEXT], double x);

/* As above after rounding x to so many significant digits: for quantities that are themselves uncertain. */
void decimal_print_rounded(char text[DECIMAL_TEXT], double x, int digits);

/* HASH — SHA-256 of bytes and files, as 64 lower-case hexadecimal digits, and HMAC-SHA256. Only hash.c sees BearSSL. */

void hash_sha256_hex(const void *data, size_t n, char hex[65]);

/* Piece by piece: start, any number of add, end. Plain memory: copy it to fork a hash. */
struct hash {
    uint64_t state[16];
};
void hash_start(struct hash *hash);
void hash_add(struct hash *hash, const void *data, size_t n);
void hash_end(struct hash *hash, char hex[65]);

/* BF_BAD_FILE when the file cannot be read; hex is "" then. */
enum bf_status hash_file(const char *path, char hex[65], struct bf_error *err);

/*
 * LINES — the lines of a text file, one at a time, from a file of any size or from memory. Line ends may be LF or
 * CR LF; a UTF-8 byte order mark is skipped; bytes that no text file has are an error. Memory: one buffer of 256 KiB,
 * which grows with a longer line.
 */

enum { LINES_LONGEST = 1 << 20 }; /* bytes in a line */

struct lines {
    const char *path; /* the caller's; must outlive this */
    long number;      /* of the line last returned, from 1 */
    int fd;           /* −1: from memory */
    char *buffer;     /* owned when fd ≥ 0 */
    size_t capacity, start, end;
    bool at_end;      /* nothing is left to read from fd */
    struct hash hash; /* of all bytes read from fd */
};

enum bf_status lines_open(const char *path, struct lines *out, struct bf_error *err);

/* The lines of text[n], which is not copied; path is for messages. lines_close() is not needed. */
void lines_from_memory(const char *path, const char *text, size_t n, struct lines *out);

/*
 * The next line [*text, *text + *n) without its end; *text is NULL after the last. Valid until the next call.
 * BF_BAD_FILE: read error, a NUL byte, UTF-16, a line longer than LINES_LONGEST.
 */
enum bf_status lines_next(struct lines *lines, const char **text, size_t *n, struct bf_error *err);
void lines_close(struct lines *lines);

/* A whole file in memory with its SHA-256; caller frees *data. One NUL byte follows the n bytes. */
enum bf_status lines_read_all(const char *path, char **data, size_t *n, char sha256[65], struct bf_error *err);

/* WORKERS — one function on several threads, for work that shares a queue: each takes the next piece until none is left. */

/* Threads to use when the user asked for so many; 0: one a processor. At least 1, at most 16. */
int workers_wanted(int asked);

/*
 * Runs work(queue) on at most `wanted` threads, this one among them, and not on more than there are pieces; returns when all have
 * returned. A thread that cannot be started is done without.
 */
void workers_run(int wanted, size_t n_pieces, void *(*work)(void *queue), void *queue);

/*
 * ATOMIC FILE — write a file whole or not at all. Every writer of the program uses it.
 *
 *     struct atomic_file out;
 *     if (atomic_open(path, &out, err) != BF_OK)
 *         return err->status;
 *     fprintf(out.f, ...);
 *     return atomic_commit(&out, err);       // or atomic_abort(&out) when the content could not be made
 *
 * Content goes to a temporary file in the directory of the target, and replaces the target by rename() after a
 * successful fsync(). Until then, and after any failure, an existing target is untouched. A symbolic link is followed;
 * an existing target keeps its permissions. Devices and pipes (/dev/stdout, /dev/null), and "-", standard output, are written directly.
 */

struct atomic_file {
    FILE *f;         /* write here; errors need not be checked before commit */
    char *path;      /* the target as given, for messages */
    char *target;    /* the target with links resolved */
    char *temporary; /* NULL: written directly */
    long sum_at;     /* where the sum of outputs_mark() stands; 0: no mark */
};

/*
 * BF_BAD_FILE when the directory is missing or not writable, or the target is a directory or read-only; BF_USAGE when
 * the target may not be replaced (OUTPUTS).
 */
enum bf_status atomic_open(const char *path, struct atomic_file *af, struct bf_error *err);

/* BF_BAD_FILE when any write since open failed (disk full): then the temporary file is gone. Frees af either way. */
enum bf_status atomic_commit(struct atomic_file *af, struct bf_error *err);

/* Before long work: may this file be written? NULL and "-" (standard output) may. Errors as atomic_open()'s; nothing is left behind. */
enum bf_status atomic_check(const char *path, struct bf_error *err);
/* Of commands whose answer goes to standard output in any case: BF_USAGE for "-". */
enum bf_status atomic_check_file(const char *path, struct bf_error *err);

/* Removes the temporary file and frees af. Does nothing after atomic_commit() or another atomic_abort(). */
void atomic_abort(struct atomic_file *af);

/*
 * OUTPUTS — nothing is overwritten. An output replaces an existing file only when the same command has made that file and nobody has
 * changed it since, or when --force was said; a file that the command reads is never replaced without --force. The program knows its
 * own files by a mark, a comment "made_by: beamfit COMMAND, sha256 SUM" in them: SUM is the SHA-256 of the file with the 64 digits of
 * SUM as zeros. A target image has no mark; it is known by its beginning and its length. An empty file may always be replaced,
 * a device or a pipe always be written to. atomic_open() asks outputs_may_replace(), so that no writer can forget it.
 * The rule is one of the process and is in force after outputs_protect(), which main() calls; from its main thread only.
 */

#define OUTPUTS_KEY "made_by"

/* unrepeatable: what the command writes is measured, so that it never replaces even its own files without --force. */
void outputs_protect(const char *command, bool unrepeatable);
void outputs_force(void); /* --force was said; options_next() calls it */

/* The command reads this file. Every reader of the program says so. */
void outputs_note_input(const char *path);

/* BF_USAGE when there is a file at path that may not be replaced. */
enum bf_status outputs_may_replace(const char *path, struct bf_error *err);

/* True when the running command has made this file and nobody has changed it since. */
bool outputs_own(const char *path);

/* Writes the mark between these texts ("# " and "\n"), once in a file; `before` is not empty. */
void outputs_mark(struct atomic_file *out, const char *before, const char *after);

/* Fills in the sum of a flushed file; atomic_commit() calls it. False when that could not be written. */
bool outputs_seal(const struct atomic_file *out);

/* True for a line with a mark in it: who rewrites a file leaves the old one out. */
bool outputs_is_mark(const char *line, size_t n);

/*
 * DEVICE KEY — the secret that a controller and the owner of its models share, and what it signs. The key comes from
 * a file that nobody but its owner can read, never from the command line; wipe it after use.
 */

enum { DEVICE_KEY_BYTES = 32, DEVICE_CODE_BYTES = 32, DEVICE_ID_BYTES = 12, DEVICE_ID_TEXT = 2 * DEVICE_ID_BYTES + 1 };

struct device_key {
    uint8_t bytes[DEVICE_KEY_BYTES];
};

/*
 * A file of 32 raw bytes, or of 64 hexadecimal digits and at most a line end. BF_BAD_FILE when it holds anything else,
 * is no regular file, belongs to another user, or can be read or written by group or others.
 */
enum bf_status device_key_read(const char *path, struct device_key *out, struct bf_error *err);
void device_key_wipe(struct device_key *key);

/* HMAC-SHA256 of two pieces in a row; a NULL piece has n 0. */
void device_key_code(const struct device_key *key, const void *first, size_t n_first, const void *second,
                     size_t n_second, uint8_t code[DEVICE_CODE_BYTES]);

/* In a time that depends on n only. */
bool device_key_equal(const uint8_t a[], const uint8_t b[], size_t n);

/* Identity of a controller from 24 hexadecimal digits, and back. BF_USAGE. */
enum bf_status device_id_read(const char *text, uint8_t out[DEVICE_ID_BYTES], struct bf_error *err);
void device_id_print(const uint8_t id[DEVICE_ID_BYTES], char text[DEVICE_ID_TEXT]);

/* JSON — building machine-readable answers. NaN and infinities become null. Only json.c sees jansson. */

struct json;

struct json *json_new_object(void);
struct json *json_new_array(void);

/* The child belongs to the parent afterwards. Returns the child, so that building reads top-down. */
struct json *json_put(struct json *object, const char *key, struct json *child);
struct json *json_push(struct json *array, struct json *child);
void json_put_number(struct json *object, const char *key, double x);
void json_put_text(struct json *object, const char *key, const char *text); /* must be UTF-8; else escaped */
void json_put_bool(struct json *object, const char *key, bool x);
void json_push_number(struct json *array, double x);
void json_push_text(struct json *array, const char *text);

/* Reading a tree. A list's items and an object's members are counted alike; NULL where there is none, and 0 of NULL. */
bool json_is_list(const struct json *value);
bool json_is_text(const struct json *value);
bool json_number_is(const struct json *value);
double json_number_of(const struct json *value); /* NAN of anything else */
bool json_truth(const struct json *value);
size_t json_length(const struct json *value);
struct json *json_item(const struct json *list, size_t i);
struct json *json_member(const struct json *object, const char *key);
struct json *json_member_at(const struct json *object, size_t i);
const char *json_member_name(const struct json *object, size_t i);
/* A single value for a person: a number with so many digits (a whole one with all), yes or no, a dash for null; text is cut to size − 1. */
const char *json_words(const struct json *value, int digits, char text[], size_t size);

/* Print with a final newline and free the whole tree. */
enum bf_status json_print_and_free(struct json *root, FILE *out, struct bf_error *err);

/* The same on one line, for answers that never end: one object a line. */
enum bf_status json_print_line_and_free(struct json *root, FILE *out, struct bf_error *err);

/* Frees the whole tree without printing it. */
void json_discard(struct json *root);

#endif
