/* SPDX-License-Identifier: GPL-3.0-or-later */
/* invented_refits.h — refits with invented errors, and the verdict on them. */
#ifndef BEAMFIT_INVENTED_REFITS_H
#define BEAMFIT_INVENTED_REFITS_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "explain/diagnose_state.h"
#include "model_fixture.h"

enum { ROWS = 24000, CHANNELS = 6, FACTS = 24, TRIED = 400 };

/* In every fact and channel the same. */
static inline void set_errors(struct hypothesis_errors *e, double ratio)
{
    static double bins[CHANNELS], doubt[CHANNELS];
    static size_t record[CHANNELS];
    e->n_channels = CHANNELS;
    e->noise_ratio = e->worst_ratio = e->humless_ratio = e->humless_worst = ratio;
    e->misfit = (struct misfit){.chi_square = ratio * ratio * ROWS, .n = ROWS, .n_eff = ROWS};
    e->ratio = test_malloc(CHANNELS * sizeof(double));
    e->bins = bins, e->doubt = doubt, e->record = record;
    for (size_t c = 0; c < CHANNELS; c++)
        e->ratio[c] = ratio, bins[c] = 0.5 * ROWS / CHANNELS, doubt[c] = 0.02, record[c] = c;
}

static inline double *left_by(double ratio)
{
    double *left = test_malloc(FACTS * sizeof(double));
    for (size_t f = 0; f < FACTS; f++)
        left[f] = ratio * ratio;
    return left;
}

static inline struct hypothesis refit(const char *id, const char *second, size_t n_added, double fitted, double check)
{
    struct hypothesis h = {.n_effects = second ? 2 : 1, .n_added = n_added, .refitted = true, .left = left_by(fitted)};
    h.effects[0] = effect_by_id(id);
    h.effects[1] = second ? effect_by_id(second) : NULL;
    set_errors(&h.fitted, fitted);
    set_errors(&h.check, check);
    return h;
}

static inline void forget(struct hypothesis *h)
{
    test_free(h->left), test_free(h->fitted.ratio), test_free(h->check.ratio);
}

/* The hypotheses are decide()'s afterwards. */
static inline void decide(struct diagnosis *d, const struct model *model, double fitted, double check,
                          struct hypothesis hypotheses[], size_t n)
{
    static struct fact facts[FACTS];
    for (size_t f = 0; f < FACTS; f++)
        facts[f] = (struct fact){.channel = f / 4, .noise = 1.0, .bins = 0.5 * ROWS / FACTS, .doubt = 0.02};
    *d = (struct diagnosis){.model = model,
                            .hypotheses = hypotheses,
                            .n_hypotheses = n,
                            .n_facts = FACTS,
                            .facts = facts,
                            .numerics.fine = true};
    d->baseline.left = left_by(fitted);
    set_errors(&d->baseline.fitted, fitted);
    set_errors(&d->baseline.check, check);
    diagnose_rank(d, TRIED);
    diagnose_decide(d);
}

static inline void done(struct diagnosis *d)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        forget(&d->hypotheses[i]);
    forget(&d->baseline);
}

static inline void without_hum(struct hypothesis_errors *e, double ratio)
{
    e->humless_ratio = e->humless_worst = ratio;
}

static inline int setup(void **state)
{
    static struct model model;
    fixture_model(&model, "");
    *state = &model;
    return 0;
}

static inline int teardown(void **state)
{
    model_free(*state);
    return 0;
}

#endif
