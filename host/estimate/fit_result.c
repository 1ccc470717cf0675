/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_result.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fit_coloured.h"
#include "intervals.h"
#include "identifiability.h"
#include "line_statistics.h"

static const double extent_linear = 10.0; /* in θ/scale: what counts as 100 % for a parameter that may be 0 */
/* A parameter this many times off its start is a wrong unit somewhere. */
static const double suspicious_gain = 100.0, suspicious_beam = 30.0;
static const double close_to_bound = 1e-9;

static void warn(struct fit_result *out, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void warn(struct fit_result *out, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    out->warnings = bf_grow(out->warnings, out->n_warnings + 1, sizeof *out->warnings);
    out->warnings[out->n_warnings++] = bf_strdup(text);
}

/* ---- Covariance ---- */

static void warn_about_guessed_errors(const struct fit_problem *p, const bool known[], struct fit_result *out)
{
    for (size_t g = 0; p->lines != NULL && g < p->lines->n_groups; g++)
        if (!known[g])
            warn(out,
                 "%s: %s without standard errors, and none is left over to tell them from: %s was taken for each; say "
                 "how well they are known (columns sd_Hz and damping_sd)",
                 p->names[p->lines->groups[g].record], p->lines->groups[g].name,
                 p->lines->groups[g].kind == LINE_FREQUENCY ? "0.5 %" : "20 %");
}

static enum bf_status covariance(struct fit_problem *p, const double x[], struct fit_result *out, double cov[],
                                 struct bf_error *err)
{
    const size_t n = p->n_unknowns, n_groups = p->lines != NULL ? p->lines->n_groups : 0;
    bool *known = bf_alloc(n_groups + 1, sizeof *known);
    double *precision = bf_alloc(n, sizeof *precision), *extent = bf_alloc(n, sizeof *extent);
    double *basis = bf_alloc(n * n, sizeof *basis), *coloured = bf_alloc(n * n, sizeof *coloured);
    struct interval_channel *channels = bf_alloc(p->n_channels + n_groups, sizeof *channels);
    for (size_t i = 0; i < n; i++) {
        const struct unknown *u = &p->unknowns[i];
        precision[i] = u->prior > 0.0 ? 1.0 / (u->prior * u->prior) : 0.0;
        extent[i] = u->logarithmic ? 1.0 : extent_linear;
    }
    const double inflation = sqrt(fmax(1.0, fit_problem_mean_square(p)));
    struct identifiability *id = &out->identifiability;
    enum bf_status status =
        identifiability_compute(p->n_jacobian, n, p->jacobian, precision, extent, inflation, id, err);
    if (!status) {
        for (size_t j = 0; j < id->kept; j++) /* V is in x/extent and need not be orthonormal in x: any basis serves */
            for (size_t i = 0; i < n; i++)
                basis[i + j * n] = id->V[i + j * n] * extent[i];
        fit_noise_models(p, channels);
        status = lines_noise(p, channels + p->n_channels, known, err);
    }
    if (!status) {
        warn_about_guessed_errors(p, known, out);
        status = fit_coloured_square(p, x, channels, p->n_channels + n_groups, coloured, err);
    }
    if (!status)
        status = intervals_from_coloured(p->n_jacobian, n, p->jacobian, precision, fit_problem_form_scale(p), coloured,
                                         basis, id->kept, cov, err);
    free(known), free(precision), free(extent), free(basis), free(coloured), free(channels);
    return status;
}

/* ---- Parameters ---- */

static void fill_parameter(const struct fit_problem *p, size_t ref, struct fit_parameter *out)
{
    const struct parameter_ref *r = &p->refs[ref];
    *out = (struct fit_parameter){.start = r->value, .value = r->value, .sd = nan(""), .ci95 = {nan(""), nan("")}};
    memcpy(out->label, r->label, sizeof out->label);
    memcpy(out->unit, r->info->unit, sizeof out->unit);
}

static void fill_estimate(const struct fit_problem *p, size_t i, const double x[], double variance, bool determined,
                          size_t kept, struct fit_parameter *out)
{
    const struct unknown *u = &p->unknowns[i];
    const struct parameter *info = p->refs[u->ref].info;
    const double s = sqrt(fmax(variance, 0.0)), slope = fit_problem_slope(p, i, x);
    const bool stated = p->n_signals == 0 && lines_stated(p->lines); /* errors of a list are not told by its few rows */
    const size_t told = p->n_signals == 0 ? kept : p->n_unknowns;
    const double dof = stated ? 1e6 : fmax((double)p->n_used - (double)told - (double)p->n_nuisance, 1.0);
    out->estimated = true;
    out->identifiable = determined;
    out->logarithmic = u->logarithmic;
    out->value = fmin(fmax(p->theta[u->ref], info->min), info->max); /* exp(ln max) may round above max */
    out->remainder = p->refs[u->ref].role == ROLE_RESIDUAL;
    out->at_bound = x[i] <= p->lower[i] + close_to_bound * fmax(1.0, fabs(x[i])) ||
                    x[i] >= p->upper[i] - close_to_bound * fmax(1.0, fabs(x[i]));
    if (!determined)
        return;
    out->sd = s * fabs(slope);
    intervals_95(out->value, u->logarithmic ? s : out->sd, u->logarithmic, dof, info->min, info->max, out->ci95);
}

/* Weights as relative changes, so that a common factor shows as equal weights: v dx → (dθ/θ), unit norm again. */
static void relative_weights(const struct fit_problem *p, const double x[], struct fit_result *out)
{
    static const double present = 1e-6; /* |θ|/scale of a parameter that has a size to be relative to */
    const size_t n = p->n_unknowns;
    for (size_t k = 0; k < out->identifiability.n_null; k++) {
        double *weight = out->identifiability.null[k].weight, square = 0.0;
        for (size_t i = 0; i < n; i++) {
            if (!p->unknowns[i].logarithmic)
                weight[i] *= extent_linear / (fabs(x[i]) > present ? x[i] : 1.0);
            square += weight[i] * weight[i];
        }
        for (size_t i = 0; i < n; i++)
            weight[i] /= sqrt(square);
    }
}

/* ---- Warnings ---- */

/* A factor of 1000 or a million, as near as a start value is known. */
static bool is_unit(double ratio)
{
    static const double start_is_known = 3.0; /* within this factor */
    const double powers = fabs(log(ratio)) / log(1e3), whole = round(powers);
    return whole > 0.0 && whole <= 2.0 && fabs(powers - whole) * log(1e3) <= log(start_is_known);
}

static void warn_about_parameter(const struct fit_problem *p, const struct model *model, size_t i,
                                 struct fit_result *out)
{
    const struct unknown *u = &p->unknowns[i];
    const struct parameter_ref *ref = &p->refs[u->ref];
    const struct fit_parameter *f = &out->parameters[u->ref];
    if (f->at_bound)
        warn(out, "%s ended at a bound of its range (%.6g %s): widen min or max if the physics allows it", f->label,
             f->value, f->unit);
    const bool gain = ref->role == ROLE_KS || ref->role == ROLE_KB || ref->role == ROLE_INPUT_GAIN ||
                      ref->role == ROLE_OUTPUT_GAIN,
               beam = ref->role == ROLE_EI || ref->role == ROLE_RHO;
    const double limit = gain ? suspicious_gain : suspicious_beam, ratio = fabs(f->value / f->start);
    if ((gain || beam) && f->start != 0.0 && (ratio > limit || ratio < 1.0 / limit))
        warn(out, "%s is %.3g times its start value: %s", f->label, ratio,
             is_unit(ratio) ? "is a column of the record in mV, mm or kN, or the model in N·mm² or g/m?"
                            : "is that value right, and every channel calibrated?");
    if (ref->role != ROLE_EFFECT || !f->identifiable)
        return;
    const struct beam_parameter_info *info = &model->effects[ref->owner].effect->parameters[ref->slot];
    const bool amplitude = info->neutral == 0.0 && !(info->flags & (BEAM_PARAMETER_INNER | BEAM_PARAMETER_PER_RECORD));
    if (amplitude && fabs(f->value) < 2.0 * f->sd)
        warn(out, "%s is not significant: %.3g ± %.3g %s; the records do not ask for this effect", f->label, f->value,
             f->sd, f->unit);
}

/* Said before all else: what was believed and what the records say exclude each other. */
static void warn_about_priors(const struct fit_problem *p, const double x[], struct fit_result *out)
{
    static const double contradicts = 4.0; /* standard deviations of the prior */
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct unknown *u = &p->unknowns[i];
        const double away = u->prior > 0.0 ? fabs(x[i] - u->prior_x) / u->prior : 0.0;
        if (away > contradicts)
            warn(out,
                 "%s = %.4g %s lies %.0f standard deviations of its prior from what the model file says: a wrong unit "
                 "or sign "
                 "of a column, or another beam?",
                 p->refs[u->ref].label, p->theta[u->ref], p->refs[u->ref].info->unit, away);
    }
}

/* Said first of all: no parameter can change a prediction of silence. False when all records are such. */
static bool warn_about_inputs(const struct fit_problem *p, struct fit_result *out)
{
    size_t driven = 0;
    for (size_t r = 0; r < p->n_records; r++)
        if (p->drives[r].driven)
            driven++;
        else
            warn(out,
                 "%s: every input is zero throughout, so the model predicts silence: is it the right column, or a free "
                 "decay (beamfit import --free-decay)?",
                 p->names[r]);
    return driven > 0;
}

/* Where the search went under a prediction of silence tells nothing. */
static void take_starts(struct fit_result *out)
{
    for (size_t i = 0; i < out->n_parameters; i++) {
        out->parameters[i].value = out->parameters[i].start;
        out->parameters[i].at_bound = false;
    }
}

static void warn_about_levels(const struct fit_problem *p, struct fit_result *out)
{
    for (size_t r = 0; r < p->n_records; r++)
        if (p->drives[r].level && p->drives[r].n_inputs > 1)
            warn(out, "%s: one unknown level was applied to all %zu inputs of the record", p->names[r],
                 p->drives[r].n_inputs);
}

static void warn_about_horizons(const struct fit_problem *p, struct fit_result *out)
{
    for (size_t r = 0; r < p->n_records; r++)
        if (isfinite(p->horizon_s[r]))
            warn(out,
                 "%s: from %.4g s after its first row on the motion cannot be predicted (half the time step gives "
                 "another "
                 "one): those rows are left out",
                 p->names[r], p->horizon_s[r]);
}

static void warn_about_search(struct fit_result *out)
{
    if (out->interrupted)
        warn(out, "interrupted: these are the best values so far, not an optimum");
    else if (!out->converged)
        warn(out,
             "the search did not end at an optimum (%.2g standard errors away): standard errors and intervals are not "
             "reliable; try --start search, better start values, or fewer free parameters",
             out->distance);
    if (out->noise_ratio > 1.1 + out->noise_doubt)
        warn(out,
             "the residual is %.3g times the noise: the model lacks something; the intervals hold for this model only",
             out->noise_ratio);
}

static void fill_records(const struct fit_problem *p, struct fit_result *out)
{
    out->n_records = p->n_records;
    out->names = bf_alloc(p->n_records, sizeof *out->names);
    out->level = bf_alloc(p->n_records, sizeof *out->level);
    for (size_t r = 0; r < p->n_records; r++) {
        out->names[r] = bf_strdup(p->names[r]);
        out->level[r] = p->levels[r];
    }
}

/* From the search's unknowns to ln θ and θ, in place. */
static void scale_covariance(const struct fit_problem *p, const double x[], double cov[])
{
    const size_t n = p->n_unknowns;
    for (size_t i = 0; i < n; i++) {
        const double scale = p->unknowns[i].logarithmic ? 1.0 : fit_problem_slope(p, i, x);
        for (size_t j = 0; j < n; j++) {
            cov[i + j * n] *= scale;
            cov[j + i * n] *= scale;
        }
    }
}

enum bf_status fit_statistics(struct fit_problem *p, const struct model *model, const double x[],
                              struct fit_result *out, struct bf_error *err)
{
    const size_t n = p->n_unknowns;
    double *cov = bf_alloc(n * n, sizeof *cov);
    fill_records(p, out);
    out->n_parameters = p->n_refs;
    out->parameters = bf_alloc(p->n_refs, sizeof *out->parameters);
    for (size_t r = 0; r < p->n_refs; r++)
        fill_parameter(p, r, &out->parameters[r]);
    const enum bf_status status = covariance(p, x, out, cov, err);
    out->unknown = bf_alloc(n, sizeof *out->unknown);
    for (size_t i = 0; i < n && !status; i++) {
        out->unknown[i] = p->unknowns[i].ref;
        fill_estimate(p, i, x, cov[i + i * n], out->identifiability.determined[i], out->identifiability.kept,
                      &out->parameters[p->unknowns[i].ref]);
    }
    scale_covariance(p, x, cov);
    out->covariance = cov;
    if (status)
        return status;
    relative_weights(p, x, out);
    if (!warn_about_inputs(p, out)) {
        take_starts(out);
        return BF_OK; /* the rest would follow from that */
    }
    warn_about_priors(p, x, out);
    warn_about_search(out);
    for (size_t i = 0; i < n; i++)
        warn_about_parameter(p, model, i, out);
    warn_about_levels(p, out);
    warn_about_horizons(p, out);
    return BF_OK;
}

bool fit_learned(const struct fit_result *result)
{
    const struct identifiability *id = &result->identifiability;
    size_t of_beam = 0, at_bounds = 0;
    for (size_t i = 0; i < id->n; i++) {
        const struct fit_parameter *p = &result->parameters[result->unknown[i]];
        of_beam += !p->remainder;
        at_bounds += !p->remainder && p->at_bound;
    }
    return of_beam == 0 ||
           (at_bounds < of_beam && id->singular[0] >= 1.0); /* 1: a change by 100 % is as large as the noise */
}

void fit_free(struct fit_result *result)
{
    for (size_t r = 0; r < result->n_records; r++)
        free(result->names ? result->names[r] : NULL);
    for (size_t k = 0; k < result->n_minima; k++)
        free(result->minima[k].value);
    for (size_t k = 0; k < result->n_warnings; k++)
        free(result->warnings[k]);
    identifiability_free(&result->identifiability);
    attainable_free(&result->attainable);
    free(result->parameters), free(result->names), free(result->level), free(result->channels), free(result->unknown),
        free(result->covariance);
    free(result->minima), free(result->warnings);
    *result = (struct fit_result){0};
}
