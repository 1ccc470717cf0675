/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Universal File Format, dataset 58 (function at nodal degree of freedom) as text and as binary (58b), with the title of
 * dataset 151 and the units of dataset 164. Written from the format's description by SDRC and UC-SDRL:
 *
 *     "    -1" / "    58" or "    58b" + byte order, float format, 11, bytes / 11 records of text / values / "    -1"
 *
 * Values: y; x y (uneven abscissa); re im; x re im. Precision: single or double by record 7, field 1 (2 and 5 single, 4
 * and 6 double; 5 and 6 complex). The byte count of the 58b line is wrong in files of several writers, so the count comes
 * from record 7 and is checked by the "    -1" that must follow.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import_channel.h"
#include "import_format.h"
#include "import_units.h"
#include "import_uff_header.h"
#include "record/record.h"

static bool is_complex(const struct uff_header *h)
{
    return h->data_type >= 5;
}

static bool is_double(const struct uff_header *h)
{
    return h->data_type == 4 || h->data_type == 6;
}

static double read_float(const char *s, bool big_endian, size_t size)
{
    unsigned char bytes[8];
    for (size_t i = 0; i < size; i++)
        bytes[i] = (unsigned char)s[big_endian ? size - 1 - i : i]; /* to little-endian order */
    uint64_t bits = 0;
    for (size_t i = 0; i < size; i++)
        bits |= (uint64_t)bytes[i] << 8 * i;
    if (size == 4) {
        uint32_t bits32 = (uint32_t)bits;
        float f;
        memcpy(&f, &bits32, sizeof f);
        return (double)f;
    }
    double d;
    memcpy(&d, &bits, sizeof d);
    return d;
}

/* Does the dataset end at s? "    -1", perhaps after line ends. */
static bool ends_at(const struct uff_cursor *c, const char *s)
{
    while (s < c->end && (*s == '\r' || *s == '\n' || *s == ' '))
        s++;
    return c->end - s >= 2 && s[0] == '-' && s[1] == '1' &&
           (c->end - s == 2 || s[2] == '\r' || s[2] == '\n' || s[2] == ' ');
}

/* columns[] of n values each: abscissa (uneven), then real, then imaginary part. */
static enum bf_status read_binary(struct uff_cursor *c, struct uff_header *h, size_t n_columns,
                                  double *const columns[3], struct bf_error *err)
{
    size_t size = is_double(h) ? 8 : 4, left = (size_t)(c->end - c->s);
    size_t x_size = h->even ? 0 : size, row = n_columns * size;
    if (!h->even && is_double(h) && row <= left / h->n && !ends_at(c, c->s + h->n * row) && row - 4 <= left / h->n &&
        ends_at(c, c->s + h->n * (row - 4))) { /* single precision abscissa, as in text */
        x_size = 4;
        row -= 4;
    } else if (!h->even && is_double(h) && row > left / h->n) {
        x_size = 4;
        row -= 4;
    }
    if (row > left / h->n || !ends_at(c, c->s + h->n * row))
        return bf_fail_at(
            err, c->path, h->line,
            "dataset 58b: no '    -1' behind %lu values of %zu bytes (the file says %lu bytes); it is cut off "
            "or damaged by a transfer as text",
            h->n, row, h->bytes);
    h->abscissa_single = x_size == 4;
    for (size_t k = 0; k < h->n; k++) {
        const char *s = c->s + k * row;
        for (size_t i = 0; i < n_columns; i++) {
            size_t width = i == 0 && x_size > 0 ? x_size : size;
            columns[i][k] = read_float(s, h->big_endian, width);
            s += width;
        }
    }
    c->s += h->n * row;
    return BF_OK;
}

/* Field width i of a line of text: E13.5 for single precision and for every uneven abscissa, else E20.12. */
static size_t width_of(const struct uff_header *h, size_t i)
{
    bool abscissa = !h->even && i % (is_complex(h) ? 3 : 2) == 0;
    return is_double(h) && !abscissa ? 20 : 13;
}

/* The numbers of one line, as words or, where they touch, in their columns. Returns how many; `most` + 1: a bad one. */
static size_t read_numbers(const struct uff_header *h, struct uff_line l, double x[], size_t most)
{
    struct uff_line word, rest = l;
    size_t n = 0;
    bool words = true;
    while (words && n < most && uff_take_word(&rest, &word))
        words = uff_number(word.s, word.end, &x[n++]) && word.end - word.s <= 25;
    if (words)
        return uff_take_word(&rest, &word) ? most + 1 : n;
    n = 0;
    for (size_t from = 0; from < (size_t)(l.end - l.s) && n < most; n++) {
        struct uff_line f = uff_field(l, from, width_of(h, n));
        from += width_of(h, n);
        if (f.s == f.end)
            break;
        if (!uff_number(f.s, f.end, &x[n]))
            return most + 1;
    }
    return n;
}

static enum bf_status read_text(struct uff_cursor *c, const struct uff_header *h, size_t n_columns,
                                double *const columns[3], struct bf_error *err)
{
    enum { MOST = 16 };
    double x[MOST + 1];
    size_t wanted = h->n * n_columns, got = 0;
    struct uff_line l;
    while (got < wanted) {
        if (!uff_take_line(c, &l) || uff_is_delimiter(l))
            return bf_fail_at(err, c->path, c->line, "dataset 58 ends after %zu of %zu numbers; the file is cut off",
                              got, wanted);
        size_t n = read_numbers(h, l, x, MOST);
        if (n > MOST)
            return bf_fail_at(err, c->path, c->line, "dataset 58: not a line of numbers; the file is damaged");
        if (n > wanted - got)
            return bf_fail_at(err, c->path, c->line,
                              "dataset 58: more numbers than the %lu values that record 7 states", h->n);
        for (size_t i = 0; i < n; i++, got++)
            columns[got % n_columns][got / n_columns] = x[i];
    }
    return BF_OK;
}

/* Name and SI unit of a specific data type; NULL: not one that a beam's record needs. */
static const char *kind_name(int kind, const char **unit)
{
    static const struct {
        int kind;
        const char *name, *unit;
    } kinds[] = {
        {2, "stress", "Pa"},    {3, "strain", "strain"}, {5, "temperature", ""},        {8, "displacement", "m"},
        {9, "force", "N"},      {11, "velocity", "m/s"}, {12, "acceleration", "m/s^2"}, {13, "force", "N"},
        {15, "pressure", "Pa"}, {17, "time", "s"},       {18, "frequency", "Hz"}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (kinds[i].kind == kind) {
            *unit = kinds[i].unit;
            return kinds[i].name;
        }
    *unit = "";
    return NULL;
}

/* What earlier datasets said of all: the code of dataset 164 (1 is SI), 0 none. */
struct context {
    int units_code;
};

static void name_of(const struct uff_header *h, char name[128])
{
    static const char *const directions[] = {"", "X",  "Y",  "Z",  "RX",  "RY",  "RZ",
                                             "", "-X", "-Y", "-Z", "-RX", "-RY", "-RZ"};
    const char *unit, *kind = kind_name(h->ordinate.kind, &unit);
    int d = h->response_direction;
    const char *direction = d >= 0 && d <= 6 ? directions[d] : d < 0 && d >= -6 ? directions[7 - d] : "";
    if (kind == NULL && !uff_is_none(h->ordinate.label))
        snprintf(name, 128, "%.*s", (int)(h->ordinate.label.end - h->ordinate.label.s), h->ordinate.label.s);
    else
        snprintf(name, 128, "%s", kind != NULL ? kind : "channel");
    if (h->response_node > 0)
        snprintf(name + strlen(name), 40, "_%d%s", h->response_node, direction);
}

/* The factor from the abscissa's unit to seconds; 0 when the abscissa is not time. */
static double time_factor(const struct uff_header *h)
{
    char text[24] = "";
    struct import_unit unit;
    bool is_time = h->abscissa.kind == 17 || ((h->abscissa.kind == 0 || h->abscissa.kind == 1) && h->function <= 1);
    size_t n = (size_t)(h->abscissa.unit.end - h->abscissa.unit.s);
    if (!is_time)
        return 0;
    if (uff_is_none(h->abscissa.unit))
        return 1;
    memcpy(text, h->abscissa.unit.s, n < sizeof text ? n : sizeof text - 1);
    if (!import_unit(text, &unit))
        return 1;
    return strcmp(unit.SI, "s") == 0 ? unit.factor : 0;
}

/* A frequency response or a coherence over even frequencies. */
static bool is_response(const struct uff_header *h)
{
    enum { FUNCTION_RESPONSE = 4, FUNCTION_COHERENCE = 6, KIND_FREQUENCY = 18 };
    return (h->function == FUNCTION_RESPONSE || h->function == FUNCTION_COHERENCE) && h->even &&
           (h->abscissa.kind == KIND_FREQUENCY || h->abscissa.kind == 0);
}

static void describe(struct import_channel *ch, const struct uff_header *h, const struct context *context)
{
    const char *unit;
    kind_name(h->ordinate.kind, &unit);
    if (!uff_is_none(h->ordinate.unit))
        import_set_text(&ch->unit, h->ordinate.unit.s, (size_t)(h->ordinate.unit.end - h->ordinate.unit.s));
    else if (context->units_code == 1)
        import_set_text(&ch->unit, unit, strlen(unit));
    if (!uff_is_none(h->title))
        import_set_text(&ch->about, h->title.s, (size_t)(h->title.end - h->title.s));
    if (time_factor(h) > 0)
        return;
    ch->over_frequency = is_response(h);
    if (!ch->over_frequency)
        ch->unusable = "its abscissa is neither time nor the even frequencies of a response or a coherence";
}

/* The columns become channels, which then own the numbers. */
static void add_channels(struct import_file *file, const struct uff_header *h, const struct context *context,
                         double *columns[3])
{
    char name[128 + 8];
    size_t axis = IMPORT_NO_AXIS;
    double factor = time_factor(h);
    if (!h->even) {
        snprintf(name, sizeof name, factor > 0 ? "time" : "abscissa");
        axis = file->n_channels;
        struct import_channel *t = import_add(file, name, strlen(name), columns[0], h->n);
        if (!h->binary) /* E13.5 */
            t->digits = (struct number_digits){6, 300};
        else if (h->abscissa_single)
            t->digits = (struct number_digits){7, 300};
        if (factor > 0)
            import_set_text(&t->unit, factor == 1 ? "s" : h->abscissa.unit.s,
                            factor == 1 ? 1 : (size_t)(h->abscissa.unit.end - h->abscissa.unit.s));
        else
            t->unusable = "it is the abscissa of a spectrum or the like";
    }
    for (size_t part = 0; part < (is_complex(h) ? 2 : 1); part++) {
        char base[128];
        name_of(h, base);
        snprintf(name, sizeof name, "%s%s", base, !is_complex(h) ? "" : part == 0 ? "_re" : "_im");
        struct import_channel *ch = import_add(file, name, strlen(name), columns[(h->even ? 0 : 1) + part], h->n);
        ch->axis = axis;
        describe(ch, h, context);
        if (h->even && ch->unusable == NULL && h->dx > 0) {
            const double unit = ch->over_frequency ? 1.0 : factor;
            ch->t0_s = h->x0 * unit;
            ch->dt_s = time_axis_round_step(h->dx, 6) * unit; /* record 7 has E13.5 */
        }
    }
}

static enum bf_status read_58(struct import_file *file, struct uff_cursor *c, struct uff_line first,
                              const struct context *context, struct bf_error *err)
{
    struct uff_header h;
    if (uff_read_header(c, first, &h, err) != BF_OK)
        return err->status;
    size_t n_columns = (h.even ? 0u : 1u) + (is_complex(&h) ? 2u : 1u);
    double *columns[3] = {NULL, NULL, NULL};
    for (size_t i = 0; i < n_columns; i++)
        columns[i] = bf_alloc(h.n, sizeof(double));
    enum bf_status status =
        h.binary ? read_binary(c, &h, n_columns, columns, err) : read_text(c, &h, n_columns, columns, err);
    if (status == BF_OK) {
        add_channels(file, &h, context, columns);
        return BF_OK;
    }
    for (size_t i = 0; i < n_columns; i++)
        free(columns[i]);
    return status;
}

/* Units (164) and title (151): the first line has what is wanted. */
static void read_other(struct import_file *file, struct uff_cursor *c, long number, struct context *context)
{
    struct uff_cursor at = *c;
    struct uff_line l;
    long code;
    if ((number != 151 && number != 164) || !uff_take_line(&at, &l) || uff_is_delimiter(l))
        return;
    struct uff_line text = uff_field(l, number == 151 ? 0 : 10, number == 151 ? UFF_WIDTH : 20);
    struct uff_line code_field = uff_field(l, 0, 10); /* the description may touch it */
    if (number == 164)
        context->units_code = uff_take_integer(&code_field, &code) ? (int)code : 0;
    if (!uff_is_none(text))
        import_add_meta(file, number == 151 ? "source_title" : "source_units", text.s, (size_t)(text.end - text.s));
}

static enum bf_status read_uff(struct import_file *file, const char *data, size_t n, const struct import_reading *how,
                               struct bf_error *err)
{
    (void)how;
    struct uff_cursor c = {file->path, data, data + n, 0};
    struct context context = {0};
    struct uff_line l, word, rest;
    while (uff_take_line(&c, &l)) {
        if (!uff_is_delimiter(l))
            continue;
        do { /* a file may close one dataset and open the next with a single delimiter */
            if (!uff_take_line(&c, &l))
                return BF_OK;
        } while (uff_is_delimiter(l));
        rest = l;
        if (!uff_take_word(&rest, &word))
            continue;
        size_t digits = strspn(word.s, "0123456789");
        double number = 0;
        number_parse(word.s, word.s + digits, '.', &number);
        if (number == 58) {
            if (read_58(file, &c, l, &context, err) != BF_OK)
                return err->status;
        } else {
            read_other(file, &c, number < 1e6 ? (long)number : 0, &context);
        }
        while (uff_take_line(&c, &l) && !uff_is_delimiter(l))
            ;
    }
    return BF_OK;
}

/* "    -1" on the first line that is not blank. */
static enum import_match recognise(const char *path, const char *data, size_t n)
{
    (void)path;
    const char *s = data, *end = data + (n < 400 ? n : 400);
    while (s < end && (*s == ' ' || *s == '\r' || *s == '\n'))
        s++;
    if (!import_starts_with(s, (size_t)(end - s), "-1", 2))
        return IMPORT_NO_MATCH;
    for (s += 2; s < end && (*s == ' ' || *s == '\r' || *s == '\n'); s++)
        if (*s == '\n')
            return IMPORT_MATCH_CONTENT;
    return IMPORT_NO_MATCH;
}

const struct import_format import_format_uff = {
    .name = "uff", .title = "Universal File Format 58", .recognise = recognise, .read = read_uff};
