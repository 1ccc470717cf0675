/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the noise that is left makes of standard errors: JᵀWCWJ, C its covariance. */
#include "fit_coloured.h"

#include <stdlib.h>
#include "fit_shares.h"
#include "maths/maths.h"

void fit_noise_models(const struct fit_problem *p, struct interval_channel channels[])
{
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        double *r = bf_alloc(channel->n, sizeof *r);
        size_t n = 0;
        for (; n < channel->n && p->weight[channel->row + n] > 0.0; n++)
            r[n] = channel->measured[n] - p->fitted[channel->row + n];
        channels[c].row = channel->row;
        channels[c].n = n;
        ar_fit(r, n, &channels[c].noise);
        free(r);
    }
}

/* JᵀWCWJ[n × n] of rows that are handed on: the end of each channel comes first. */
struct coloured {
    const struct fit_problem *p;
    const struct interval_channel *channels;
    double *later; /* [n_channels][n_unknowns × AR_MAX] */
    double *square;
};

static enum bf_status colour_rows(void *context, size_t channel, size_t row, size_t some, const double J[],
                                  const double r[], struct bf_error *err)
{
    const struct coloured *c = context;
    const size_t n = c->p->n_unknowns;
    double *V = bf_alloc(some * n, sizeof *V);
    (void)r, (void)err;
    for (size_t j = 0; j < n; j++)
        for (size_t k = 0; k < some; k++)
            V[k + j * some] = c->p->weight[row + k] * J[k + j * some];
    intervals_add_block(&c->channels[channel].noise, some, n, V, c->later + channel * n * AR_MAX, c->square);
    free(V);
    return BF_OK;
}

enum bf_status fit_coloured_square(struct fit_problem *p, const double x[], struct interval_channel channels[],
                                   size_t n_channels, double square[], struct bf_error *err)
{
    if (p->shares != NULL)
        return shares_coloured(p, x, square, err);
    const size_t n = p->n_unknowns, lines = lines_rows(p->lines);
    if (!p->compressed) {
        intervals_add_coloured(p->n_rows, n, p->jacobian, p->weight, n_channels, channels, square);
        return fit_input_square(p, square, err);
    }
    struct coloured c = {.p = p, .channels = channels, .square = square};
    struct prediction y;
    c.later = bf_alloc(p->n_channels * n * AR_MAX, sizeof *c.later);
    const enum bf_status status =
        fit_problem_blocks(p, x, &(struct fit_rows_sink){.take = colour_rows, .context = &c}, &y, err);
    for (size_t g = p->n_channels; g < n_channels; g++)
        channels[g].row -= p->n_sample_rows;
    intervals_add_coloured(p->n_jacobian, n, p->jacobian + p->n_jacobian - lines, p->weight + p->n_sample_rows,
                           n_channels - p->n_channels, channels + p->n_channels, square);
    free(c.later);
    return status;
}
