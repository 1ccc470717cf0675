/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of diagnose for a person. */
#include "show.h"
#include "explain/explain.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

static void print_candidates(FILE *out, const struct diagnosis *d)
{
    enum { MOST = 12, WIDTH = 40 };
    if (d->n_hypotheses == 0)
        return;
    const bool cross = d->check_kind == CHECK_CROSS;
    (void)fprintf(out, "\n%-*s %9s %9s %10s %11s\n", WIDTH, "added and refitted", "fitted",
                  cross ? "left out" : "held out", "p", "evidence");
    (void)fprintf(out, "%-*s %9.3f %9.3f\n", WIDTH, "(the model as it is)", d->baseline.fitted.noise_ratio,
                  d->baseline.check.noise_ratio);
    for (size_t i = 0; i < d->n_hypotheses && i < MOST; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        char name[256] = "";
        FILE *row = fmemopen(name, sizeof name, "w");
        if (row != NULL) {
            hypothesis_name(row, h);
            (void)fclose(row);
        }
        (void)fprintf(out, "%-*s %9.3f %9.3f %10.2g %11.4g%s%s\n", WIDTH, name, h->fitted.noise_ratio,
                      h->check.noise_ratio, h->p_value, h->evidence.bic_gain, h->rival ? "  rival" : "",
                      h->fit.converged ? "" : "  not converged");
    }
    (void)fprintf(out,
                  "Errors in units of the noise; p family-wise; evidence: fall of the whitened misfit less its "
                  "price (BIC).%s\n",
                  cross ? " Left out: each record in turn, predicted by a fit to the others; only of what the verdict "
                          "hangs on."
                        : "");
}

/* "tip_mass+sensor_lag@accel_mps2", as discriminate takes it */
static void rival_text(FILE *out, const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++) {
        const char *channel = h->model.effects[h->n_base + i].channel;
        (void)fprintf(out, "%s%s%s%s", i > 0 ? "+" : "", h->effects[i]->id, channel[0] != '\0' ? "@" : "", channel);
    }
}

static void print_next(FILE *out, const struct diagnosis *d)
{
    const char *path = d->model->path ? d->model->path : "MODEL";
    if (d->verdict == VERDICT_MISSING) {
        const struct hypothesis *best = &d->hypotheses[0];
        for (size_t i = 0; i < best->n_effects; i++) {
            const char *channel = best->model.effects[best->n_base + i].channel;
            if (i == 0)
                (void)fprintf(out, "\nNext: beamfit add %s", path);
            else
                (void)fprintf(out, "      beamfit add added%zu.yaml", i);
            (void)fprintf(out, " %s%s%s -o added%zu.yaml\n", best->effects[i]->id,
                          channel[0] != '\0' ? " --channel " : "", channel, i + 1);
        }
        (void)fprintf(out, "      beamfit fit added%zu.yaml RECORD... -o fitted.yaml --check RECORD...\n", d->n_named);
    } else if (d->verdict == VERDICT_AMBIGUOUS) {
        size_t n = 0;
        (void)fprintf(out, "\nNext: beamfit discriminate %s", path);
        for (size_t i = 0; i < d->n_hypotheses && n < DISCRIMINATE_RIVALS; i++)
            if (i == 0 || d->hypotheses[i].rival) {
                (void)fprintf(out, " ");
                rival_text(out, &d->hypotheses[i]);
                n++;
            }
        (void)fprintf(out, " RECORD... -o next.csv\n");
    }
}

void diagnose_print(FILE *out, const struct diagnosis *d)
{
    const size_t columns = text_columns();
    (void)fprintf(out, "Verdict: %s%s", verdict_name(d->verdict), d->interrupted ? " (interrupted)" : "");
    for (size_t i = 0; i < d->n_named; i++)
        (void)fprintf(out, "%s%s", i > 0 ? ", " : ": ", d->named[i]);
    (void)fprintf(out, "\n\n");
    text_print_wrapped(out, d->text, 0, columns);
    if (d->where.text[0] != '\0' && d->verdict != VERDICT_COMPLETE) {
        (void)fprintf(out, "\nWhere: ");
        text_print_wrapped(out, d->where.text, 7, columns);
    }
    if (d->linearity.text[0] != '\0') {
        (void)fprintf(out, "\nLinearity: ");
        text_print_wrapped(out, d->linearity.text, 11, columns);
    }
    if (d->attainable.modes > 0)
        (void)fputc('\n', out);
    attainable_print(out, &d->attainable, d->baseline.fitted.nrmse);
    if (d->numerics.fine)
        (void)fprintf(out, "\nComputation: twice as fine, the prediction changes by %.1g of the noise.\n",
                      d->numerics.change);
    print_candidates(out, d);
    print_next(out, d);
    (void)fprintf(out, "%.1f s, %zu evaluations of a model\n", d->seconds, d->evaluations);
}
