/* SPDX-License-Identifier: GPL-3.0-or-later */
/* NumPy arrays (.npy, versions 1 to 3; NumPy Enhancement Proposal 1): vectors, matrices, structured arrays of numbers. */
#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include "import_channel.h"
#include "import_format.h"

enum { MOST_FIELDS = 4096, MOST_NAME = 64 };

static const char magic[6] = {(char)0x93, 'N', 'U', 'M', 'P', 'Y'};

/* A number in the bytes: kind b i u f c as NumPy writes it, its bytes, and their order. */
struct scalar {
    char kind;
    size_t bytes;
    bool big;
};

struct field {
    char name[MOST_NAME]; /* "": the array is not structured */
    struct scalar type;
    size_t offset; /* in an element */
};

struct array {
    size_t rows, columns; /* samples and channels where rows are samples */
    bool by_columns;      /* Fortran's order */
    size_t n_fields, element;
    struct field *fields;
    const unsigned char *data; /* rows · columns · element bytes */
};

/* ---- The header: a literal of Python ---- */

/* Behind the value's colon of 'key'; NULL: the header has no such key. */
static const char *value_of(const char *header, const char *key)
{
    char quoted[24];
    snprintf(quoted, sizeof quoted, "'%s'", key);
    const char *at = strstr(header, quoted);
    if (at == NULL)
        return NULL;
    at += strlen(quoted);
    while (*at == ' ' || *at == ':')
        at++;
    return at;
}

/* "'<f8'" -> the scalar; returns behind it, NULL when it is none that holds numbers. */
static const char *read_scalar(const char *at, struct scalar *out)
{
    char *end;
    if (*at != '\'' || at[1] == '\0')
        return NULL;
    const char order = at[1];
    at += order == '<' || order == '>' || order == '|' || order == '=' ? 2 : 1;
    *out = (struct scalar){.kind = *at, .big = order == '>'};
    if (*at == '\0' || strchr("biufc", *at) == NULL || !isdigit((unsigned char)at[1]))
        return NULL;
    const unsigned long bytes = strtoul(at + 1, &end, 10);
    const bool whole = bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8;
    const bool good = out->kind == 'c'   ? bytes == 8 || bytes == 16
                      : out->kind == 'f' ? bytes == 4 || bytes == 8
                      : out->kind == 'b' ? bytes == 1
                                         : whole;
    out->bytes = bytes;
    return good && *end == '\'' ? end + 1 : NULL;
}

/* "[('t', '<f8'), ('a', '<f4'), ]" */
static bool read_fields(const char *at, struct array *a)
{
    for (at++; *at != ']';) {
        struct field field = {.offset = a->element};
        while (*at == ' ' || *at == ',' || *at == '(')
            at++;
        if (*at != '\'' || a->n_fields == MOST_FIELDS)
            return false;
        const char *name = ++at;
        at = strchr(at, '\'');
        if (at == NULL || at == name || (size_t)(at - name) >= sizeof field.name)
            return false;
        memcpy(field.name, name, (size_t)(at - name));
        for (at++; *at == ' ' || *at == ',';)
            at++;
        at = read_scalar(at, &field.type);
        if (at == NULL || *at != ')')
            return false;
        for (at++; *at == ' ' || *at == ',';)
            at++;
        a->element += field.type.bytes;
        a->fields = bf_grow(a->fields, a->n_fields + 1, sizeof *a->fields);
        a->fields[a->n_fields++] = field;
    }
    return a->n_fields > 0;
}

static bool read_descr(const char *at, struct array *a)
{
    if (*at == '[')
        return read_fields(at, a);
    a->fields = bf_alloc(1, sizeof *a->fields);
    a->n_fields = 1;
    const bool good = read_scalar(at, &a->fields[0].type) != NULL;
    a->element = a->fields[0].type.bytes;
    return good;
}

/* "(4096, 3)"; returns the dimensions, 0 for what cannot be read. */
static size_t read_shape(const char *at, size_t size[2])
{
    size_t n = 0;
    if (*at != '(')
        return 0;
    for (at++; *at != ')'; n++) {
        char *end;
        while (*at == ' ' || *at == ',')
            at++;
        if (*at == ')')
            break;
        if (!isdigit((unsigned char)*at))
            return 0;
        const unsigned long long x = strtoull(at, &end, 10);
        if (n < 2)
            size[n] = x > SIZE_MAX / 32 ? SIZE_MAX / 32 : (size_t)x;
        at = end;
    }
    return n;
}

static enum bf_status read_header(const struct import_file *file, const char *header, struct array *a,
                                  struct bf_error *err)
{
    size_t size[2] = {1, 1};
    const char *descr = value_of(header, "descr"), *order = value_of(header, "fortran_order"),
               *shape = value_of(header, "shape");
    if (descr == NULL || order == NULL || shape == NULL)
        return bf_fail_at(err, file->path, 0, "its header names no descr, fortran_order and shape; save it again");
    if (!read_descr(descr, a))
        return bf_fail_at(err, file->path, 0,
                          "holds %.40s, no array of numbers; save numbers (float64, int16, ...) with numpy.save",
                          descr);
    const size_t n = read_shape(shape, size);
    if (n == 0 || n > 2)
        return bf_fail_at(err, file->path, 0, "has %zu dimensions; save a vector, or a matrix of samples by channels",
                          n);
    a->rows = size[0], a->columns = size[1];
    a->by_columns = strncmp(order, "True", 4) == 0;
    return BF_OK;
}

/* ---- The numbers ---- */

static uint64_t bits_at(const unsigned char *at, size_t bytes, bool big)
{
    uint64_t bits = 0;
    for (size_t i = 0; i < bytes; i++)
        bits |= (uint64_t)at[big ? bytes - 1 - i : i] << (8 * i);
    return bits;
}

static double real_at(const unsigned char *at, size_t bytes, bool big)
{
    const uint64_t bits = bits_at(at, bytes, big);
    if (bytes == 4) {
        const uint32_t half = (uint32_t)bits;
        float x;
        memcpy(&x, &half, sizeof x);
        return (double)x;
    }
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* part 1: the imaginary part of a complex number */
static double number_at(const unsigned char *at, const struct scalar *type, size_t part)
{
    if (type->kind == 'f')
        return real_at(at, type->bytes, type->big);
    if (type->kind == 'c')
        return real_at(at + part * type->bytes / 2, type->bytes / 2, type->big);
    const uint64_t bits = bits_at(at, type->bytes, type->big);
    if (type->kind != 'i')
        return (double)bits;
    const unsigned unused = (unsigned)(64 - 8 * type->bytes);
    return (double)((int64_t)(bits << unused) >> unused);
}

static void add_part(struct import_file *file, const struct array *a, const struct field *field, size_t channel,
                     size_t part, const char *suffix)
{
    const bool rows_are_samples = a->rows >= a->columns;
    const size_t n = rows_are_samples ? a->rows : a->columns;
    char name[MOST_NAME + 40] = "";
    double *x = bf_alloc(n, sizeof *x);
    for (size_t k = 0; k < n; k++) {
        const size_t row = rows_are_samples ? k : channel, column = rows_are_samples ? channel : k;
        const size_t index = a->by_columns ? column * a->rows + row : row * a->columns + column;
        x[k] = number_at(a->data + index * a->element + field->offset, &field->type, part);
    }
    if (field->name[0] != '\0')
        snprintf(name, sizeof name, "%s%s", field->name, suffix);
    else if (suffix[0] != '\0')
        snprintf(name, sizeof name, "channel_%zu%s", channel + 1, suffix);
    import_add(file, name, strlen(name), x, n);
    file->has_names = file->has_names || field->name[0] != '\0';
}

static void add_channels(struct import_file *file, const struct array *a)
{
    const size_t channels = a->rows >= a->columns ? a->columns : a->rows;
    for (size_t i = 0; i < channels; i++)
        for (size_t f = 0; f < a->n_fields; f++) {
            const bool complex = a->fields[f].type.kind == 'c';
            add_part(file, a, &a->fields[f], i, 0, complex ? "_re" : "");
            if (complex)
                add_part(file, a, &a->fields[f], i, 1, "_im");
        }
}

static enum bf_status read_array(struct import_file *file, const char *header, const char *data, size_t n,
                                 struct array *a, struct bf_error *err)
{
    enum { MOST_CHANNELS = 4096 };
    if (read_header(file, header, a, err) != BF_OK)
        return err->status;
    a->data = (const unsigned char *)data;
    const size_t least = a->rows < a->columns ? a->rows : a->columns;
    if (least > MOST_CHANNELS || (least > 1 && a->fields[0].name[0] != '\0'))
        return bf_fail_at(err, file->path, 0, "is %zu by %zu; save a vector, or a matrix of samples by channels",
                          a->rows, a->columns);
    if (a->rows == 0 || a->columns == 0 || a->columns > n / a->element / a->rows)
        return bf_fail_at(err, file->path, 0,
                          "claims %zu by %zu numbers and has %zu bytes of them; it is cut off, or empty: save it again",
                          a->rows, a->columns, n);
    add_channels(file, a);
    return BF_OK;
}

static enum bf_status read_npy(struct import_file *file, const char *data, size_t n, const struct import_reading *how,
                               struct bf_error *err)
{
    enum { SHORT_START = 10, LONG_START = 12, MOST_HEADER = 1 << 20 };
    (void)how;
    if (n < LONG_START || memcmp(data, magic, sizeof magic) != 0)
        return bf_fail_at(err, file->path, 0, "is no NumPy array; save it with numpy.save, not savez");
    const bool is_long = data[6] > 1;
    const size_t start = is_long ? LONG_START : SHORT_START;
    const size_t length = (size_t)bits_at((const unsigned char *)data + 8, is_long ? 4 : 2, false);
    if (length > n - start || length > MOST_HEADER)
        return bf_fail_at(err, file->path, 0, "is cut off in its header; save it again");
    char *header = bf_alloc(length + 1, 1);
    memcpy(header, data + start, length);
    struct array a = {0};
    const enum bf_status status = read_array(file, header, data + start + length, n - start - length, &a, err);
    free(a.fields);
    free(header);
    return status;
}

static enum import_match recognise(const char *path, const char *data, size_t n)
{
    (void)path;
    return import_starts_with(data, n, magic, sizeof magic) ? IMPORT_MATCH_CONTENT : IMPORT_NO_MATCH;
}

const struct import_format import_format_npy = {
    .name = "npy", .title = "NumPy array", .recognise = recognise, .read = read_npy};
