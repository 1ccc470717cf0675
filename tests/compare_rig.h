/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_rig.h — a hammer record of the paper's beam with known noise, and its comparison. Include after cmocka.h. */
#ifndef COMPARE_RIG_H
#define COMPARE_RIG_H

#include "compare/compare.h"
#include "signals.h"
#include "test_files.h"

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam:\n"
                                 "  length_m: 0.4573\n"
                                 "  patch_m: [0.02535, 0.08905]\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.491}\n"
                                 "  EI_patch_Nm2: {value: 0.793}\n"
                                 "  rho_beam_kgpm: {value: 0.093}\n"
                                 "  rho_patch_kgpm: {value: 0.433}\n"
                                 "  cDI_beam_sNm2: {value: 0.649e-5}\n"
                                 "  cDI_patch_sNm2: {value: 1.255e-5}\n"
                                 "  gamma_sNpm2: {value: 0.013}\n"
                                 "  Ks_V: {value: 40}\n"
                                 "inputs:\n"
                                 "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
                                 "outputs:\n"
                                 "  piezo_V: {kind: patch_strain}\n"
                                 "  tip_mps: {kind: velocity, at_m: 0.44}\n"
                                 "effects: []\n";

enum { N = 2048 };
static const double dt = 1.0 / 512.0;

static inline struct model read_model(void)
{
    struct model model;
    struct bf_error err;
    if (model_read_text("test.yaml", model_text, sizeof model_text - 1, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

/* A hammer hit and the answer of both outputs, both outputs arbitrary so far. */
static inline struct record hit_record(const char *path)
{
    static double u[N], noise[N];
    struct record record = {.path = strdup(path), .n = N, .dt_s = dt};
    uint64_t seed = signal_seed(1);
    for (size_t i = 0; i < N; i++) {
        u[i] = i >= 40 && i < 44 ? 10.0 : 0.0;
        noise[i] = signal_normal(&seed);
    }
    record_add_column(&record, "hammer_N", u);
    record_add_column(&record, "piezo_V", noise);
    record_add_column(&record, "tip_mps", noise);
    return record;
}

static inline struct comparison run(const struct model *model, const struct record *records, size_t n, size_t held_out)
{
    const struct predict_options options = {0};
    struct comparison all;
    struct bf_error err;
    if (compare_run(model, records, n, held_out, &options, &all, &err) != BF_OK)
        fail_msg("%s", err.text);
    return all;
}

static inline double *column(const struct record *record, const char *name)
{
    return (double *)record_column(record, name);
}

/* Overwrites the outputs with what the model predicts, and noise of this relative size. */
static inline void make_truth(const struct model *model, struct record *record, double noise, unsigned number)
{
    uint64_t seed = signal_seed(number);
    struct comparison all = run(model, record, 1, 0);
    for (size_t c = 0; c < all.n_channels; c++) {
        double *z = column(record, all.channels[c].name);
        const double size = noise * signal_rms(all.channels[c].predicted, N);
        for (size_t i = 0; i < N; i++)
            z[i] = all.channels[c].predicted[i] + size * signal_normal(&seed);
    }
    compare_free(&all);
}

static inline const struct comparison_channel *channel(const struct comparison *all, size_t record, const char *name)
{
    for (size_t i = 0; i < all->n_channels; i++)
        if (all->channels[i].record == record && strcmp(all->channels[i].name, name) == 0)
            return &all->channels[i];
    fail_msg("no channel %s", name);
    return NULL;
}

#endif
