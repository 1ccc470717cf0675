/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "curve_grid.h"

#include <math.h>
#include <stdlib.h>

#include "html.h"

enum { LARGEST = 32000, NO_VALUE = -32768 };

/* ---- Which samples ---- */

static void add_segment(struct curve_grid *grid, size_t first, size_t end, size_t step)
{
    if (end > first)
        grid->segments[grid->n_segments++] = (struct curve_segment){
            first, step, step == 1 ? end - first : 2 * ((end - first + 2 * step - 1) / (2 * step))};
}

void curve_grid_choose(size_t n, size_t most, size_t whole_from, struct curve_grid *out)
{
    *out = (struct curve_grid){.n = n};
    if (n <= most) {
        add_segment(out, 0, n, 1);
        return;
    }
    const size_t whole = most / 2, rest = n - whole;
    const size_t step = (rest + whole - 1) / whole + 1; /* a bucket is 2·step samples and two points */
    size_t from = whole_from < n - whole ? whole_from : n - whole;
    from -= from % (2 * step);
    add_segment(out, 0, from, step);
    add_segment(out, from, from + whole, 1);
    add_segment(out, from + whole, n, step);
}

size_t curve_grid_points(const struct curve_grid *grid)
{
    size_t n = 0;
    for (size_t s = 0; s < grid->n_segments; s++)
        n += grid->segments[s].points;
    return n;
}

struct json *curve_grid_json(const struct curve_grid *grid)
{
    struct json *list = json_new_array();
    for (size_t s = 0; s < grid->n_segments; s++) {
        struct json *one = json_push(list, json_new_object());
        json_put_number(one, "first", (double)grid->segments[s].first);
        json_put_number(one, "step", (double)grid->segments[s].step);
        json_put_number(one, "n", (double)grid->segments[s].points);
    }
    return list;
}

/* ---- Values ---- */

/* The extremes of y[from ... end) in the order in which they come; NAN when there is no value. */
static void extremes(const double y[], size_t from, size_t end, double two[2])
{
    size_t low = end, high = end;
    for (size_t i = from; i < end; i++) {
        if (!isfinite(y[i]))
            continue;
        low = low == end || y[i] < y[low] ? i : low;
        high = high == end || y[i] > y[high] ? i : high;
    }
    two[0] = low == end ? (double)NAN : y[low < high ? low : high];
    two[1] = low == end ? (double)NAN : y[low < high ? high : low];
}

/* out: [curve_grid_points()] */
static void take(const struct curve_grid *grid, const double y[], double out[])
{
    for (size_t s = 0; s < grid->n_segments; s++) {
        const struct curve_segment *segment = &grid->segments[s];
        for (size_t i = 0; i < segment->points; i += segment->step == 1 ? 1 : 2) {
            const size_t at = segment->first + i * segment->step, end = at + 2 * segment->step;
            if (segment->step == 1)
                *out++ = y[at];
            else
                extremes(y, at, end < grid->n ? end : grid->n, out), out += 2;
        }
    }
}

struct json *curve_json(const struct curve_grid *grid, const double y[], bool decibels)
{
    static const double hundredth_dB = 0.01;
    const size_t n = curve_grid_points(grid);
    double *points = bf_alloc(n, sizeof *points), largest = 0.0;
    unsigned char *bytes = bf_alloc(n, 2);
    char *text = NULL;
    size_t size = 0;
    take(grid, y, points);
    for (size_t i = 0; i < n; i++)
        largest = isfinite(points[i]) ? fmax(largest, fabs(points[i])) : largest;
    const double scale = decibels ? hundredth_dB : largest > 0.0 ? largest / LARGEST : 1.0;
    for (size_t i = 0; i < n; i++) {
        const double x = decibels ? 20.0 * log10(points[i]) : points[i];
        const double level = isfinite(x) ? fmax(fmin(x / scale, LARGEST), -LARGEST) : NO_VALUE;
        const unsigned bits = (unsigned)(int)lround(level) & 0xFFFFU;
        bytes[2 * i] = (unsigned char)(bits & 0xFFU);
        bytes[2 * i + 1] = (unsigned char)(bits >> 8);
    }
    struct json *curve = json_new_object();
    json_put_number(curve, "scale", scale);
    FILE *f = open_memstream(&text, &size);
    if (f != NULL) {
        html_base64(f, bytes, 2 * n);
        (void)fclose(f);
    }
    json_put_text(curve, "data", text != NULL ? text : "");
    free(text), free(bytes), free(points);
    return curve;
}
