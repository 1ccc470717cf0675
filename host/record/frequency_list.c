/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A list of measured frequencies: one mode a line, "frequency_Hz[, sd_Hz[, damping_ratio]]". */
#include "record.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double highest_Hz = 1e9;

static bool separates(char c)
{
    return c == ',' || c == ';' || c == ' ' || c == '\t';
}

/* Up to three numbers of a line; false: something else stands there. */
static bool split(const char *s, const char *end, double number[3], size_t *n)
{
    for (*n = 0; s < end;) {
        while (s < end && separates(*s))
            s++;
        const char *from = s;
        while (s < end && !separates(*s))
            s++;
        if (s > from && (*n == 3 || !number_parse(from, s, '.', &number[(*n)++])))
            return false;
    }
    return true;
}

static enum bf_status take(struct frequency_list *list, const struct lines *in, const double number[3], size_t n,
                           struct bf_error *err)
{
    const struct measured_frequency mode = {
        .frequency_Hz = number[0], .sd_Hz = n > 1 ? number[1] : 0.0, .damping_ratio = n > 2 ? number[2] : nan("")};
    const double before = list->n > 0 ? list->modes[list->n - 1].frequency_Hz : 0.0;
    if (!(mode.frequency_Hz > before && mode.frequency_Hz <= highest_Hz))
        return bf_fail_at(err, in->path, in->number,
                          "frequency %.9g Hz; give frequencies above 0 in ascending order, one a line", number[0]);
    if (!(mode.sd_Hz >= 0.0 && mode.sd_Hz < mode.frequency_Hz))
        return bf_fail_at(err, in->path, in->number,
                          "standard error %.9g Hz of %.9g Hz; the second number of a line is the frequency's standard "
                          "error in Hz",
                          mode.sd_Hz, number[0]);
    if (n > 2 && !(mode.damping_ratio >= 0.0 && mode.damping_ratio < 1.0))
        return bf_fail_at(err, in->path, in->number, "damping ratio %.9g; it lies between 0 and 1 (1 %% is 0.01)",
                          mode.damping_ratio);
    if (list->n == FREQUENCY_LIST_MOST)
        return bf_fail_at(err, in->path, in->number, "more than %d frequencies; keep the lowest", FREQUENCY_LIST_MOST);
    list->modes = bf_grow(list->modes, list->n + 1, sizeof *list->modes);
    list->modes[list->n++] = mode;
    return BF_OK;
}

enum bf_status frequency_list_read(const char *path, struct frequency_list *out, struct bf_error *err)
{
    struct lines in;
    const char *text = NULL;
    size_t length = 0;
    bool header = true;
    *out = (struct frequency_list){0};
    enum bf_status status = lines_open(path, &in, err);
    if (status != BF_OK)
        return status;
    while ((status = lines_next(&in, &text, &length, err)) == BF_OK && text != NULL) {
        const char *end = text + length;
        double number[3] = {0.0};
        size_t n;
        while (text < end && separates(*text))
            text++;
        if (text == end || *text == '#')
            continue;
        const bool numbers = split(text, end, number, &n);
        if (!numbers && header && out->n == 0 && (isalpha((unsigned char)*text) || *text == '"')) {
            header = false; /* names of the columns */
            continue;
        }
        status = numbers ? take(out, &in, number, n, err)
                         : bf_fail_at(err, path, in.number,
                                      "not a mode; write frequency_Hz, and after a comma its standard error in Hz and "
                                      "the damping ratio where they are known");
        if (status != BF_OK)
            break;
    }
    lines_close(&in);
    if (status == BF_OK && out->n == 0)
        status = bf_fail_at(err, path, 1, "no frequency in it; write one a line, in Hz");
    if (status != BF_OK)
        frequency_list_free(out);
    return status;
}

void frequency_list_free(struct frequency_list *list)
{
    free(list->modes);
    *list = (struct frequency_list){0};
}
