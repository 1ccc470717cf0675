/* SPDX-License-Identifier: GPL-3.0-or-later */
/* starting_model.h — a commented model file from a ruler and a handbook. */
#ifndef BEAMFIT_STARTING_MODEL_H
#define BEAMFIT_STARTING_MODEL_H

#include <stdbool.h>
#include "model.h"

/* Handbook values. */
struct handbook_material {
    const char *name;
    double E_Pa, density_kgpm3;
};
extern const struct handbook_material handbook_materials[];
extern const size_t handbook_materials_count;

/* One layer of a rectangular cross-section. */
struct layer {
    double E_Pa, density_kgpm3, width_m, thickness_m;
};

/* What a person knows before measuring. */
struct starting_beam {
    double length_m;
    enum model_support support;
    struct layer beam, patch;
    const char *beam_material, *patch_material; /* names for the comments */
    bool has_patch;
    double patch_from_m, patch_to_m;
    int patch_sides; /* 1: on one face, 2: on both */
    double mass_kg;  /* of the bare beam, weighed; 0: not weighed */
    size_t n_inputs, n_outputs;
    const struct model_input *inputs;
    const struct model_output *outputs;
};

/*
 * EI (N·m²) and mass per length (kg/m) of a beam with layers bonded on `sides` faces (0, 1, 2) of it. Two sides: eqs. 30,
 * 31 of the seed paper. One side: the same laminate theory about its own neutral axis.
 */
double laminate_EI(const struct layer *beam, const struct layer *patch, int sides);
double laminate_rho(const struct layer *beam, const struct layer *patch, int sides);

/* The text of the model file; caller frees. It reads back as a model without faults when the beam has none. */
char *starting_model_text(const struct starting_beam *beam);

#endif
