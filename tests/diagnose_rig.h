/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_rig.h — small beams to diagnose: recordings by the model itself plus noise, few effects looked at. */
#ifndef BEAMFIT_DIAGNOSE_RIG_H
#define BEAMFIT_DIAGNOSE_RIG_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "beam_effect.h"
#include "maths/maths.h"
#include "explain/diagnose_state.h"

enum { LONG = 800, SHORT = 160, MOST_RECORDS = 8, MOST_EFFECTS = 64 };
static const double dt_s = 1e-3;

static const char beam_text[] = "format: beamfit-model/1\n"
                                "beam: {length_m: 0.4, patch_m: [0.02, 0.08]}\n"
                                "parameters:\n"
                                "  EI_beam_Nm2: {value: 0.5}\n"
                                "  EI_patch_Nm2: {value: 0.8}\n"
                                "  rho_beam_kgpm: {value: 0.1, fixed: true}\n"
                                "  rho_patch_kgpm: {value: 0.4, fixed: true}\n"
                                "  cDI_beam_sNm2: {value: 2e-5}\n"
                                "  cDI_patch_sNm2: {value: 1e-5, fixed: true}\n"
                                "  gamma_sNpm2: {value: 0.02, fixed: true}\n"
                                "  Ks_V: {value: 40}\n"
                                "inputs: {hammer_N: {kind: point_force, at_m: 0.05}}\n"
                                "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.39}}\n"
                                "effects: [%s]\n";

static inline struct model make(const char *effects)
{
    char text[2048];
    struct bf_error err;
    struct model model;
    const int n = snprintf(text, sizeof text, beam_text, effects);
    if (model_read_text("beam.yaml", text, (size_t)n, &model, &err))
        fail_msg("%s", err.text);
    return model;
}

static inline double gauss(uint64_t *seed)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        uint64_t z = (*seed += 0x9E3779B97F4A7C15u);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        sum += (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }
    return sum;
}

static inline void predict(const struct model *model, const struct record *record, double noise, uint64_t seed)
{
    struct bf_error err;
    struct predictor *predictor;
    struct parameter_ref *refs;
    struct prediction y;
    const char *name = record_base_name(record);
    if (predictor_new(model, record, 1, NULL, &predictor, &err))
        fail_msg("%s", err.text);
    const size_t n = model_parameters(model, &name, 1, &refs);
    double *theta = calloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
    for (size_t c = 0; c < 2; c++) {
        const double sigma = noise * dense_norm(record->n, y.y + c * record->n) / sqrt((double)record->n);
        for (size_t k = 0; k < record->n; k++)
            record->columns[1 + c].x[k] = y.y[c * record->n + k] + sigma * gauss(&seed);
    }
    free(theta), free(refs);
    predictor_free(predictor);
}

/* A blow of this width and level, from rest, and what the model answers with noise (a share of each channel's rms). */
static inline struct record blow(const struct model *model, const char *name, size_t n, double width_s, double level,
                                 double noise)
{
    double *force = calloc(n, sizeof *force), *nothing = calloc(n, sizeof *nothing);
    struct record record = {.n = n, .dt_s = dt_s, .path = strdup(name)};
    for (size_t k = 0; k < n; k++) {
        const double t = (double)k * dt_s - 0.01;
        force[k] = t > 0.0 && t < width_s ? level * 0.5 * (1.0 - cos(2.0 * M_PI * t / width_s)) : 0.0;
    }
    record_add_column(&record, "hammer_N", force);
    record_add_column(&record, "piezo_V", nothing);
    record_add_column(&record, "tip_mps", nothing);
    free(force), free(nothing);
    predict(model, &record, noise, (uint64_t)strlen(name) * 77u + (uint64_t)name[1]);
    return record;
}

/* Records of one beam: blows r0, r1 … of different width and level. */
struct bench {
    struct model truth, given;
    struct record records[MOST_RECORDS];
    size_t n;
    const char *without[MOST_EFFECTS];
    struct diagnose_options options;
    struct diagnosis d;
};

static inline bool listed(const char *id, const char *const ids[])
{
    for (size_t i = 0; ids[i] != NULL; i++)
        if (strcmp(ids[i], id) == 0)
            return true;
    return false;
}

/* Only the effects of `ids` are looked at. */
static inline struct bench *bench_new(const char *truth, size_t n, size_t rows, double noise, const char *const ids[])
{
    struct bench *b = calloc(1, sizeof *b);
    b->truth = make(truth), b->given = make("");
    b->n = n;
    for (size_t r = 0; r < n; r++) {
        const char name[] = {'r', (char)('0' + r), '.', 'c', 's', 'v', '\0'};
        b->records[r] = blow(&b->truth, name, rows, 0.004 + 0.004 * (double)r, r % 2 == 0 ? 1.0 : 10.0, noise);
    }
    for (int i = 0; i < beam_effects_count; i++)
        if (!listed(beam_effects[i]->id, ids))
            b->without[b->options.n_without++] = beam_effects[i]->id;
    b->options.without = b->without;
    b->options.quiet = true;
    b->options.threads = 2;
    b->options.predict.quiet = true;
    return b;
}

static inline void bench_free(struct bench *b)
{
    diagnose_free(&b->d);
    for (size_t r = 0; r < b->n; r++)
        record_free(&b->records[r]);
    model_free(&b->truth), model_free(&b->given);
    free(b);
}

/* The explanation by this effect alone; NULL: there is none. */
static inline const struct hypothesis *single(const struct diagnosis *d, const char *id)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == 1 && strcmp(d->hypotheses[i].effects[0]->id, id) == 0)
            return &d->hypotheses[i];
    return NULL;
}

static inline void diagnose(struct bench *b, size_t n_records, size_t n_checks)
{
    struct bf_error err;
    if (diagnose_run(&b->given, b->records, n_records, b->records + n_records, n_checks, &b->options, &b->d, &err))
        fail_msg("%s", err.text);
}

/* The diagnosis of all records before any effect is refitted: noise and baseline. Free with state_free() before bench_free(). */
static inline struct diagnose_state begun(struct bench *b)
{
    struct bf_error err;
    b->d = (struct diagnosis){.model = &b->given, .records = b->records, .n_records = b->n};
    struct diagnose_state w = {.d = &b->d, .options = &b->options, .predict = &b->options.predict, .threads = 2};
    assert_int_equal(diagnose_noise(&w, &err), BF_OK);
    assert_int_equal(diagnose_baseline(&w, &err), BF_OK);
    return w;
}

static inline void state_free(struct diagnose_state *w)
{
    for (size_t c = 0; c < w->n_check_channels; c++)
        noise_free(&w->check_noise[c]);
    free(w->sigma), free(w->check_sigma), free(w->whiteners), free(w->check_noise);
    diagnose_modes_free(w);
}

#endif
