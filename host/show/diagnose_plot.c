/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_plot.c — the pictures of a diagnosis, and its ranking. */
#include "diagnose_pictures.h"
#include "show.h"
#include "plot.h"
#include "plot_gnuplot.h"
#include "ground/ground.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ROWS = 16 }; /* of the ranking */

static void name_hypothesis(const struct hypothesis *h, char *text, size_t size)
{
    size_t n = 0;
    text[0] = '\0';
    for (size_t i = 0; i < h->n_effects && n + 1 < size; i++)
        n += (size_t)snprintf(text + n, size - n, "%s%s", i > 0 ? " + " : "", h->effects[i]->id);
}

/* ---- Ranking ---- */

static bool named(const struct diagnosis *d, const struct hypothesis *h)
{
    if (d->verdict == VERDICT_MISSING)
        return h == &d->hypotheses[0];
    return d->verdict == VERDICT_AMBIGUOUS && (h == &d->hypotheses[0] || h->rival);
}

static enum bf_status draw_ranking(const struct diagnose_pictures *p, struct bf_error *err)
{
    const struct diagnosis *d = p->d;
    struct plot_rank rows[MOST_ROWS + 1];
    char names[MOST_ROWS][120], title[300];
    size_t n = 0, refitted = 0;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        refitted += h->refitted;
        if (!h->refitted || n == MOST_ROWS)
            continue;
        name_hypothesis(h, names[n], sizeof names[n]);
        rows[n] = (struct plot_rank){.name = names[n],
                                     .fitted = h->fitted.noise_ratio,
                                     .held_out = h->check.noise_ratio,
                                     .gain = h->evidence.bic_gain,
                                     .named = named(d, h)};
        n++;
    }
    rows[n] = (struct plot_rank){.name = "(the model as it is)",
                                 .fitted = d->baseline.fitted.noise_ratio,
                                 .held_out = d->baseline.check.noise_ratio,
                                 .gain = NAN,
                                 .named = d->verdict == VERDICT_COMPLETE};
    n++;
    if (refitted > n - 1)
        (void)snprintf(title, sizeof title, "Explanations, verdict: %s (best %zu of %zu)", verdict_name(d->verdict),
                       n - 1, refitted);
    else
        (void)snprintf(title, sizeof title, "Explanations, verdict: %s", verdict_name(d->verdict));
    const struct plot_ranking ranking = {
        .directory = p->directory, .stem = "diagnose-ranking", .title = title, .n = n, .rows = rows};
    return plot_ranking(&ranking, err);
}

/* ---- All ---- */

enum { STEMS = 4 };
static const char *const stems[STEMS] = {"diagnose-amplitude", "diagnose-misfit", "diagnose-ranking", "diagnose-force"};

enum bf_status diagnose_plot_prepare(const char *directory, struct bf_error *err)
{
    return plot_prepare(directory, stems, STEMS, err);
}

static void find_heading(struct diagnose_pictures *p)
{
    const struct diagnosis *d = p->d;
    for (size_t i = 0; i < d->n_hypotheses && p->best == NULL; i++)
        if (d->hypotheses[i].refitted)
            p->best = &d->hypotheses[i];
    if (p->best == NULL) {
        (void)snprintf(p->heading, sizeof p->heading, "of the model given (verdict: %s)", verdict_name(d->verdict));
        return;
    }
    name_hypothesis(p->best, p->best_name, sizeof p->best_name);
    (void)snprintf(p->heading, sizeof p->heading, "before and after adding %s (verdict: %s)", p->best_name,
                   verdict_name(d->verdict));
}

static enum bf_status predict_both(struct diagnose_pictures *p, const struct record *records,
                                   const struct predict_options *options, struct bf_error *err)
{
    const struct diagnosis *d = p->d;
    const size_t n = d->n_records + d->n_checks;
    enum bf_status status = compare_run(&d->baseline.model, records, n, d->n_checks, options, &p->before, err);
    if (!status && p->best != NULL)
        status = compare_run(&p->best->model, records, n, d->n_checks, options, &p->after, err);
    return status;
}

static enum bf_status draw_all(const struct diagnose_pictures *p, enum bf_status status, struct bf_error *err)
{
    bool drawn;
    if (!status && !progress_interrupted())
        status = diagnose_plot_drift(p, &drawn, err);
    if (!status && !progress_interrupted())
        status = diagnose_plot_misfit(p, err);
    if (!status && !progress_interrupted())
        status = draw_ranking(p, err);
    if (!status && !progress_interrupted() && p->d->reconstructed)
        status = diagnose_plot_force(p, err);
    if (progress_interrupted())
        bf_warn("interrupted: not every picture is drawn");
    return status;
}

enum bf_status diagnose_plot(const struct diagnosis *d, const struct predict_options *options, const char *directory,
                             struct bf_error *err)
{
    struct diagnose_pictures p = {.d = d, .directory = directory};
    struct predict_options quiet = options != NULL ? *options : (struct predict_options){0};
    for (int i = 0; i < STEMS; i++)
        plot_forget(directory, stems[i]);
    if (d->interrupted) {
        bf_warn("interrupted: no pictures are drawn");
        return BF_OK;
    }
    struct record *records = bf_alloc(d->n_records + d->n_checks, sizeof *records);
    quiet.quiet = true;
    memcpy(records, d->records, d->n_records * sizeof *records);
    if (d->n_checks > 0)
        memcpy(records + d->n_records, d->checks, d->n_checks * sizeof *records);
    find_heading(&p);
    enum bf_status status = predict_both(&p, records, &quiet, err);
    status = draw_all(&p, status, err);
    compare_free(&p.before);
    compare_free(&p.after);
    free(records);
    return status;
}
