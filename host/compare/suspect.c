/* SPDX-License-Identifier: GPL-3.0-or-later */
/* suspect.c — what is ordinary, before a misfit is taken for physics: a silent input, a gain, a sign, a frequency, another place. */
#include "factor_pair.h"
#include "maths/maths.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double explains = 0.5;      /* of the error: a cause that leaves less is worth a sentence */
static const double band_matters = 0.15; /* share of the misfit */
static const double peak_is_off = 0.005; /* of the frequency, and at least PEAK_BINS */
static const double clearly_worse = 2.0; /* held-out error over the fitted one's */
enum { PEAK_BINS = 2, BAND_BINS = 8 };

/* ---- Spectra of a channel ---- */

struct spectra {
    size_t n;              /* samples */
    double complex *Z, *Y; /* [n/2 + 1] measured, predicted */
    double bins_a_Hz;
};

static bool spectra_new(const struct comparison_channel *c, struct spectra *out)
{
    const struct fft *plan;
    struct bf_error ignored;
    *out = (struct spectra){.n = c->n, .bins_a_Hz = (double)c->n * c->dt_s};
    if (c->n < 32 || fft_get(c->n, &plan, &ignored) != BF_OK)
        return false;
    out->Z = bf_alloc(c->n / 2 + 1, sizeof *out->Z);
    out->Y = bf_alloc(c->n / 2 + 1, sizeof *out->Y);
    fft_forward(plan, c->measured, out->Z);
    fft_forward(plan, c->predicted, out->Y);
    return true;
}

static void spectra_free(struct spectra *s)
{
    free(s->Z);
    free(s->Y);
}

static void bins_of(const struct spectra *s, const struct comparison_band *band, size_t *from, size_t *to)
{
    const size_t bins = s->n / 2 + 1;
    const double last = (double)bins;
    *from = (size_t)fmin(fmax(1.0, ceil(band->from_Hz * s->bins_a_Hz)), last);
    *to = (size_t)fmin(ceil(band->to_Hz * s->bins_a_Hz), last);
}

/* Hz of the highest line, between its neighbours by a parabola; 0: the band has no peak inside. */
static double peak_Hz(const struct spectra *s, const double complex *X, size_t from, size_t to)
{
    size_t top = from;
    for (size_t k = from; k < to; k++)
        top = cabs(X[k]) > cabs(X[top]) ? k : top;
    if (to < from + BAND_BINS || top <= from || top + 1 >= to)
        return 0.0;
    const double a = cabs(X[top - 1]), b = cabs(X[top]), c = cabs(X[top + 1]), bend = a - 2.0 * b + c;
    return ((double)top + (bend < 0.0 ? 0.5 * (a - c) / bend : 0.0)) / s->bins_a_Hz;
}

/* ---- One cause each: true and a sentence ---- */

static bool say_silent(const struct comparison *all, const struct comparison_channel *c, char text[SUSPECT_TEXT])
{
    if (record_is_driven(all->model, &all->records[c->record]))
        return false;
    (void)snprintf(
        text, SUSPECT_TEXT,
        "Every input is zero throughout, so the model predicts silence: is it the right column, or a free decay "
        "(beamfit import --free-decay)?");
    return true;
}

/* In the band with the largest share of the misfit whose peaks stand apart. */
static bool say_frequency(const struct comparison *all, const struct comparison_channel *c, char text[SUSPECT_TEXT])
{
    struct spectra s;
    double share = band_matters;
    bool said = false;
    if (!spectra_new(c, &s))
        return false;
    for (size_t b = 0; b < c->n_bands; b++) {
        size_t from, to;
        bins_of(&s, &c->bands[b], &from, &to);
        const double measured = peak_Hz(&s, s.Z, from, to), predicted = peak_Hz(&s, s.Y, from, to);
        const double apart = fabs(measured - predicted);
        if (c->bands[b].mode == 0 || c->bands[b].share < share || !(measured > 0.0) || !(predicted > 0.0) ||
            apart < PEAK_BINS / s.bins_a_Hz || apart < peak_is_off * predicted)
            continue;
        said = true;
        share = c->bands[b].share;
        (void)snprintf(text, SUSPECT_TEXT,
                       "Mode %zu is at %.4g Hz in the record and at %.4g Hz in the model (%+.2g %%): %s",
                       c->bands[b].mode, measured, predicted, 100.0 * (measured / predicted - 1.0),
                       all->model->fit.present ? "stiffness, mass or length is off there, or changes with the motion."
                                               : "fit the model first.");
    }
    spectra_free(&s);
    return said;
}

/* The factor between measured and predicted in a band; adds the band's power, and what the factor leaves of it. */
static double factor_of(const struct spectra *s, const struct comparison_band *band, double *all, double *left)
{
    size_t from, to;
    double zz = 0.0, zy = 0.0, yy = 0.0;
    bins_of(s, band, &from, &to);
    for (size_t k = from; k < to; k++) {
        zz += creal(s->Z[k] * conj(s->Z[k]));
        zy += creal(s->Z[k] * conj(s->Y[k]));
        yy += creal(s->Y[k] * conj(s->Y[k]));
    }
    *all += zz;
    *left += yy > 0.0 ? zz - zy * zy / yy : zz;
    return yy > 0.0 ? zy / yy : 0.0;
}

/* Another place of the hit or of the sensor changes how much of each mode is seen, and no frequency. */
static bool say_place(const struct comparison_channel *c, char text[SUSPECT_TEXT])
{
    enum { MOST_SAID = 4 };
    struct spectra s;
    double left = 0.0, all = 0.0;
    size_t modes = 0, n = 0;
    char factors[120] = "";
    if (!spectra_new(c, &s))
        return false;
    for (size_t b = 0; b < c->n_bands; b++) {
        const double factor = factor_of(&s, &c->bands[b], &all, &left);
        if (c->bands[b].mode > 0 && modes++ < MOST_SAID)
            n += (size_t)snprintf(factors + n, sizeof factors - n, "%smode %zu × %.2g", n > 0 ? ", " : "",
                                  c->bands[b].mode, factor);
    }
    spectra_free(&s);
    const double error = all > 0.0 ? sqrt(fmax(left, 0.0) / all) : 1.0;
    if (modes < 2 || !(error < explains * c->nrmse))
        return false;
    (void)snprintf(
        text, SUSPECT_TEXT,
        "A factor for each mode (%s) leaves %.2g %%: it was hit, driven or measured at another place than the model "
        "says.",
        factors, 100.0 * error);
    return true;
}

/* The first ordinary cause that explains the channel, or "". place: another place is asked for too, which a fit would have found. */
static void find_cause(const struct comparison *all, const struct comparison_channel *c, bool place,
                       char text[SUSPECT_TEXT])
{
    if (!say_silent(all, c, text) && !factor_scale_words(all->model, c, false, text) && !say_frequency(all, c, text) &&
        !(place && say_place(c, text)))
        text[0] = '\0';
}

void compare_suspect(const struct comparison *all, const struct comparison_channel *c, char text[SUSPECT_TEXT])
{
    find_cause(all, c, c->held_out, text);
}

/* ---- Held-out records ---- */

static bool is_far_worse(double nrmse, double noise_ratio, double fitted_nrmse)
{
    return nrmse > clearly_worse * fitted_nrmse && !compare_is_noise(noise_ratio);
}

bool disagreements_possible(const struct fit_channel_error channels[], size_t n, double fitted_nrmse)
{
    bool any = false;
    for (size_t i = 0; i < n; i++)
        any = any || channels[i].cut || is_far_worse(channels[i].nrmse, channels[i].noise_ratio, fitted_nrmse);
    return any;
}

enum bf_status disagreements_find(const struct model *model, const struct record held_out[], size_t n,
                                  const struct predict_options *options, double fitted_nrmse, struct disagreements *out,
                                  struct bf_error *err)
{
    struct comparison all;
    char cause[SUSPECT_TEXT], text[SUSPECT_TEXT + 200];
    *out = (struct disagreements){0};
    if (n == 0)
        return BF_OK;
    const enum bf_status status = compare_run(model, held_out, n, 0, options, &all, err);
    for (size_t i = 0; status == BF_OK && i < all.n_channels; i++) {
        const struct comparison_channel *c = &all.channels[i];
        if (!is_far_worse(c->nrmse, c->noise_ratio, fitted_nrmse))
            continue;
        find_cause(&all, c, true, cause);
        if (cause[0] == '\0')
            continue;
        cause[strlen(cause) - (cause[strlen(cause) - 1] == '.')] = '\0';
        (void)snprintf(text, sizeof text, "%s %s is predicted far worse than the fitted records. %s",
                       text_base_name(all.records[c->record].path), c->name, cause);
        out->notes = bf_grow(out->notes, out->n + 1, sizeof *out->notes);
        out->notes[out->n++] = bf_strdup(text);
    }
    compare_free(&all);
    return status;
}

void disagreements_free(struct disagreements *disagreements)
{
    for (size_t i = 0; i < disagreements->n; i++)
        free(disagreements->notes[i]);
    free(disagreements->notes);
    *disagreements = (struct disagreements){0};
}
