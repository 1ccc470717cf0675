/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of diagnose for a person. */
#include "show.h"
#include "explain/explain.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* "97.3", "99.98": more digits where little is left */
static void print_share(FILE *out, double share)
{
    if (isnan(share))
        (void)fprintf(out, " %9s", "");
    else
        (void)fprintf(out, " %9.*f", share > 0.99 && share < 1.0 ? 3 : 1, 100.0 * share);
}

static void print_candidate(FILE *out, const struct hypothesis *h, int width)
{
    char name[256] = "";
    FILE *row = fmemopen(name, sizeof name, "w");
    if (row != NULL) {
        hypothesis_name(row, h);
        (void)fclose(row);
    }
    (void)fprintf(out, "%-*s %9.3f %9.3f", width, name, h->fitted.noise_ratio, h->check.noise_ratio);
    print_share(out, h->explained);
    print_share(out, h->held_out_explained);
    (void)fprintf(out, " %6.2f%s%s\n", h->probability, h->rival ? "  rival" : "",
                  h->fit.converged ? "" : "  not converged");
}

static void print_candidates(FILE *out, const struct diagnosis *d)
{
    enum { MOST = 12, WIDTH = 32 };
    if (d->n_hypotheses == 0)
        return;
    const char *held_out = d->check_kind == CHECK_CROSS ? "left out" : "held out";
    (void)fprintf(out, "\n%-*s %9s %9s %9s %9s %6s\n", WIDTH, "", "times the", "noise", "explained", "%", "proba-");
    (void)fprintf(out, "%-*s %9s %9s %9s %9s %6s\n", WIDTH, "added and refitted", "fitted", held_out, "fitted",
                  held_out, "bility");
    (void)fprintf(out, "%-*s %9.3f %9.3f\n", WIDTH, "(the model as it is)", d->baseline.fitted.noise_ratio,
                  d->baseline.check.noise_ratio);
    for (size_t i = 0; i < d->n_hypotheses && i < MOST; i++)
        print_candidate(out, &d->hypotheses[i], WIDTH);
    if (d->check_kind == CHECK_CROSS)
        (void)fprintf(out,
                      "Left out: each record in turn, predicted by a fit to the others; only of what the verdict hangs "
                      "on.\n");
}

/* "tip_mass+sensor_lag@accel_mps2", as discriminate takes it */
static void rival_text(FILE *out, const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++) {
        const char *channel = h->model.effects[h->n_base + i].channel;
        (void)fprintf(out, "%s%s%s%s", i > 0 ? "+" : "", h->effects[i]->id, channel[0] != '\0' ? "@" : "", channel);
    }
}

/* " hit.csv chirp.csv --check hit2.csv" */
static void print_records(FILE *out, const struct diagnosis *d)
{
    for (size_t r = 0; r < d->n_records; r++)
        (void)fprintf(out, " %s", d->records[r].path);
    for (size_t r = 0; r < d->n_checks; r++)
        (void)fprintf(out, "%s %s", r == 0 ? " --check" : "", d->checks[r].path);
}

/* beamfit add with the values that were found, so that a fit from there ends where the diagnosis did. */
static void print_add(FILE *out, const struct hypothesis *h, size_t i, const char *from)
{
    const struct model_effect *own = &h->model.effects[h->n_base + i];
    (void)fprintf(out, "beamfit add %s %s", from, own->effect->id);
    if (own->channel[0] != '\0')
        (void)fprintf(out, " --channel %s", own->channel);
    for (int j = 0; j < own->effect->n_parameters; j++) {
        const struct beam_parameter_info *info = &own->effect->parameters[j];
        const bool free_place = info->role == BEAM_ROLE_PLACE && !own->parameters[j].fixed;
        (void)fprintf(out, " %s=%.6g%s%s", info->name, own->parameters[j].value, free_place ? " --free " : "",
                      free_place ? info->name : "");
    }
    (void)fprintf(out, " -o added%zu.yaml\n", i + 1);
}

static void print_missing(FILE *out, const struct diagnosis *d, const char *path, const char *written)
{
    const struct hypothesis *best = &d->hypotheses[0];
    char last[32];
    (void)snprintf(last, sizeof last, "added%zu.yaml", best->n_effects);
    for (size_t i = 0; written == NULL && i < best->n_effects; i++) {
        char from[32];
        (void)snprintf(from, sizeof from, "added%zu.yaml", i);
        (void)fprintf(out, "%s", i == 0 ? "\nNext: " : "      ");
        print_add(out, best, i, i == 0 ? path : from);
    }
    (void)fprintf(out, "%sbeamfit fit %s", written ? "\nNext: " : "      ", written ? written : last);
    print_records(out, d);
    (void)fprintf(out, " -o fitted_with_%s.yaml\n", best->effects[0]->id);
    if (!best->explains) {
        (void)fprintf(out, "      beamfit diagnose fitted_with_%s.yaml", best->effects[0]->id);
        print_records(out, d);
        (void)fprintf(out, "\n");
    }
}

static void print_ambiguous(FILE *out, const struct diagnosis *d, const char *path)
{
    size_t n = 0;
    (void)fprintf(out, "\nNext: beamfit discriminate %s", path);
    for (size_t i = 0; i < d->n_hypotheses && n < DISCRIMINATE_RIVALS; i++)
        if (i == 0 || d->hypotheses[i].rival) {
            (void)fprintf(out, " ");
            rival_text(out, &d->hypotheses[i]);
            n++;
        }
    for (size_t r = 0; r < d->n_records; r++)
        (void)fprintf(out, " %s", d->records[r].path);
    (void)fprintf(out, " -o next.csv\n");
}

/* Commands that can be typed as they stand. */
static void print_next(FILE *out, const struct diagnosis *d, const char *written)
{
    const char *path = d->model->path ? d->model->path : "MODEL";
    if (d->verdict == VERDICT_MISSING)
        print_missing(out, d, path, written);
    else if (d->verdict == VERDICT_AMBIGUOUS)
        print_ambiguous(out, d, path);
}

void diagnose_print(FILE *out, const struct diagnosis *d, const char *written)
{
    const size_t columns = text_columns();
    (void)fprintf(out, "Verdict: %s%s", verdict_name(d->verdict), d->interrupted ? " (interrupted)" : "");
    for (size_t i = 0; i < d->n_named; i++)
        (void)fprintf(out, "%s%s", i > 0 ? ", " : ": ", d->named[i]);
    (void)fprintf(out, "\n\n");
    text_print_wrapped(out, d->text, 0, columns);
    if (d->where.text[0] != '\0' && d->verdict != VERDICT_COMPLETE) {
        (void)fprintf(out, "\nWhere the model as it is fails: ");
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
    print_next(out, d, written);
    (void)fprintf(out, "%.1f s, %zu evaluations of a model\n", d->seconds, d->evaluations);
}
