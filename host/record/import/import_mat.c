/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * MATLAB files, versions 4, 5 and 7.3, by matio. Only this file sees it. Vectors become channels, matrices one channel
 * for each column (or row, if these are longer); structs and cells are opened: "data.force", "runs{2}".
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <matio.h>
#include "import_channel.h"
#include "import_format.h"

enum { DEEPEST = 8, LONGEST_NAME = 200, MOST_CHANNELS = 4096 };

static double element(const matvar_t *v, const void *data, size_t i)
{
    switch (v->data_type) {
    case MAT_T_DOUBLE:
        return ((const double *)data)[i];
    case MAT_T_SINGLE:
        return (double)((const float *)data)[i];
    case MAT_T_INT8:
        return (double)((const int8_t *)data)[i];
    case MAT_T_UINT8:
        return (double)((const uint8_t *)data)[i];
    case MAT_T_INT16:
        return (double)((const int16_t *)data)[i];
    case MAT_T_UINT16:
        return (double)((const uint16_t *)data)[i];
    case MAT_T_INT32:
        return (double)((const int32_t *)data)[i];
    case MAT_T_UINT32:
        return (double)((const uint32_t *)data)[i];
    case MAT_T_INT64:
        return (double)((const int64_t *)data)[i];
    case MAT_T_UINT64:
        return (double)((const uint64_t *)data)[i];
    default:
        return NAN;
    }
}

static bool is_numeric(const matvar_t *v)
{
    return v->class_type >= MAT_C_DOUBLE && v->class_type <= MAT_C_UINT64 && v->rank == 2 && v->dims != NULL &&
           Mat_SizeOf(v->data_type) > 0;
}

/* The last part of "data.daq.Fs" in lower case. */
static void last_part(const char *name, char out[32])
{
    const char *dot = strrchr(name, '.');
    snprintf(out, 32, "%s", dot != NULL ? dot + 1 : name);
    for (char *c = out; *c != '\0'; c++)
        *c = *c >= 'A' && *c <= 'Z' ? (char)(*c + 32) : *c;
}

/* A lone number whose name says that it is the sampling rate or step. */
static void note_rate(struct import_file *file, const char *name, double x)
{
    static const char *const rates[] = {"fs",
                                        "fsamp",
                                        "samplerate",
                                        "sample_rate",
                                        "samplingrate",
                                        "sampling_rate",
                                        "samplefrequency",
                                        "samplingfrequency",
                                        "sampling_frequency",
                                        "rate_hz",
                                        "fs_hz"};
    static const char *const steps[] = {"dt",     "ts",        "dt_s",       "ts_s",    "increment",  "delta_t",
                                        "deltat", "tinterval", "xincrement", "delta_x", "sampletime", "sample_time"};
    char part[32], from[80];
    last_part(name, part);
    snprintf(from, sizeof from, "variable '%.60s'", name);
    for (size_t i = 0; i < sizeof rates / sizeof *rates; i++)
        if (strcmp(part, rates[i]) == 0)
            import_set_rate(file, x, from);
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++)
        if (strcmp(part, steps[i]) == 0 && x > 0)
            import_set_rate(file, 1 / x, from);
}

/* n values from the first on, `stride` apart, of one part of the variable. */
static void add_vector(struct import_file *file, const char *name, const matvar_t *v, const void *data, size_t first,
                       size_t stride, size_t n)
{
    double *x = bf_alloc(n, sizeof *x);
    for (size_t k = 0; k < n; k++)
        x[k] = element(v, data, first + k * stride);
    import_add(file, name, strlen(name), x, n);
}

static void add_matrix(struct import_file *file, const char *name, const matvar_t *v, const void *data,
                       const char *part)
{
    size_t rows = v->dims[0], columns = v->dims[1];
    bool upright = rows >= columns;
    size_t count = rows == 1 || columns == 1 ? 1 : upright ? columns : rows, n = rows * columns / count;
    char full[LONGEST_NAME + 40];
    for (size_t i = 0; i < count && file->n_channels <= MOST_CHANNELS; i++) {
        if (count == 1)
            snprintf(full, sizeof full, "%s%s", name, part);
        else
            snprintf(full, sizeof full, "%s_%zu%s", name, i + 1, part);
        bool strided = count > 1 && !upright;
        add_vector(file, full, v, data, strided ? i : i * n, strided ? rows : 1, n);
    }
}

/* DEFLATE makes at most 1032 bytes of one: a variable that claims more is damaged, and its zeros are nobody's data. */
static bool fits_in_file(const struct import_file *file, const char *name, size_t bytes)
{
    static const size_t most_of_one = 1040;
    if (bytes / most_of_one <= file->n_bytes)
        return true;
    bf_warn("%s: variable '%.60s' claims %zu bytes, more than the file can hold; it is left out: save the file again",
            file->path, name, bytes);
    return false;
}

static void add_numbers(struct import_file *file, const char *name, const matvar_t *v)
{
    size_t rows = v->dims[0], columns = v->dims[1], size = Mat_SizeOf(v->data_type);
    if (v->data == NULL || rows == 0 || columns == 0 || columns > SIZE_MAX / rows / size / 2 ||
        v->nbytes < rows * columns * size || !fits_in_file(file, name, rows * columns * size))
        return;
    if (v->isComplex) {
        const mat_complex_split_t *parts = v->data;
        if (parts->Re == NULL || parts->Im == NULL)
            return;
        add_matrix(file, name, v, parts->Re, "_re");
        add_matrix(file, name, v, parts->Im, "_im");
        return;
    }
    if (rows == 1 && columns == 1)
        note_rate(file, name, element(v, v->data, 0));
    add_matrix(file, name, v, v->data, "");
}

static size_t count_elements(const matvar_t *v)
{
    size_t n = v->dims != NULL && v->rank > 0 ? 1 : 0;
    for (int i = 0; i < v->rank && v->dims != NULL; i++) {
        if (v->dims[i] > 1000000 || n > 1000000)
            return 0;
        n *= v->dims[i];
    }
    return n;
}

static void add_variable(struct import_file *file, const char *name, matvar_t *v, int depth);

/* The elements of a struct array: fields[element][field]. */
static void add_struct(struct import_file *file, const char *name, matvar_t *v, int depth)
{
    size_t n_fields = Mat_VarGetNumberOfFields(v), n = count_elements(v);
    char *const *fields = Mat_VarGetStructFieldnames(v);
    matvar_t **cells = v->data;
    if (cells == NULL || fields == NULL || n_fields == 0 || n > v->nbytes / sizeof *cells / n_fields)
        return;
    for (size_t i = 0; i < n && file->n_channels <= MOST_CHANNELS; i++)
        for (size_t k = 0; k < n_fields; k++) {
            char full[LONGEST_NAME];
            if (cells[i * n_fields + k] == NULL || fields[k] == NULL)
                continue;
            if (n == 1)
                snprintf(full, sizeof full, "%.100s.%.64s", name, fields[k]);
            else
                snprintf(full, sizeof full, "%.100s(%zu).%.64s", name, i + 1, fields[k]);
            add_variable(file, full, cells[i * n_fields + k], depth + 1);
        }
}

static void add_cell(struct import_file *file, const char *name, matvar_t *v, int depth)
{
    size_t n = count_elements(v);
    matvar_t **cells = v->data;
    if (cells == NULL || n > v->nbytes / sizeof *cells)
        return;
    for (size_t i = 0; i < n && file->n_channels <= MOST_CHANNELS; i++) {
        char full[LONGEST_NAME];
        if (cells[i] == NULL || cells[i]->data == NULL)
            continue; /* empty; there may be a million of them */
        snprintf(full, sizeof full, "%.160s{%zu}", name, i + 1);
        add_variable(file, full, cells[i], depth + 1);
    }
}

static void add_variable(struct import_file *file, const char *name, matvar_t *v, int depth)
{
    if (depth > DEEPEST || file->n_channels > MOST_CHANNELS)
        return;
    if (v->class_type == MAT_C_STRUCT)
        add_struct(file, name, v, depth);
    else if (v->class_type == MAT_C_CELL)
        add_cell(file, name, v, depth);
    else if (is_numeric(v))
        add_numbers(file, name, v);
    else if (v->class_type == MAT_C_OBJECT || v->class_type == MAT_C_OPAQUE)
        bf_warn("%s: variable '%s' is a MATLAB object and cannot be read; save its numbers as vectors", file->path,
                name);
}

static void stay_silent(int level, char *message)
{
    (void)level;
    (void)message;
}

static enum bf_status read_mat(struct import_file *file, const char *data, size_t n, const struct import_reading *how,
                               struct bf_error *err)
{
    (void)data;
    (void)how;
    file->n_bytes = n;
    Mat_LogInitFunc("beamfit", stay_silent);
    mat_t *mat = Mat_Open(file->path, MAT_ACC_RDONLY);
    if (mat == NULL)
        return bf_fail_at(err, file->path, 0, "is no MATLAB file, or damaged; save it again (save -v7 or -v7.3)");
    matvar_t *v;
    while ((v = Mat_VarReadNext(mat)) != NULL) {
        add_variable(file, v->name != NULL ? v->name : "channel", v, 0);
        Mat_VarFree(v);
    }
    Mat_Close(mat);
    if (file->n_channels == 0)
        return bf_fail_at(err, file->path, 0,
                          "has no numeric variable that can be read; save vectors of numbers "
                          "(objects, tables and timeseries are not readable outside MATLAB)");
    return BF_OK;
}

static enum import_match recognise(const char *path, const char *data, size_t n)
{
    static const char hdf5[] = "\x89HDF\r\n\x1a\n";
    const char *dot = strrchr(path, '.');
    if (import_starts_with(data, n, "MATLAB ", 7) || import_starts_with(data, n, hdf5, 8) ||
        (n > 520 && memcmp(data + 512, hdf5, 8) == 0))
        return IMPORT_MATCH_CONTENT;
    /* MATLAB 4 has no signature */
    return dot != NULL && strcasecmp(dot, ".mat") == 0 ? IMPORT_MATCH_FILENAME : IMPORT_NO_MATCH;
}

const struct import_format import_format_mat = {
    .name = "mat", .title = "MATLAB 4 to 7.3", .recognise = recognise, .read = read_mat, .by_outside_library = true};
