/* SPDX-License-Identifier: GPL-3.0-or-later */
/* channel_factors_rig.h — a steel cantilever of the truth simulator whose model has handbook values, and what is said of its channels. */
#ifndef BEAMFIT_CHANNEL_FACTORS_RIG_H
#define BEAMFIT_CHANNEL_FACTORS_RIG_H

#include "compare/compare.h"
#include "compare/factor_pair.h"
#include "truth_hit.h"

#include <stdio.h>

/* EI 8 % and ρ 3 % off, damping a guess. */
static const char model_format[] =
    "format: beamfit-model/1\n"
    "beam: {length_m: 0.35}\n"
    "parameters:\n"
    "  EI_beam_Nm2: {value: 92.25, prior: 0.1}\n"
    "  rho_beam_kgpm: {value: 1.177, prior: 0.05}\n"
    "  cDI_beam_sNm2: 0.0016\n"
    "  gamma_sNpm2: 0.002\n"
    "inputs: {hammer_N: {kind: point_force, at_m: 0.30}, shaker_N: {kind: point_force, at_m: 0.1}}\n"
    "outputs:\n"
    "  accel_mps2: {kind: acceleration, at_m: %s}\n"
    "  laser_mps: {kind: velocity, at_m: 0.2}\n";

static inline struct model model_at(const char *place)
{
    char text[1024];
    struct model model;
    struct bf_error err;
    const int n = snprintf(text, sizeof text, model_format, place);
    if (model_read_text("test.yaml", text, (size_t)n, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

/* One hit or one chirp; signal and effect are lines of a spec, effect may be NULL. */
static inline struct record make(const char *input, const char *signal, const char *effect)
{
    struct truth_spec spec;
    truth_spec_default(&spec);
    spec.length_m = 0.35;
    spec.n_regions = 1;
    spec.region[0] = (struct truth_region){0, 0.35, 100.0, 1.21, 6e-4, 3e-6};
    spec.gamma_sNpm2 = 0.05;
    spec.sample_rate_Hz = 2048;
    spec.duration_s = 1;
    spec.modes = 20;
    say(&spec, input);
    say(&spec, "output accel_mps2 acceleration at_m=0.28");
    say(&spec, "output laser_mps velocity at_m=0.2");
    say(&spec, signal);
    if (effect != NULL)
        say(&spec, effect);
    return hit_of(&spec);
}

static inline struct record copy_of(const struct record *from)
{
    struct record record = {.path = strdup(from->path), .n = from->n, .dt_s = from->dt_s};
    for (size_t c = 0; c < from->n_columns; c++)
        record_add_column(&record, from->columns[c].name, from->columns[c].x);
    return record;
}

static struct record plain_hit; /* simulated once */

static inline struct record hit(const char *effect)
{
    if (effect == NULL && plain_hit.n > 0)
        return copy_of(&plain_hit);
    return make("input hammer_N point_force at_m=0.30",
                "signal hammer_N raised_cosine start_s=0.05 width_s=0.002 level=40", effect);
}

static inline struct record chirp(void)
{
    return make("input shaker_N point_force at_m=0.1",
                "signal shaker_N chirp start_s=0 width_s=0.9 from_Hz=10 to_Hz=700 level=5 taper_s=0.1", NULL);
}

static inline void scale(struct record *record, const char *name, double factor)
{
    double *x = (double *)record_column(record, name);
    for (size_t i = 0; x != NULL && i < record->n; i++)
        x[i] *= factor;
}

static inline bool fits_half(const struct fit_result *fitted)
{
    for (size_t c = 0; c < fitted->n_channels; c++)
        if (!(fitted->channels[c].nrmse < 0.5))
            return false;
    return true;
}

/* A fit that is known beforehand spares work. Where it misses half of a channel it changes no word, else nothing is asked. */
static inline void same_after_a_fit(const struct model *model, const struct record records[], size_t n,
                                    const struct channel_factors *found)
{
    const struct fit_options options = {.never_search = true, .quiet = true};
    struct channel_factors out;
    struct fit_result fitted;
    struct bf_error err;
    if (fit_run(model, records, n, &options, &fitted, &err) != BF_OK)
        return;
    if (channel_factors_find(model, records, n, NULL, &fitted, true, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    for (size_t i = 0; i < out.n && i < found->n; i++)
        assert_string_equal(out.all[i].line, found->all[i].line);
    assert_int_equal(out.n, fits_half(&fitted) ? 0 : found->n);
    channel_factors_free(&out);
    fit_free(&fitted);
}

static inline struct channel_factors found(const struct model *model, const struct record records[], size_t n)
{
    struct channel_factors out;
    struct bf_error err;
    if (channel_factors_find(model, records, n, NULL, NULL, true, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    same_after_a_fit(model, records, n, &out);
    return out;
}

static inline void nothing(const struct model *model, const struct record records[], size_t n)
{
    struct channel_factors out = found(model, records, n);
    if (out.n != 0)
        fail_msg("said without a reason: %s", out.all[0].text);
    channel_factors_free(&out);
}

#endif
