/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_lines_plot.c — pictures of records that are no samples: spectra without phase beside the model. */
#include "compare_plot.h"
#include "plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Lines that were measured and predicted, as plot_bode() takes them. */
static enum bf_status draw_spectrum(const struct record records[], size_t r, const struct line_spectrum *s,
                                    const char *directory, struct bf_error *err)
{
    const char *file = text_base_name(records[r].path);
    const char *unit = strrchr(s->input, '_');
    char stem[PLOT_STEM], title[160], per[80];
    double complex *measured = bf_alloc(s->n, sizeof *measured), *model = bf_alloc(s->n, sizeof *model);
    double *f_Hz = bf_alloc(s->n, sizeof *f_Hz);
    size_t n = 0;
    for (size_t k = 0; k < s->n; k++)
        if (s->predicted[k] > 0.0 && s->measured[k] > 0.0) {
            f_Hz[n] = s->frequency_Hz[k];
            measured[n] = s->measured[k];
            model[n++] = s->predicted[k];
        }
    compare_name_picture(records, r, s->name, stem);
    (void)snprintf(title, sizeof title, "%.60s: measured, without phase, and model", s->name);
    (void)snprintf(per, sizeof per, "/%.60s", unit != NULL ? unit + 1 : s->input);
    const struct plot_bode bode = {.directory = directory,
                                   .stem = stem,
                                   .title = title,
                                   .note = file,
                                   .quantity = s->name,
                                   .per = per,
                                   .n = n,
                                   .frequency_Hz = f_Hz,
                                   .measured = measured,
                                   .model = model,
                                   .without_phase = true};
    const enum bf_status status = n >= 4 ? plot_bode(&bode, err) : BF_OK;
    free(measured), free(model), free(f_Hz);
    return status;
}

enum bf_status compare_lines_plot(const struct line_comparison *lines, const char *directory, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t r = 0; r < lines->n && !status; r++) {
        for (size_t i = 0; i < lines->spectra[r].n && !status; i++)
            status = draw_spectrum(lines->records, r, &lines->spectra[r].all[i], directory, err);
        if (!status && lines->tables[r].n_pairs > 0)
            status = pole_table_plot(&lines->tables[r], text_base_name(lines->records[r].path), directory, err);
    }
    return status;
}
