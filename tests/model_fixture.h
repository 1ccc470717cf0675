/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_fixture.h — the seed paper's beam as a model in memory, with effects given as YAML list items. */
#ifndef MODEL_FIXTURE_H
#define MODEL_FIXTURE_H

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "model/model.h"

static inline void fixture_model(struct model *out, const char *effects)
{
    struct bf_error err;
    char path[] = "/tmp/beamfit-fixture-XXXXXX";
    int fd = mkstemp(path);
    FILE *f = fdopen(fd, "w");
    assert_non_null(f);
    fprintf(f,
            "format: beamfit-model/1\n"
            "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
            "parameters:\n"
            "  EI_beam_Nm2: {value: 0.491}\n"
            "  EI_patch_Nm2: {value: 0.793}\n"
            "  rho_beam_kgpm: {value: 0.093}\n"
            "  rho_patch_kgpm: {value: 0.433}\n"
            "  cDI_beam_sNm2: {value: 0.649e-5}\n"
            "  cDI_patch_sNm2: {value: 1.255e-5}\n"
            "  gamma_sNpm2: {value: 0.013}\n"
            "  Ks_V: {value: 40}\n"
            "  KB_NmpV: {value: 0.0175}\n"
            "inputs:\n"
            "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
            "  drive_V: {kind: patch_moment}\n"
            "outputs:\n"
            "  piezo_V: {kind: patch_strain}\n"
            "  accel_mps2: {kind: acceleration, at_m: 0.0214}\n"
            "  tip_mps: {kind: velocity, at_m: 0.44}\n"
            "effects:%s\n%s",
            effects[0] ? "" : " []", effects);
    fclose(f);
    enum bf_status status = model_read(path, out, &err);
    unlink(path);
    if (status != BF_OK)
        fail_msg("fixture: %s", err.text);
}

#endif
