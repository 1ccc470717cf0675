/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of diagnose for a person. */
#include "show.h"
#include "diagnose_next.h"
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

static void print_level(FILE *out, double noise_ratio)
{
    if (isnan(noise_ratio))
        (void)fprintf(out, " %8s", "-");
    else
        (void)fprintf(out, noise_ratio < 1e4 ? " %8.3f" : " %8.3g", noise_ratio);
}

/* A name that is too long has the line for itself. */
static void print_candidate(FILE *out, const struct hypothesis *h, size_t width)
{
    char name[256] = "";
    FILE *row = fmemopen(name, sizeof name, "w");
    if (row != NULL) {
        hypothesis_name(row, h);
        (void)fclose(row);
    }
    if (text_width(name) > width)
        (void)fprintf(out, "%s\n%*s", name, (int)width, "");
    else
        text_print_padded(out, name, width);
    print_level(out, h->fitted.noise_ratio);
    print_level(out, h->check.noise_ratio);
    print_share(out, h->explained);
    print_share(out, h->held_out_explained);
    (void)fprintf(out, " %6.2f%s%s\n", h->probability, h->fit.converged ? "" : "*", h->rival ? " rival" : "");
}

static void print_candidates(FILE *out, const struct diagnosis *d)
{
    enum { MOST = 12, WIDTH = 28 };
    bool open = false;
    if (d->n_hypotheses == 0)
        return;
    const char *held_out = d->check_kind == CHECK_CROSS ? "left out" : "held out";
    (void)fprintf(out, "\n%-*s %9s %7s %9s %9s %6s\n", WIDTH, "", "times the", "noise", "explained", "%", "proba-");
    (void)fprintf(out, "%-*s %8s %8s %9s %9s %6s\n", WIDTH, "added and refitted", "fitted", held_out, "fitted",
                  held_out, "bility");
    text_print_padded(out, "(the model as it is)", WIDTH);
    print_level(out, d->baseline.fitted.noise_ratio);
    print_level(out, d->baseline.check.noise_ratio);
    (void)fputc('\n', out);
    for (size_t i = 0; i < d->n_hypotheses && i < MOST; i++) {
        print_candidate(out, &d->hypotheses[i], WIDTH);
        open = open || !d->hypotheses[i].fit.converged;
    }
    if (open)
        (void)fprintf(out, "*: its fit has not converged\n");
    if (d->check_kind == CHECK_CROSS)
        text_say(out, "", 0,
                 "Left out: each record in turn, predicted by a fit to the others; only of what the verdict hangs on.");
}

/* Commands that can be typed as they stand. */
static void print_next(FILE *out, const struct diagnosis *d, const char *written)
{
    struct diagnose_next next;
    diagnose_next(d, written, &next);
    for (size_t i = 0; i < next.n; i++)
        (void)fprintf(out, "%s%s\n", i == 0 ? "\nNext: " : "      ", next.command[i]);
    diagnose_next_free(&next);
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
        (void)fprintf(out, "\nWhere the model as it is fails:\n");
        text_say(out, "", 2, "%s", d->where.text);
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
