/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linear_modes.h — a model, and the modes of records that are far from it: its own frequencies are 9.8, 61, 172 Hz and more. */
#ifndef TESTS_LINEAR_MODES_H
#define TESTS_LINEAR_MODES_H

#include <string.h>
#include "model/model.h"

enum { N = 4096, MODES = 3 };
static const double dt = 1.0 / 512.0, noise_share = 0.004;
static const double mode_Hz[MODES] = {7.1, 48.0, 139.0}, damping[MODES] = {0.004, 0.003, 0.005};

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.78}\n"
                                 "  rho_beam_kgpm: {value: 0.1}\n"
                                 "  cDI_beam_sNm2: {value: 1e-5}\n"
                                 "  gamma_sNpm2: {value: 0.01}\n"
                                 "inputs: {drive_N: {kind: point_force, at_m: 0.1}}\n"
                                 "outputs:\n"
                                 "  tip_m: {kind: displacement, at_m: 0.4}\n"
                                 "  middle_m: {kind: displacement, at_m: 0.2}\n"
                                 "effects: []\n";

static struct model read_model(void)
{
    struct model model;
    struct bf_error err;
    if (model_read_text("test.yaml", model_text, sizeof model_text - 1, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

#endif
