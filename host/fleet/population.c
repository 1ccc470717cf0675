/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the units of RESULTS are together. */
#include "population.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

bool fleet_column_number(const char *text, double *x)
{
    struct tm tm = {0};
    const char *rest = strptime(text, "%Y-%m-%d", &tm);
    if (rest == NULL)
        return decimal_parse(text, x) && isfinite(*x);
    if (*rest == 'T' || *rest == ' ') {
        const char *seconds = strptime(rest + 1, "%H:%M", &tm);
        rest = seconds != NULL && *seconds == ':' ? strptime(seconds + 1, "%S", &tm) : seconds;
        rest = rest != NULL && *rest == 'Z' ? rest + 1 : rest;
    }
    *x = (double)timegm(&tm) / 86400.0;
    return rest != NULL && *rest == '\0';
}

/* ---- Drift ---- */

/* One column of the manifest: of each unit with estimates its number, NaN where it has none. */
struct column {
    const struct fleet_estimates *e;
    size_t at; /* the units come in the same order */
    double *t;
};

static bool take_cell(void *context, const struct fleet_value v[], size_t n)
{
    struct column *c = context;
    double x;
    while (c->at < c->e->n && strcmp(c->e->units[c->at], v[0].text) != 0)
        c->at++;
    if (n == 2 && c->at < c->e->n && fleet_column_number(v[1].text, &x))
        c->t[c->at] = x;
    return true;
}

struct names {
    size_t n;
    char **names;
};

static bool take_name(void *context, const struct fleet_value v[], size_t n)
{
    struct names *names = context;
    names->names = bf_grow(names->names, names->n + n, sizeof *names->names);
    names->names[names->n++] = bf_strdup(v[0].text);
    return true;
}

enum { FEWEST = 5 }; /* units, for a line */

/* Each parameter against one column. */
static void try_column(struct fleet_population *out, const bool use[], const char *column, const double t[])
{
    const struct fleet_estimates *e = &out->estimates;
    double *at = bf_alloc(e->n, sizeof *at), *y = bf_alloc(e->n, sizeof *y), *sd = bf_alloc(e->n, sizeof *sd);
    for (size_t k = 0; k < e->p; k++) {
        size_t n = 0;
        bool varies = false;
        for (size_t i = 0; i < e->n; i++) {
            if (!use[i] || !isfinite(t[i]) || !isfinite(e->x[i * e->p + k]))
                continue;
            at[n] = t[i], y[n] = e->x[i * e->p + k], sd[n] = sqrt(e->S[(i * e->p + k) * e->p + k]);
            varies = varies || at[n] > at[0] || at[n] < at[0];
            n++;
        }
        if (n < FEWEST || !varies)
            continue;
        struct fleet_drift drift = {.parameter = k, .column = bf_strdup(column), .t = bf_alloc(e->n, sizeof *drift.t)};
        memcpy(drift.t, t, e->n * sizeof *t);
        population_line(n, at, y, sd, &drift);
        out->drifts = bf_grow(out->drifts, out->n_drifts + 1, sizeof *out->drifts);
        out->drifts[out->n_drifts++] = drift;
    }
    free(at), free(y), free(sd);
}

static int by_p_value(const void *a, const void *b)
{
    const struct fleet_drift *x = a, *y = b;
    return (x->p_value > y->p_value) - (x->p_value < y->p_value);
}

/* Those that stay below the rate when all pairs are counted. */
static void keep_significant(struct fleet_population *out)
{
    size_t kept = 0;
    out->n_tested = out->n_drifts;
    for (size_t k = 0; k < out->n_drifts; k++) {
        struct fleet_drift *drift = &out->drifts[k];
        drift->p_value = fmin(1.0, (double)out->n_tested * drift->p_value);
        if (drift->p_value < out->false_alarm_rate)
            out->drifts[kept++] = *drift;
        else
            free(drift->column), free(drift->t);
    }
    out->n_drifts = kept;
    if (kept > 1)
        qsort(out->drifts, kept, sizeof *out->drifts, by_p_value);
}

static enum bf_status find_drifts(struct fleet_results *results, struct fleet_population *out, const bool use[],
                                  struct bf_error *err)
{
    struct names names = {0};
    double *t = bf_alloc(out->estimates.n, sizeof *t);
    enum bf_status status = fleet_results_ask(results, "SELECT name FROM columns GROUP BY name ORDER BY min(rowid)",
                                              NULL, take_name, &names, err);
    for (size_t c = 0; c < names.n; c++) {
        struct column column = {&out->estimates, 0, t};
        for (size_t i = 0; i < out->estimates.n; i++)
            t[i] = nan("");
        if (status == BF_OK)
            status = fleet_results_ask(results,
                                       "SELECT unit, value FROM columns NATURAL JOIN manifest NATURAL JOIN units "
                                       "WHERE name = ?1 AND status = 'done' ORDER BY place",
                                       names.names[c], take_cell, &column, err);
        if (status == BF_OK)
            try_column(out, use, names.names[c], t);
        free(names.names[c]);
    }
    keep_significant(out);
    free(names.names), free(t);
    return status;
}

/* ---- All ---- */

static bool take_counts(void *context, const struct fleet_value v[], size_t n)
{
    struct fleet_population *out = context;
    if (n == 2) {
        out->n_units = (size_t)v[0].number;
        out->n_failed = (size_t)v[1].number;
    }
    return false;
}

enum bf_status fleet_population_find(struct fleet_results *results, double false_alarm_rate,
                                     struct fleet_population *out, struct bf_error *err)
{
    *out = (struct fleet_population){.false_alarm_rate = false_alarm_rate};
    enum bf_status status = fleet_results_ask(
        results, "SELECT count(*), sum(status IS NOT NULL AND status <> 'done') FROM manifest NATURAL LEFT JOIN units",
        NULL, take_counts, out, err);
    if (status == BF_OK)
        status = fleet_estimates_read(results, &out->estimates, err);
    if (status == BF_OK)
        status = population_verdicts(results, out, err);
    if (status != BF_OK)
        return status;
    struct bf_error why = {BF_OK, ""};
    bool *use = bf_alloc(out->estimates.n, sizeof *use);
    out->has_mixed = population_outliers(out, use, &why) == BF_OK;
    if (!out->has_mixed) {
        out->n_outliers = 0;
        (void)snprintf(out->why_not, sizeof out->why_not, "%.255s", why.text);
    }
    if (out->has_mixed)
        status = find_drifts(results, out, use, err);
    free(use);
    return status;
}

void fleet_population_free(struct fleet_population *p)
{
    for (size_t k = 0; k < p->n_effects; k++) {
        struct fleet_effect *e = &p->effects[k];
        free(e->id), free(e->parameter), free(e->si_unit), free(e->units), free(e->value), free(e->value_sd);
    }
    for (size_t k = 0; k < p->n_drifts; k++)
        free(p->drifts[k].column), free(p->drifts[k].t);
    for (size_t i = 0; i < p->n_diagnosed; i++)
        free(p->diagnosed[i]);
    free(p->effects), free(p->drifts), free(p->diagnosed), free(p->outliers);
    fleet_mixed_free(&p->mixed);
    fleet_estimates_free(&p->estimates);
    *p = (struct fleet_population){0};
}
