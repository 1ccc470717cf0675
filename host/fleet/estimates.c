/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The units' estimates out of RESULTS, as vectors with their own covariances. */
#include "fleet.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Units by name, sorted, to find their place. */
struct index {
    size_t n;
    struct name {
        const char *name;
        size_t at;
    } * names;
};

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct name *)a)->name, ((const struct name *)b)->name);
}

static void index_of(char *const names[], size_t n, struct index *out)
{
    *out = (struct index){n, bf_alloc(n, sizeof *out->names)};
    for (size_t i = 0; i < n; i++)
        out->names[i] = (struct name){names[i], i};
    qsort(out->names, n, sizeof *out->names, by_name);
}

/* index->n when there is none. */
static size_t find(const struct index *index, const char *name)
{
    const struct name wanted = {name, 0};
    const struct name *found = index->n > 0 ? bsearch(&wanted, index->names, index->n, sizeof wanted, by_name) : NULL;
    return found != NULL ? found->at : index->n;
}

static bool take_unit(void *context, const struct fleet_value v[], size_t n)
{
    struct fleet_estimates *e = context;
    e->units = bf_grow(e->units, e->n + n, sizeof *e->units);
    e->units[e->n++] = bf_strdup(v[0].text);
    return true;
}

static bool take_parameter(void *context, const struct fleet_value v[], size_t n)
{
    struct fleet_estimates *e = context;
    e->parameters = bf_grow(e->parameters, e->p + n, sizeof *e->parameters);
    e->si_units = bf_grow(e->si_units, e->p + n, sizeof *e->si_units);
    e->logarithmic = bf_grow(e->logarithmic, e->p + n, sizeof *e->logarithmic);
    e->parameters[e->p] = bf_strdup(v[0].text);
    e->si_units[e->p] = bf_strdup(v[1].text);
    e->logarithmic[e->p++] = v[2].number > 0.0;
    return true;
}

/* What is being read, and where it belongs. */
struct reading {
    struct fleet_estimates *e;
    struct index units, parameters;
};

/* unit, parameter, value, sd. A diagonal covariance: those of a fit come after. */
static bool take_value(void *context, const struct fleet_value v[], size_t n)
{
    struct reading *r = context;
    struct fleet_estimates *e = r->e;
    const size_t i = find(&r->units, v[0].text), k = find(&r->parameters, v[1].text);
    const double value = v[2].number, sd = v[3].number;
    if (n != 4 || i == e->n || k == e->p || !(sd > 0.0) || !isfinite(value) || (e->logarithmic[k] && !(value > 0.0)))
        return true;
    e->x[i * e->p + k] = e->logarithmic[k] ? log(value) : value;
    e->S[(i * e->p + k) * e->p + k] = e->logarithmic[k] ? (sd / value) * (sd / value) : sd * sd;
    return true;
}

/* unit, a, b, covariance, whether a and b are logarithmic in this unit. */
static bool take_covariance(void *context, const struct fleet_value v[], size_t n)
{
    struct reading *r = context;
    struct fleet_estimates *e = r->e;
    const size_t i = find(&r->units, v[0].text), a = find(&r->parameters, v[1].text),
                 b = find(&r->parameters, v[2].text);
    if (n != 6 || i == e->n || a == e->p || b == e->p || !isfinite(v[3].number) || !isfinite(e->x[i * e->p + a]) ||
        !isfinite(e->x[i * e->p + b]))
        return true;
    double scale = 1.0; /* where a unit has the logarithm and the fleet has not */
    if (v[4].number > 0.0 && !e->logarithmic[a])
        scale *= e->x[i * e->p + a];
    if (v[5].number > 0.0 && !e->logarithmic[b])
        scale *= e->x[i * e->p + b];
    e->S[(i * e->p + a) * e->p + b] = e->S[(i * e->p + b) * e->p + a] = scale * v[3].number;
    return true;
}

static bool take_found(void *context, const struct fleet_value v[], size_t n)
{
    struct reading *r = context;
    struct fleet_estimates *e = r->e;
    const size_t i = find(&r->units, v[0].text), p = e->p;
    if (n != 1 || i == e->n)
        return true;
    e->from_found[i] = true;
    for (size_t k = 0; k < p; k++)
        e->x[i * p + k] = nan("");
    memset(e->S + i * p * p, 0, p * p * sizeof *e->S);
    return true;
}

static enum bf_status read_values(struct fleet_results *results, struct reading *r, struct bf_error *err)
{
    enum bf_status status = fleet_results_ask(results,
                                              "SELECT unit, name, value, sd FROM parameters WHERE stage = 'fit' AND "
                                              "estimated AND identifiable AND NOT at_bound",
                                              NULL, take_value, r, err);
    if (status == BF_OK)
        status = fleet_results_ask(results,
                                   "SELECT c.unit, c.a, c.b, c.covariance, p.logarithmic, q.logarithmic FROM "
                                   "covariances c JOIN parameters p ON p.unit = c.unit AND p.name = c.a AND "
                                   "p.stage = 'fit' JOIN parameters q ON q.unit = c.unit AND q.name = c.b AND "
                                   "q.stage = 'fit'",
                                   NULL, take_covariance, r, err);
    if (status == BF_OK)
        status = fleet_results_ask(results, "SELECT DISTINCT unit FROM parameters WHERE stage = 'found'", NULL,
                                   take_found, r, err);
    if (status == BF_OK)
        status = fleet_results_ask(results,
                                   "SELECT unit, name, value, sd FROM parameters WHERE stage = 'found' AND estimated",
                                   NULL, take_value, r, err);
    return status;
}

enum bf_status fleet_estimates_read(struct fleet_results *results, struct fleet_estimates *e, struct bf_error *err)
{
    *e = (struct fleet_estimates){0};
    enum bf_status status =
        fleet_results_ask(results, "SELECT unit FROM units NATURAL JOIN manifest WHERE status = 'done' ORDER BY place",
                          NULL, take_unit, e, err);
    if (status == BF_OK)
        status = fleet_results_ask(results,
                                   "SELECT name, max(si_unit), min(logarithmic AND value > 0) FROM parameters WHERE "
                                   "stage = 'fit' AND estimated AND identifiable AND NOT at_bound AND "
                                   "name NOT LIKE 'residual\\_%' ESCAPE '\\' AND name NOT LIKE '%@%' GROUP BY name "
                                   "HAVING 2 * count(*) >= (SELECT count(*) FROM units WHERE status = 'done') "
                                   "ORDER BY min(rowid)",
                                   NULL, take_parameter, e, err);
    e->x = bf_alloc(e->n * e->p, sizeof *e->x);
    e->S = bf_alloc(e->n * e->p * e->p, sizeof *e->S);
    e->from_found = bf_alloc(e->n, sizeof *e->from_found);
    for (size_t i = 0; i < e->n * e->p; i++)
        e->x[i] = nan("");
    struct reading reading = {.e = e};
    index_of(e->units, e->n, &reading.units);
    index_of(e->parameters, e->p, &reading.parameters);
    if (status == BF_OK)
        status = read_values(results, &reading, err);
    free(reading.units.names), free(reading.parameters.names);
    return status;
}

void fleet_estimates_free(struct fleet_estimates *e)
{
    for (size_t i = 0; i < e->n; i++)
        free(e->units[i]);
    for (size_t k = 0; k < e->p; k++)
        free(e->parameters[k]), free(e->si_units[k]);
    free(e->units), free(e->parameters), free(e->si_units), free(e->logarithmic);
    free(e->x), free(e->S), free(e->from_found);
    *e = (struct fleet_estimates){0};
}
