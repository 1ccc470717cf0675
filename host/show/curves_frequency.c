/* SPDX-License-Identifier: GPL-3.0-or-later */
/* curves_frequency.c — magnitude, phase and residual of a channel over frequency. */
#include "curves.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compare_plot.h"
#include "maths/maths.h"
#include "plot.h"
#include "report_page.h"

/* The transform of the channel's length, and what every line is divided by. */
struct channel_lines {
    size_t n_bins, usable;
    const struct fft *plan;
    double df_Hz;
    bool response;
    double complex *divisor; /* [n_bins] input, or n/2 that makes amplitudes; 0: no such line */
    double complex *line;    /* [n_bins] of what is being looked at */
    double *magnitude, *phase_deg;
};

static void channel_lines_free(struct channel_lines *l)
{
    free(l->divisor), free(l->line), free(l->magnitude), free(l->phase_deg);
}

/* The input that alone moves the beam, sample by sample beside the channel; NULL: there is none. */
static const double *only_input(const struct comparison *all, const struct comparison_channel *c)
{
    const struct record *record = &all->records[c->record];
    return c->n_inputs == 1 && c->n == record->n ? record_column(record, c->inputs[0].name) : NULL;
}

/* Lines of the input below this share of its strongest are not divided by. */
static double least_share(const struct comparison *all, const struct comparison_channel *c)
{
    return compare_is_response(all, c) ? 1e-7 : 1e-3;
}

static enum bf_status channel_lines_new(const struct comparison *all, const struct comparison_channel *c,
                                        struct channel_lines *l, struct bf_error *err)
{
    const double *u = only_input(all, c);
    double strongest = 0.0;
    *l = (struct channel_lines){.n_bins = c->n / 2 + 1, .df_Hz = 1.0 / (c->dt_s * (double)c->n), .response = u != NULL};
    if (fft_get(c->n, &l->plan, err) != BF_OK)
        return err->status;
    l->divisor = bf_alloc(l->n_bins, sizeof *l->divisor);
    l->line = bf_alloc(l->n_bins, sizeof *l->line);
    l->magnitude = bf_alloc(l->n_bins, sizeof *l->magnitude);
    l->phase_deg = bf_alloc(l->n_bins, sizeof *l->phase_deg);
    if (u != NULL)
        fft_forward(l->plan, u, l->divisor);
    for (size_t k = 0; k < l->n_bins; k++) {
        l->divisor[k] = u != NULL ? l->divisor[k] : 0.5 * (double)c->n;
        strongest = fmax(strongest, cabs(l->divisor[k]));
    }
    for (size_t k = 0; k < l->n_bins; k++) {
        const bool there = k > 0 && cabs(l->divisor[k]) > least_share(all, c) * strongest;
        l->divisor[k] = there ? l->divisor[k] : 0.0;
        l->usable += there;
    }
    return BF_OK;
}

/* Magnitude and phase of x[n] in place. */
static void look_at(struct channel_lines *l, const double x[])
{
    fft_forward(l->plan, x, l->line);
    for (size_t k = 0; k < l->n_bins; k++) {
        const bool there = cabs(l->divisor[k]) > 0.0;
        const double complex h = there ? l->line[k] / l->divisor[k] : 0.0;
        l->magnitude[k] = there ? cabs(h) : (double)NAN;
        l->phase_deg[k] = there && l->response ? carg(h) * 180.0 / M_PI : (double)NAN;
    }
}

/* The root mean square of a line that is noise alone. */
static void look_at_noise(struct channel_lines *l, const struct comparison_channel *c)
{
    const struct noise_estimate *noise = &c->noise;
    for (size_t k = 0; k < l->n_bins; k++) {
        const size_t bin =
            (size_t)lround((double)k / (double)(l->n_bins - 1) * (double)(noise->n_bins > 0 ? noise->n_bins - 1 : 0));
        const double amplitude = sqrt(2.0 * noise->psd[bin] * l->df_Hz), divisor = cabs(l->divisor[k]);
        l->magnitude[k] = divisor > 0.0 ? amplitude * 0.5 * (double)c->n / divisor : (double)NAN;
    }
}

static void put_units(struct json *out, const struct comparison_channel *c, bool response)
{
    char unit[24], per[24], both[60];
    report_unit(c->name, unit);
    (void)snprintf(both, sizeof both, "%s", unit);
    if (response) {
        report_unit(c->inputs[0].name, per);
        (void)snprintf(both, sizeof both, "%s/%s", unit[0] ? unit : "1", per[0] ? per : "1");
    }
    json_put_text(out, "unit", both);
}

static void put_prediction(struct json *const lists[3], const struct curve_grid *grid, struct channel_lines *l,
                           const struct comparison_channel *p, size_t n)
{
    double *nothing = bf_alloc(l->n_bins, sizeof *nothing);
    const bool there = p != NULL && p->n == n;
    for (size_t k = 0; k < l->n_bins; k++)
        nothing[k] = NAN;
    if (there)
        look_at(l, p->predicted);
    (void)json_push(lists[0], curve_json(grid, there ? l->magnitude : nothing, true));
    (void)json_push(lists[1], curve_json(grid, there ? l->phase_deg : nothing, false));
    if (there)
        look_at(l, p->residual);
    (void)json_push(lists[2], curve_json(grid, there ? l->magnitude : nothing, true));
    free(nothing);
}

struct json *curves_over_frequency(const struct comparison *all, const struct comparison_channel *c,
                                   const struct comparison_channel *const predictions[], size_t n, size_t most_points)
{
    enum { FEWEST = 4 };
    struct json *out = json_new_object();
    struct channel_lines l = {0};
    struct bf_error ignored;
    struct curve_grid grid;
    if (channel_lines_new(all, c, &l, &ignored) == BF_OK && l.usable >= FEWEST) {
        curve_grid_choose(l.n_bins, most_points, 0, &grid);
        json_put_text(out, "kind", l.response ? "response" : "spectrum");
        put_units(out, c, l.response);
        json_put_number(out, "step_Hz", l.df_Hz);
        json_put_number(out, "show_to_Hz", compare_worth_showing_Hz(c));
        (void)json_put(out, "grid", curve_grid_json(&grid));
        look_at(&l, c->measured);
        (void)json_put(out, "measured", curve_json(&grid, l.magnitude, true));
        (void)json_put(out, "phase", curve_json(&grid, l.phase_deg, false));
        if (c->noise.psd != NULL && c->noise.n_bins > 0) {
            look_at_noise(&l, c);
            (void)json_put(out, "noise", curve_json(&grid, l.magnitude, true));
        }
        struct json *const lists[3] = {json_put(out, "model", json_new_array()),
                                       json_put(out, "model_phase", json_new_array()),
                                       json_put(out, "residual", json_new_array())};
        for (size_t i = 0; i < n; i++)
            put_prediction(lists, &grid, &l, predictions[i], c->n);
    }
    channel_lines_free(&l);
    return out;
}
