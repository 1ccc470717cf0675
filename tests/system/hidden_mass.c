/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stddef.h>
#include <stdio.h>
#include "hidden_mass.h"
#include "rig.h"

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.5, prior: 0.1}\n"
                                 "  EI_patch_Nm2: {value: 0.8}\n"
                                 "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                                 "  rho_patch_kgpm: {value: 0.433, fixed: true}\n"
                                 "  cDI_beam_sNm2: {value: 2e-5}\n"
                                 "  cDI_patch_sNm2: {value: 2e-5}\n"
                                 "  gamma_sNpm2: {value: 0.05}\n"
                                 "  Ks_V: {value: 40}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
                                 "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.44}}\n"
                                 "effects: []\n";

/* Hits of different strength and length on a beam with 0.6 g at its tip. */
static const char spec_text[] =
    "length_m 0.4573\npatch_m 0.02535 0.08905\nEI_beam_Nm2 0.491\nEI_patch_Nm2 0.793\n"
    "rho_beam_kgpm 0.093\nrho_patch_kgpm 0.433\ncDI_beam_sNm2 2e-5\ncDI_patch_sNm2 2e-5\n"
    "gamma_sNpm2 0.05\nKs_V 40\neffect tip_mass mass_kg=0.0006\n"
    "input hammer_N point_force at_m=0.0254\noutput piezo_V patch_strain\n"
    "output tip_mps velocity at_m=0.44\nsample_rate_Hz 512\nduration_s 3\nnoise 0.004\nmodes 16\ntolerance 3e-7\n"
    "signal hammer_N raised_cosine start_s=0.15 width_s=%g level=%g\nseed %d\n";

int hidden_mass_setup(void **state)
{
    static const char *const names[] = {"soft.txt", "hard.txt", "check.txt"};
    static const double widths_s[] = {0.008, 0.008, 0.012}, levels_N[] = {2.0, 20.0, 8.0};
    char text[1200];
    if (rig_setup(state) != 0)
        return -1;
    struct rig *rig = *state;
    write_text(rig->dir, "model.yaml", model_text);
    for (int r = 0; r < 3; r++) {
        (void)snprintf(text, sizeof text, spec_text, widths_s[r], levels_N[r], 70 + r);
        write_text(rig->dir, names[r], text);
    }
    run_program(rig->dir,
                (const char *[]){"sh", "-c",
                                 "set -e\n\"$(dirname \"$BEAMFIT\")/beam_truth\" soft.txt hard.txt check.txt\n"
                                 "\"$BEAMFIT\" fit model.yaml soft.csv hard.csv --check check.csv -o fitted.yaml",
                                 NULL},
                &rig->outcome);
    return rig->outcome.status;
}
