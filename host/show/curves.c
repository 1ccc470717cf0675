/* SPDX-License-Identifier: GPL-3.0-or-later */
/* curves.c — measured, predicted and residual of every channel as the page's script reads them. */
#include "curves.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compare_plot.h"
#include "compare_text.h"
#include "plot.h"
#include "report_page.h"

/* Of the text of all curves together, over time and over frequency alike, in a page to send: five records stay below 3 MB. */
static const double page_bytes = 1.33e6;
static const double bytes_a_point = 2.7; /* two bytes as base64 */
enum { MOST_POINTS = 1000000 };

/* Points that each of so many may have. */
static size_t share_of(double bytes, size_t curves, size_t least, size_t most)
{
    const double points = bytes / bytes_a_point / (double)(curves > 0 ? curves : 1);
    return points < (double)least ? least : points > (double)most ? most : (size_t)points;
}

/* The channel of another comparison of the same records; NULL: that model has none of this name. */
static const struct comparison_channel *same_channel(const struct comparison *other, const struct comparison_channel *c)
{
    for (size_t i = 0; i < other->n_channels; i++)
        if (other->channels[i].record == c->record && strcmp(other->channels[i].name, c->name) == 0)
            return &other->channels[i];
    return NULL;
}

static void put_explanations(struct json *root, const struct curves *curves)
{
    struct json *list = json_put(root, "explanations", json_new_array());
    for (size_t i = 0; i < curves->n; i++) {
        const struct explanation *e = &curves->explanations[i];
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "name", e->name);
        json_put_number(one, "probability", e->probability);
        json_put_number(one, "explained", e->explained);
        json_put_number(one, "nrmse", e->comparison->nrmse);
        json_put_number(one, "noise_ratio", e->comparison->noise_ratio);
        json_put_number(one, "check_nrmse", e->comparison->check_nrmse);
        json_put_number(one, "check_noise_ratio", e->comparison->check_noise_ratio);
    }
}

static struct json *over_time(const struct comparison_channel *c, const struct comparison_channel *const predictions[],
                              size_t n, size_t points)
{
    struct json *out = json_new_object();
    struct curve_grid grid;
    const bool whole = c->n <= points / (1 + n); /* predicted is then measured less residual, sample by sample */
    const size_t most_points = whole ? c->n : points / (1 + 2 * n);
    curve_grid_choose(c->n, most_points, plot_most_motion(c->measured, c->n, most_points / 2), &grid);
    json_put_number(out, "start_s", c->t0_s);
    json_put_number(out, "step_s", c->dt_s);
    json_put_number(out, "noise_rms", c->noise.rms > 0.0 ? c->noise.rms : (double)NAN);
    (void)json_put(out, "grid", curve_grid_json(&grid));
    (void)json_put(out, "measured", curve_json(&grid, c->measured, false));
    struct json *model = json_put(out, "model", json_new_array());
    struct json *residual = json_put(out, "residual", json_new_array());
    double *nothing = bf_alloc(c->n, sizeof *nothing);
    for (size_t i = 0; i < c->n; i++)
        nothing[i] = NAN;
    for (size_t i = 0; i < n; i++) {
        const struct comparison_channel *p = predictions[i];
        const bool there = p != NULL && p->n == c->n;
        if (!whole)
            (void)json_push(model, curve_json(&grid, there ? p->predicted : nothing, false));
        (void)json_push(residual, curve_json(&grid, there ? p->residual : nothing, false));
    }
    free(nothing);
    return out;
}

static void put_channel(struct json *list, const struct curves *curves, const struct comparison_channel *c,
                        size_t time_points, size_t frequency_points)
{
    const struct comparison *all = curves->explanations[curves->after].comparison;
    const struct comparison_channel **predictions = bf_alloc(curves->n, sizeof *predictions);
    struct json *one = json_push(list, json_new_object());
    char text[1200], unit[24];
    for (size_t i = 0; i < curves->n; i++)
        predictions[i] = same_channel(curves->explanations[i].comparison, c);
    compare_finding(all, c, text, sizeof text);
    report_unit(c->name, unit);
    json_put_text(one, "record", text_base_name(all->records[c->record].path));
    json_put_text(one, "name", c->name);
    json_put_text(one, "unit", unit);
    json_put_bool(one, "held_out", c->held_out);
    json_put_text(one, "text", text);
    struct json *ratios = json_put(one, "noise_ratio", json_new_array()),
                *errors = json_put(one, "nrmse", json_new_array());
    for (size_t i = 0; i < curves->n; i++) {
        json_push_number(ratios, predictions[i] != NULL ? predictions[i]->noise_ratio : (double)NAN);
        json_push_number(errors, predictions[i] != NULL ? predictions[i]->nrmse : (double)NAN);
    }
    (void)json_put(one, "time", over_time(c, predictions, curves->n, time_points));
    (void)json_put(one, "frequency", curves_over_frequency(all, c, predictions, curves->n, frequency_points));
    free(predictions);
}

/* ---- Which channels ---- */

/* How much the reader wants to see it: times the noise; what has no noise ratio first. */
static double urgency(const struct comparison_channel *c)
{
    return isfinite(c->noise_ratio) ? c->noise_ratio : HUGE_VAL;
}

size_t curves_choose(const struct comparison *all, size_t most, bool chosen[])
{
    size_t n = 0;
    for (size_t i = 0; i < all->n_channels; i++)
        chosen[i] = false;
    for (; n < most; n++) {
        size_t best = all->n_channels;
        for (size_t i = 0; i < all->n_channels; i++)
            if (!chosen[i] && all->channels[i].n >= COMPARE_PLOT &&
                (best == all->n_channels || urgency(&all->channels[i]) > urgency(&all->channels[best])))
                best = i;
        if (best == all->n_channels)
            break;
        chosen[best] = true;
    }
    return n;
}

struct json *curves_json(const struct curves *curves)
{
    const struct comparison *all = curves->explanations[curves->after].comparison;
    struct json *root = json_new_object();
    bool *chosen = bf_alloc(all->n_channels, sizeof *chosen);
    const size_t n = curves_choose(all, curves->most_channels, chosen);
    const double bytes = curves->bytes > 0.0 ? curves->bytes : page_bytes;
    const size_t fewest = 600 * (1 + 2 * curves->n);
    const size_t time_points = share_of(bytes, n, fewest, (1 + curves->n) * (size_t)MOST_POINTS);
    const size_t frequency_points = share_of(bytes, n * (3 + 3 * curves->n), 400, MOST_POINTS);
    json_put_number(root, "before", (double)curves->before);
    json_put_number(root, "after", (double)curves->after);
    put_explanations(root, curves);
    struct json *list = json_put(root, "channels", json_new_array());
    for (size_t i = 0; i < all->n_channels; i++)
        if (chosen[i])
            put_channel(list, curves, &all->channels[i], time_points, frequency_points);
    free(chosen);
    return root;
}
