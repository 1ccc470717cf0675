/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * motion_rig.h — recordings of the truth simulator with one effect, a linear model of the same beam that is somewhat
 * wrong, and the measured motion. Include after cmocka.h.
 */
#ifndef MOTION_RIG_H
#define MOTION_RIG_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "estimate/estimate.h"
#include "truth/truth.h"

enum { RIG_RECORDS = 3, RIG_CHANNELS = 5 };

static const double rig_noise = 0.004; /* rms over rms of every channel */
static const char *rig_support = "clamped-free";

static const char rig_beam[] = "format: beamfit-model/1\n"
                               "beam: {length_m: 0.4573, support: %s, patch_m: [0.02535, 0.08905]}\n"
                               "parameters:\n"
                               "  EI_beam_Nm2: {value: %.9g, prior: 0.03}\n"
                               "  EI_patch_Nm2: {value: %.9g}\n"
                               "  rho_beam_kgpm: {value: 0.0923, prior: 0.01}\n"
                               "  rho_patch_kgpm: {value: 0.441}\n"
                               "  cDI_beam_sNm2: {value: 0.66e-5}\n"
                               "  cDI_patch_sNm2: {value: 1.21e-5}\n"
                               "  gamma_sNpm2: {value: %.9g}\n"
                               "  Ks_V: {value: 41.0}\n"
                               "  KB_NmpV: {value: 0.0174}\n"
                               "inputs:\n"
                               "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
                               "  drive_V: {kind: patch_moment}\n"
                               "outputs:\n"
                               "  piezo_V: {kind: patch_strain}\n"
                               "  accel_mps2: {kind: acceleration, at_m: 0.0214}\n"
                               "  tip_mps: {kind: velocity, at_m: 0.44}\n"
                               "effects: []\n";
static const double rig_EI_beam = 0.4975, rig_EI_patch = 0.772, rig_gamma = 0.0127;

struct motion_rig {
    struct model model;
    struct record records[RIG_RECORDS];
    double *hidden_m[RIG_RECORDS]; /* true deflection of the free end, without noise; not in the model */
    struct predictor *predictor;
    double *theta;
    size_t n_parameters;
    const struct parameter_ref *refs;
    double sigma[RIG_CHANNELS];
    struct motion motion;
};

static inline void rig_say(struct truth_spec *spec, const char *line)
{
    char message[TRUTH_MESSAGE] = "";
    if (truth_spec_line(spec, line, message) != 0)
        fail_msg("%s: %s", line, message);
}

/* Record 0: a hammer and the patch; 1 and 2: the patch drives, weakly and ten times as strongly. */
static inline void rig_spec(struct truth_spec *spec, int record, const char *effect)
{
    static const char *const beam[] = {"length_m = 0.4573",       "patch_m = 0.02535 0.08905",
                                       "EI_beam_Nm2 = 0.4975",    "EI_patch_Nm2 = 0.772",
                                       "rho_beam_kgpm = 0.0923",  "rho_patch_kgpm = 0.441",
                                       "cDI_beam_sNm2 = 0.66e-5", "cDI_patch_sNm2 = 1.21e-5",
                                       "gamma_sNpm2 = 0.0127",    "Ks_V = 41",
                                       "KB_NmpV = 0.0174",        "noise = 0.004",
                                       "sample_rate_Hz = 1024"};
    char support[40];
    truth_spec_default(spec);
    (void)snprintf(support, sizeof support, "support = %s", rig_support);
    rig_say(spec, support);
    spec->duration_s = 1.5;
    spec->modes = 16;
    for (size_t i = 0; i < sizeof beam / sizeof *beam; i++)
        rig_say(spec, beam[i]);
    if (record == 0) {
        rig_say(spec, "input hammer_N point_force at_m=0.0254");
        rig_say(spec, "signal hammer_N raised_cosine start_s=0.05 width_s=0.005 level=20");
        rig_say(spec, "output piezo_V patch_strain");
    } else {
        rig_say(spec, "input drive_V patch_moment");
        rig_say(spec, record == 1
                          ? "signal drive_V chirp start_s=0 width_s=1.4 level=2 from_Hz=4 to_Hz=340 taper_s=0.1"
                          : "signal drive_V chirp start_s=0 width_s=1.4 level=20 from_Hz=4 to_Hz=340 taper_s=0.1");
        rig_say(spec, "output accel_mps2 acceleration at_m=0.0214");
        rig_say(spec, "output tip_mps velocity at_m=0.44");
    }
    rig_say(spec, "output end_m displacement at_m=0.4573");
    if (effect[0] != '\0' && (record > 0 || strstr(effect, "tip_mps") == NULL))
        rig_say(spec, effect);
}

static inline void rig_record(struct motion_rig *rig, int record, const char *effect)
{
    char message[TRUTH_MESSAGE] = "", name[32];
    struct truth_spec spec;
    struct truth_record clean, noisy;
    rig_spec(&spec, record, effect);
    if (truth_simulate(&spec, &clean, message) != 0)
        fail_msg("%s", message);
    truth_measure(&spec, &clean, (uint64_t)record + 1, &noisy);
    (void)snprintf(name, sizeof name, "r%d.csv", record);
    rig->records[record] = (struct record){.path = bf_strdup(name), .n = noisy.n, .dt_s = 1.0 / noisy.rate_Hz};
    for (size_t c = 0; c < noisy.n_channels; c++)
        if (strcmp(noisy.channel[c].name, "end_m") != 0)
            record_add_column(&rig->records[record], noisy.channel[c].name, noisy.channel[c].x);
    const double *end = truth_record_channel(&clean, "end_m");
    rig->hidden_m[record] = bf_alloc(noisy.n, sizeof(double));
    memcpy(rig->hidden_m[record], end, noisy.n * sizeof *end);
    truth_record_free(&clean);
    truth_record_free(&noisy);
}

static inline void rig_model(struct motion_rig *rig, double wrong)
{
    char text[2048];
    struct bf_error err;
    int n = snprintf(text, sizeof text, rig_beam, rig_support, rig_EI_beam * (1.0 - 0.1 * wrong),
                     rig_EI_patch * (1.0 + wrong), rig_gamma * (1.0 + 2.0 * wrong));
    if (model_read_text("rig", text, (size_t)n, &rig->model, &err) != BF_OK)
        fail_msg("%s", err.text);
}

/* effect: a line of a truth spec, "" for none; wrong: relative error of the patch's stiffness and more. */
static inline void rig_open(struct motion_rig *rig, const char *effect, double wrong, double floor)
{
    struct bf_error err;
    const struct predict_channel *channels;
    memset(rig, 0, sizeof *rig);
    rig_model(rig, wrong);
    for (int r = 0; r < RIG_RECORDS; r++)
        rig_record(rig, r, effect);
    if (predictor_new(&rig->model, rig->records, RIG_RECORDS, NULL, &rig->predictor, &err) != BF_OK)
        fail_msg("%s", err.text);
    size_t n = predictor_channels(rig->predictor, &channels);
    assert_int_equal(n, RIG_CHANNELS);
    for (size_t c = 0; c < n; c++)
        rig->sigma[c] = rig_noise * dense_norm(channels[c].n, channels[c].measured) / sqrt((double)channels[c].n);
    rig->n_parameters = transfer_parameters(rig->predictor, &rig->refs);
    rig->theta = bf_alloc(rig->n_parameters, sizeof(double));
    for (size_t i = 0; i < rig->n_parameters; i++)
        rig->theta[i] = rig->refs[i].value;
    if (motion_new(rig->predictor, rig->theta, rig->sigma, floor, &rig->motion, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static inline void rig_close(struct motion_rig *rig)
{
    motion_free(&rig->motion);
    predictor_free(rig->predictor);
    free(rig->theta);
    for (int r = 0; r < RIG_RECORDS; r++) {
        record_free(&rig->records[r]);
        free(rig->hidden_m[r]);
    }
    model_free(&rig->model);
}

static inline double rig_value(const struct motion_rig *rig, const double theta[], const char *label)
{
    for (size_t i = 0; i < rig->n_parameters; i++)
        if (strcmp(rig->refs[i].label, label) == 0)
            return theta[i];
    fail_msg("no parameter %s", label);
    return 0.0;
}

static inline void rig_near(double value, double wanted, double relative)
{
    if (!(fabs(value - wanted) <= relative * fabs(wanted)))
        fail_msg("%.9g is not %.9g within %g", value, wanted, relative);
}

#endif
