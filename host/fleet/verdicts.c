/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the diagnoses of a fleet say together. */
#include "population.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const verdicts[FLEET_VERDICT_KINDS] = {"complete", "missing", "ambiguous", "unknown"};

static bool take_verdict(void *context, const struct fleet_value v[], size_t n)
{
    struct fleet_population *out = context;
    out->diagnosed = bf_grow(out->diagnosed, out->n_diagnosed + n, sizeof *out->diagnosed);
    out->diagnosed[out->n_diagnosed++] = bf_strdup(v[0].text);
    for (size_t k = 0; k < FLEET_VERDICT_KINDS; k++)
        out->n_verdicts[k] += strcmp(v[1].text, verdicts[k]) == 0;
    return true;
}

static struct fleet_effect *effect_of(struct fleet_population *out, const char *id)
{
    for (size_t k = 0; k < out->n_effects; k++)
        if (strcmp(out->effects[k].id, id) == 0)
            return &out->effects[k];
    out->effects = bf_grow(out->effects, out->n_effects + 1, sizeof *out->effects);
    out->effects[out->n_effects] = (struct fleet_effect){.id = bf_strdup(id)};
    return &out->effects[out->n_effects++];
}

/* unit, effect, first parameter, value, sd, unit of it: of one effect in one unit. */
static bool take_effect(void *context, const struct fleet_value v[], size_t n)
{
    struct fleet_population *out = context;
    struct fleet_effect *effect = effect_of(out, v[1].text);
    size_t i = 0;
    while (i < out->n_diagnosed && strcmp(out->diagnosed[i], v[0].text) != 0)
        i++;
    if (n != 6 || i == out->n_diagnosed)
        return true;
    effect->units = bf_grow(effect->units, effect->n + 1, sizeof *effect->units);
    effect->units[effect->n++] = i;
    if (effect->parameter == NULL) {
        effect->parameter = bf_strdup(v[2].text);
        effect->si_unit = bf_strdup(v[5].text);
    }
    if (!(v[4].number > 0.0))
        return true;
    effect->value = bf_grow(effect->value, effect->n_values + 1, sizeof *effect->value);
    effect->value_sd = bf_grow(effect->value_sd, effect->n_values + 1, sizeof *effect->value_sd);
    effect->value[effect->n_values] = v[3].number;
    effect->value_sd[effect->n_values++] = v[4].number;
    return true;
}

/* Mean and spread of one parameter, the units' own errors taken off. */
static void pool(struct fleet_effect *effect)
{
    double *S = bf_alloc(effect->n_values, sizeof *S);
    bool linear = false;
    struct fleet_mixed mixed;
    struct bf_error ignored;
    const struct fleet_estimates e = {.n = effect->n_values,
                                      .p = 1,
                                      .parameters = &effect->parameter,
                                      .logarithmic = &linear,
                                      .x = effect->value,
                                      .S = S};
    effect->mean = effect->sd = effect->spread = nan("");
    for (size_t i = 0; i < effect->n_values; i++)
        S[i] = effect->value_sd[i] * effect->value_sd[i];
    if (effect->n_values > 0 && fleet_mixed_fit(&e, NULL, &mixed, &ignored) == BF_OK) {
        effect->mean = mixed.mean[0];
        effect->sd = sqrt(mixed.mean_covariance[0]);
        effect->spread = sqrt(mixed.spread[0]);
        fleet_mixed_free(&mixed);
    } else if (effect->n_values == 1) {
        effect->mean = effect->value[0];
        effect->sd = effect->value_sd[0];
    } else if (effect->n_values > 0) {
        fleet_mixed_free(&mixed);
    }
    free(S);
}

static int by_frequency(const void *a, const void *b)
{
    const struct fleet_effect *x = a, *y = b;
    return x->n != y->n ? (x->n < y->n) - (x->n > y->n) : strcmp(x->id, y->id);
}

enum bf_status population_verdicts(struct fleet_results *results, struct fleet_population *out, struct bf_error *err)
{
    enum bf_status status = fleet_results_ask(
        results, "SELECT v.unit, v.verdict FROM verdicts v JOIN manifest m ON m.unit = v.unit ORDER BY m.place", NULL,
        take_verdict, out, err);
    if (status == BF_OK)
        status = fleet_results_ask(results,
                                   "SELECT e.unit, e.effect, e.parameter, e.value, e.sd, e.si_unit FROM effects e "
                                   "JOIN verdicts v ON v.unit = e.unit AND v.verdict = 'missing' JOIN manifest m ON "
                                   "m.unit = e.unit WHERE e.rowid IN (SELECT min(rowid) FROM effects GROUP BY unit, "
                                   "effect) ORDER BY m.place, e.rowid",
                                   NULL, take_effect, out, err);
    for (size_t k = 0; k < out->n_effects; k++)
        pool(&out->effects[k]);
    if (out->n_effects > 1)
        qsort(out->effects, out->n_effects, sizeof *out->effects, by_frequency);
    return status;
}
