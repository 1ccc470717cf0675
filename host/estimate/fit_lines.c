/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Spectra without phase as a model predicts them. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "line_rows.h"

/* Behind the slash of "accel_mps2/hammer_N". */
static void take_input(const struct record *record, struct line_spectrum *out)
{
    const size_t length = strlen(out->name);
    for (size_t c = 0; c < record->n_columns; c += 2)
        if (strncmp(record->columns[c].name, out->name, length) == 0 && record->columns[c].name[length] == '/')
            (void)snprintf(out->input, sizeof out->input, "%s", record->columns[c].name + length + 1);
}

static void take(const struct record *record, const struct line_rows *lines, const struct line_group *group,
                 struct line_spectrum *out)
{
    const size_t n = group->n;
    *out = (struct line_spectrum){.n = n,
                                  .frequency_Hz = bf_alloc(n, sizeof(double)),
                                  .measured = bf_alloc(n, sizeof(double)),
                                  .predicted = bf_alloc(n, sizeof(double)),
                                  .sd = bf_alloc(n, sizeof(double))};
    memcpy(out->name, group->name, sizeof out->name);
    out->stated = group->stated;
    take_input(record, out);
    for (size_t k = 0; k < n; k++) {
        const size_t row = group->row + k;
        const double with_noise = lines->measured[row] + lines->residual[row] * lines->scale[row];
        out->frequency_Hz[k] = record->t0_s + (double)k * record->dt_s;
        out->measured[k] = lines->measured[row];
        out->sd[k] = lines->scale[row];
        out->predicted[k] =
            lines->used[row] ? sqrt(fmax(with_noise * with_noise - lines->scale[row] * lines->scale[row], 0.0)) : 0.0;
    }
}

enum bf_status fit_line_spectra(const struct model *model, const struct record *record,
                                const struct predict_options *options, struct line_spectrum **out, size_t *n,
                                struct bf_error *err)
{
    const char *name = record_base_name(record);
    const struct predict_options defaults = {0};
    struct parameter_ref *refs;
    struct line_rows *lines = NULL;
    const size_t n_refs = model_parameters(model, &name, 1, &refs);
    double *theta = bf_alloc(n_refs + 1, sizeof *theta);
    *out = NULL, *n = 0;
    for (size_t i = 0; i < n_refs; i++)
        theta[i] = refs[i].value;
    enum bf_status status =
        lines_new(model, record, 0, 1, refs, n_refs, options != NULL ? options : &defaults, &lines, err);
    if (status == BF_OK)
        status = lines_rebase(lines, theta, true, err);
    if (status == BF_OK) {
        *out = bf_alloc(lines->n_groups, sizeof **out);
        for (; *n < lines->n_groups; ++*n)
            take(record, lines, &lines->groups[*n], &(*out)[*n]);
    }
    lines_free(lines);
    free(theta), free(refs);
    return status;
}

void line_spectra_free(struct line_spectrum spectra[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        free(spectra[i].frequency_Hz), free(spectra[i].measured), free(spectra[i].predicted), free(spectra[i].sd);
    free(spectra);
}
