/* SPDX-License-Identifier: GPL-3.0-or-later */
/* truth_beam.h — the beam of the fixture in the independent simulator, its outputs as a record, and how far a prediction is from them. */
#ifndef BEAMFIT_TEST_TRUTH_BEAM_H
#define BEAMFIT_TEST_TRUTH_BEAM_H

#include "truth_rig.h"

#include "predict_case.h"

static const char *const outputs[] = {"piezo_V", "accel_mps2", "tip_mps", "tip_m"};

static inline void beam_of_fixture(struct truth_spec *spec)
{
    static const char *const lines[] = {
        "length_m = 0.4573",
        "patch_m = 0.02535 0.08905",
        "EI_beam_Nm2 = 0.491",
        "EI_patch_Nm2 = 0.793",
        "rho_beam_kgpm = 0.093",
        "rho_patch_kgpm = 0.433",
        "cDI_beam_sNm2 = 0.649e-5",
        "cDI_patch_sNm2 = 1.255e-5",
        "gamma_sNpm2 = 0.013",
        "Ks_V = 40",
        "KB_NmpV = 0.0175",
        "sample_rate_Hz = 1024",
        "filter_order = 8",
        "filter_ratio = 0.4",
        "duration_s = 1",
        "noise = 0",
        "adc_bits = 0",
        "input hammer_N point_force at_m=0.0254",
        "input drive_V patch_moment",
        "output piezo_V patch_strain",
        "output accel_mps2 acceleration at_m=0.0214",
        "output tip_mps velocity at_m=0.44",
        "output tip_m displacement at_m=0.44",
        "signal hammer_N raised_cosine start_s=0.15 width_s=0.008 level=2",
        "signal drive_V chirp start_s=0 width_s=0.9 from_Hz=5 to_Hz=160 level=30 taper_s=0.1"};
    truth_spec_default(spec);
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        say(spec, lines[i]);
}

static inline struct record measured(const struct truth_record *truth)
{
    struct record r = {.path = strdup("case.csv"), .n = truth->n, .dt_s = 1.0 / truth->rate_Hz};
    for (size_t c = 0; c < truth->n_channels; c++)
        record_add_column(&r, truth->channel[c].name, truth->channel[c].x);
    record_add_meta(&r, RECORD_FILTER,
                    "Butterworth order 8 at 409.6 Hz, forward and backward (zero phase), every channel");
    return r;
}

static inline double deviation_from(size_t first, const struct predict_case *c, const struct truth_record *truth,
                                    size_t output)
{
    const double *x = truth_record_channel(truth, outputs[output]), *y = c->out.y + output * truth->n;
    double difference = 0.0, size = 0.0;
    for (size_t k = first; k < truth->n; k++) {
        difference += (x[k] - y[k]) * (x[k] - y[k]);
        size += x[k] * x[k];
    }
    return sqrt(difference / size);
}

#endif
