/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable.c — the free linear model of all records: what it is made of, and what it leaves. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Ascending. What the residues are is told where they can be computed. */
static void write_poles(struct attainable_problem *p, double top_rad, double x[], size_t n_inputs,
                        struct attainable *out)
{
    const size_t m = p->m;
    struct bf_error ignored;
    double *without = bf_alloc(m, sizeof *without);
    qsort(x, m, 2 * sizeof *x, attainable_by_frequency);
    attainable_leave_each_out(p, top_rad, x, without);
    out->modes = m;
    out->poles = bf_alloc(m, sizeof *out->poles);
    for (size_t k = 0; k < m; k++)
        out->poles[k] = (struct attainable_pole){.frequency_Hz = exp(x[2 * k]) / (2.0 * M_PI),
                                                 .damping_ratio = exp(x[2 * k + 1] - x[2 * k]),
                                                 .without_noise_ratio = without[k]};
    out->n_outputs = p->n_outputs, out->n_inputs = n_inputs;
    out->residue = bf_alloc(m * p->n_outputs * n_inputs + 1, sizeof *out->residue);
    if (attainable_residues(p, x, n_inputs, out->residue, &ignored) != BF_OK)
        for (size_t i = 0; i < m * p->n_outputs * n_inputs; i++)
            out->residue[i] = CMPLX(NAN, NAN);
    free(without);
}

enum bf_status attainable_find(const struct model *model, const struct record records[], size_t n_records,
                               const double noise_rms[], struct attainable *out, struct bf_error *err)
{
    struct attainable_problem p = {.n_slots = model->n_inputs, .n_outputs = model->n_outputs};
    double top_rad = 0.0, *x = NULL;
    *out = (struct attainable){.nrmse = nan(""),
                               .noise_ratio = nan(""),
                               .start_nrmse = nan(""),
                               .held_out_noise_ratio = nan(""),
                               .each_nrmse = nan(""),
                               .each_noise_ratio = nan("")};
    for (size_t r = 0; r < n_records; r++)
        top_rad = fmax(top_rad, M_PI / records[r].dt_s);
    double *own = NULL;
    enum bf_status status = n_records > 0 ? attainable_start_poles(model, top_rad, &p.m, &x, err) : BF_OK;
    if (noise_rms == NULL && status == BF_OK)
        status = attainable_noise(model, records, n_records, &own, err);
    if (model_differs_by_record(model)) /* they have no poles in common */
        p.m = 0;
    for (size_t r = 0; r < n_records && status == BF_OK; r++)
        attainable_add_record(&p, model, &records[r], r, own != NULL ? own : noise_rms);
    if (status == BF_OK && p.m > 0 && p.n_channels > 0) {
        out->n_channels = p.n_channels;
        out->channels = bf_alloc(p.n_channels, sizeof *out->channels);
        for (size_t r = 0; r < p.n_records; r++)
            out->n_moving += p.records[r].first && p.records[r].moving ? 1 : 0;
        status = attainable_search(&p, top_rad, x, out, err);
        if (status == BF_OK)
            write_poles(&p, top_rad, x, model->n_inputs, out);
    }
    attainable_problem_free(&p);
    free(x), free(own);
    return status;
}

static void *copy_of(const void *from, size_t n, size_t size)
{
    void *to = bf_alloc(n + 1, size);
    if (n > 0)
        memcpy(to, from, n * size);
    return to;
}

struct attainable attainable_copy(const struct attainable *attainable)
{
    struct attainable out = *attainable;
    const size_t n_residues = out.modes * out.n_outputs * out.n_inputs;
    out.poles = copy_of(out.poles, out.modes, sizeof *out.poles);
    out.residue = copy_of(out.residue, n_residues, sizeof *out.residue);
    out.channels = copy_of(out.channels, out.n_channels, sizeof *out.channels);
    return out;
}

void attainable_free(struct attainable *attainable)
{
    free(attainable->poles), free(attainable->residue);
    free(attainable->channels);
    *attainable = (struct attainable){0};
}
