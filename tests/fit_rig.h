/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_rig.h — a small beam, recordings of it made by the model itself plus noise, and a fit. Include after cmocka.h. */
#ifndef BEAMFIT_FIT_RIG_H
#define BEAMFIT_FIT_RIG_H

#include <math.h>
#include "maths/maths.h"
#include "estimate/estimate.h"
#include "test_files.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

enum { SAMPLES = 1000, RATE_HZ = 1000, PARAMETERS_TEXT = 1024 };

static const char beam_text[] = "format: beamfit-model/1\n"
                                "beam: {length_m: 0.4, patch_m: [0.02, 0.08]}\n"
                                "parameters:\n"
                                "  EI_beam_Nm2: {value: %g%s}\n"
                                "  EI_patch_Nm2: {value: %g}\n"
                                "  rho_beam_kgpm: {value: %g%s}\n"
                                "  rho_patch_kgpm: {value: %g}\n"
                                "  cDI_beam_sNm2: {value: %g}\n"
                                "  cDI_patch_sNm2: {value: 1e-5, fixed: true}\n"
                                "  gamma_sNpm2: {value: 0.02, fixed: true}\n"
                                "  Ks_V: {value: %g%s}\n"
                                "inputs: {hammer_N: {kind: point_force, at_m: 0.05}}\n"
                                "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.39}}\n"
                                "effects:%s\n";

struct beam {
    double EI, EI_patch, rho, rho_patch, cDI, Ks;
    const char *of_EI, *of_rho, *of_Ks; /* ", fixed: true", ", max: 0.4" … */
};
static const struct beam truth = {0.5, 0.8, 0.1, 0.4, 2e-5, 40.0, "", "", ""};
static const struct beam handbook = {0.53, 1.0, 0.1, 0.3, 1e-5, 60.0, "", ", fixed: true", ""};

/* effects: " []", or lines that begin with "\n  - ". */
static inline void make_model_with(const struct beam *beam, const char *effects, struct model *out)
{
    struct bf_error err;
    char text[PARAMETERS_TEXT];
    const int n = snprintf(text, sizeof text, beam_text, beam->EI, beam->of_EI, beam->EI_patch, beam->rho, beam->of_rho,
                           beam->rho_patch, beam->cDI, beam->Ks, beam->of_Ks, effects);
    char *path = temporary_file("model.yaml", text, (size_t)n);
    assert_int_equal(model_read(path, out, &err), BF_OK);
    unlink(path);
    free(path);
}

static inline void make_model(const struct beam *beam, struct model *out)
{
    make_model_with(beam, " []", out);
}

static uint64_t seed; /* of the noise; each test sets its own */

static inline double gauss(void)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        uint64_t z = (seed += 0x9E3779B97F4A7C15u);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        sum += (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }
    return sum;
}

/* A hammer pulse of 12 ms at start_s and what the true beam answers, with 0.5 % noise (sigma[2] says how much). */
static inline void make_record(const char *name, double start_s, double level, struct record *out, double sigma[2])
{
    static double force[SAMPLES], zero[SAMPLES], z[SAMPLES];
    struct bf_error err;
    struct model model;
    struct predictor *predictor;
    struct parameter_ref *refs;
    struct prediction y;
    *out = (struct record){.n = SAMPLES, .dt_s = 1.0 / RATE_HZ, .path = strdup(name)};
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / RATE_HZ - start_s, width = 0.012;
        force[k] = t > 0.0 && t < width ? level * 0.5 * (1.0 - cos(2.0 * M_PI * t / width)) : 0.0;
    }
    record_add_column(out, "hammer_N", force);
    record_add_column(out, "piezo_V", zero);
    record_add_column(out, "tip_mps", zero);
    make_model(&truth, &model);
    assert_int_equal(predictor_new(&model, out, 1, NULL, &predictor, &err), BF_OK);
    const char *names[1] = {name};
    const size_t n = model_parameters(&model, names, 1, &refs);
    double *theta = calloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
    for (size_t c = 0; c < 2; c++) {
        const double *clean = y.y + c * SAMPLES;
        sigma[c] = 0.005 * dense_norm(SAMPLES, clean) / sqrt((double)SAMPLES);
        for (size_t k = 0; k < SAMPLES; k++)
            z[k] = clean[k] + sigma[c] * gauss();
        memcpy(out->columns[1 + c].x, z, sizeof z);
    }
    free(theta), free(refs);
    predictor_free(predictor);
    model_free(&model);
}

/* Drop a column of a record. */
static inline void drop_column(struct record *record, const char *name)
{
    for (size_t i = 0; i < record->n_columns; i++)
        if (strcmp(record->columns[i].name, name) == 0)
            record->columns[i].name[0] = '-';
}

static inline const struct fit_parameter *find(const struct fit_result *result, const char *label)
{
    for (size_t i = 0; i < result->n_parameters; i++)
        if (strcmp(result->parameters[i].label, label) == 0)
            return &result->parameters[i];
    fail_msg("no parameter %s", label);
    return NULL;
}

#endif
