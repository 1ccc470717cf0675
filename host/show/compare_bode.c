/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_bode.c — the picture of a channel of a frequency response. */
#include "compare_plot.h"
#include "maths/maths.h"
#include "plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* One period of input, answer and prediction as lines. */
struct bode_lines {
    size_t n, n_bins;
    double *frequency_Hz, *noise, *coherence;
    double complex *U, *H, *model;
};

static void bode_lines_free(struct bode_lines *l)
{
    free(l->frequency_Hz), free(l->noise), free(l->coherence), free(l->U), free(l->H), free(l->model);
}

static struct bode_lines bode_lines_new(size_t n)
{
    const size_t m = n / 2 + 1;
    return (struct bode_lines){.n_bins = m,
                               .frequency_Hz = bf_alloc(m, sizeof(double)),
                               .noise = bf_alloc(m, sizeof(double)),
                               .coherence = bf_alloc(m, sizeof(double)),
                               .U = bf_alloc(m, sizeof(double complex)),
                               .H = bf_alloc(m, sizeof(double complex)),
                               .model = bf_alloc(m, sizeof(double complex))};
}

/* What the noise's spectrum says of a line: the standard error of |H|, and the coherence of so many averages. */
static void take_noise(const struct comparison_channel *c, double averages, double input, size_t k,
                       struct bode_lines *l)
{
    const double df_Hz = 1.0 / ((double)c->n * c->dt_s);
    const double variance = c->noise.psd[k] * df_Hz * (double)c->n * (double)c->n / 2.0 / (input * input);
    const double power = pow(cabs(l->H[l->n]), 2.0);
    l->noise[l->n] = sqrt(variance / 2.0);
    l->coherence[l->n] = power / (power + fmax(averages - 1.0, 1.0) * variance);
}

/* Lines that the pulse has, in place. */
static void divide(const struct comparison_channel *c, bool noise, double averages, struct bode_lines *l)
{
    static const double least = 1e-7; /* of the strongest line */
    double strongest = 0.0;
    for (size_t k = 0; k < l->n_bins; k++)
        strongest = fmax(strongest, cabs(l->U[k]));
    for (size_t k = 0; k < l->n_bins; k++) {
        const double input = cabs(l->U[k]);
        if (!(input > least * strongest))
            continue;
        l->frequency_Hz[l->n] = (double)k / ((double)c->n * c->dt_s);
        l->H[l->n] = l->H[k] / l->U[k];
        l->model[l->n] = l->model[k] / l->U[k];
        if (noise)
            take_noise(c, averages, input, k, l);
        l->n++;
    }
}

static enum bf_status transform(const struct comparison_channel *c, const double u[], struct bode_lines *l,
                                struct bf_error *err)
{
    const struct fft *plan;
    const enum bf_status status = fft_get(c->n, &plan, err);
    if (status)
        return status;
    fft_forward(plan, u, l->U);
    fft_forward(plan, c->measured, l->H);
    fft_forward(plan, c->predicted, l->model);
    return BF_OK;
}

bool compare_is_response(const struct comparison *all, const struct comparison_channel *c)
{
    const char *excitation = record_meta(&all->records[c->record], "excitation");
    return excitation != NULL && strcmp(excitation, RECORD_RESPONSE) == 0 && c->n_inputs == 1 &&
           c->n == all->records[c->record].n;
}

enum bf_status compare_plot_bode(const struct comparison *all, const struct comparison_channel *c,
                                 const char *directory, const char *stem, const char *title, struct bf_error *err)
{
    const struct record *record = &all->records[c->record];
    const char *input = c->inputs[0].name, *unit = strrchr(input, '_');
    double averages = 1.0;
    char per[48];
    (void)snprintf(per, sizeof per, "/%.40s", unit != NULL ? unit + 1 : input);
    struct bode_lines l = bode_lines_new(c->n);
    const bool noise =
        c->noise.psd != NULL && c->noise.n_bins == l.n_bins && record_meta_number(record, RECORD_AVERAGES, &averages);
    enum bf_status status = transform(c, record_column(record, input), &l, err);
    if (!status) {
        divide(c, noise, averages, &l);
        const struct plot_bode bode = {.directory = directory,
                                       .stem = stem,
                                       .title = title,
                                       .note = text_base_name(record->path),
                                       .quantity = c->name,
                                       .per = per,
                                       .n = l.n,
                                       .frequency_Hz = l.frequency_Hz,
                                       .measured = l.H,
                                       .model = l.model,
                                       .noise = noise ? l.noise : NULL,
                                       .coherence = noise ? l.coherence : NULL};
        status = plot_bode(&bode, err);
    }
    bode_lines_free(&l);
    return status;
}
