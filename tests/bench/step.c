/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * step N [EFFECT...] — N steps of the paper's beam (hammer in, patch voltage out, 1024 Hz) with effects at their start
 * values. Nothing is timed here: run.sh counts instructions of two runs that differ in N only. Built twice, as double
 * and with -DBEAM_FLOAT.
 */
#include <stdio.h>
#include <stdlib.h>
#include "beam.h"

static const struct beam_description paper = {.basis = BEAM_BASIS_PATCH,
                                              .parameters = {.EI_beam_Nm2 = BEAM_K(0.491),
                                                             .EI_patch_Nm2 = BEAM_K(0.793),
                                                             .rho_beam_kgpm = BEAM_K(0.093),
                                                             .rho_patch_kgpm = BEAM_K(0.433),
                                                             .cDI_beam_sNm2 = BEAM_K(0.649e-5),
                                                             .cDI_patch_sNm2 = BEAM_K(1.255e-5),
                                                             .gamma_sNpm2 = BEAM_K(0.013),
                                                             .Ks_V = BEAM_K(4682.342)},
                                              .n_inputs = 1,
                                              .n_outputs = 1,
                                              .input = {{BEAM_INPUT_POINT_FORCE, BEAM_K(0.0254)}},
                                              .output = {{.kind = BEAM_OUTPUT_PATCH_STRAIN}}};

static void must(enum beam_status status, const char *what)
{
    if (status == BEAM_OK)
        return;
    fprintf(stderr, "step: %s: %s\n", what, beam_status_text(status));
    exit(1);
}

int main(int argc, char **argv)
{
    static struct beam_description description;
    static struct beam_model model;
    static struct beam_work work;
    static struct beam_plan plan;
    static struct beam_state state;
    long steps = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
    description = paper;
    for (int i = 2; i < argc && description.n_uses < BEAM_USES; i++) {
        struct beam_use *use = &description.use[description.n_uses++];
        use->effect = beam_effect_find(argv[i]);
        for (int j = 0; use->effect != NULL && j < use->effect->n_parameters; j++) {
            const struct beam_parameter_info *info = &use->effect->parameters[j];
            use->p[j] = (beam_real)info->start * (info->role == BEAM_ROLE_PLACE ? beam_length() : BEAM_K(1.0));
        }
    }
    must(beam_assemble(&description, &model), "assemble");
    must(beam_factor(&model, &(struct beam_options){.dt_s = BEAM_K(1.0) / BEAM_K(1024.0)}, &work, &plan), "factor");
    beam_reset(&plan, &state);
    beam_real u[BEAM_INPUTS] = {0}, y[BEAM_OUTPUTS] = {0};
    for (long k = 0; k < steps; k++) {
        u[0] = k % 256 < 4 ? BEAM_K(5.0) : BEAM_K(0.0);
        must(beam_step(&plan, &state, u, y), "step");
    }
    printf("%.9g\n", (double)y[0]);
    return 0;
}
