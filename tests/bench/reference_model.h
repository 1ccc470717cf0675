/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * reference_model.h — the plain way to predict a measured beam, to measure beamfit's speed against.
 *
 * Hermite cubic finite elements with nodes on the patch edges, the lowest modes of those (damping not diagonal), a dense
 * state space stepped by its matrix exponential with a first-order hold of the band-limited, oversampled input; the
 * substeps of one sample are multiplied out, so that a sample costs one dense product. It is written to be fair: BLAS
 * does the products. It shares no code with lib/ or host/.
 */
#ifndef REFERENCE_MODEL_H
#define REFERENCE_MODEL_H

#include <stddef.h>

enum { P_EI_BEAM, P_EI_PATCH, P_RHO_BEAM, P_RHO_PATCH, P_CDI_BEAM, P_CDI_PATCH, P_GAMMA, P_KS, P_KB, PARAMETERS };
#ifndef REFERENCE_MODES
#define REFERENCE_MODES 60
#endif
#ifndef REFERENCE_OVERSAMPLE
#define REFERENCE_OVERSAMPLE 128 /* a power of two */
#endif
enum {
    MODES = REFERENCE_MODES,
    OVERSAMPLE = REFERENCE_OVERSAMPLE,
    STATES = 2 * MODES,
    INPUTS = OVERSAMPLE + 1,
    WIDTH = STATES + INPUTS,
    CHANNELS = 2,
    FILES = 4
};
#define SAMPLE_S (1.0 / 1024.0)

extern const char *const reference_names[PARAMETERS]; /* as in a model file */

enum channel_kind { CHANNEL_NONE, CHANNEL_PIEZO, CHANNEL_ACCELERATION, CHANNEL_VELOCITY };

/* One record: hammer_N or drive_V in, piezo_V or accel_mps2 and tip_mps out. */
struct reference_record {
    size_t n;
    int hammer; /* the input is the hammer, not the patch voltage */
    double *u;  /* [n * OVERSAMPLE + 1], band-limited between samples */
    enum channel_kind kind[CHANNELS];
    double *z[CHANNELS]; /* [n], measured */
    double rms[CHANNELS];
};

/* Ends the program with a message when the file is not as expected. */
void reference_read(const char *path, struct reference_record *out);
/* One sample as a matrix: x⁺ = S [x; inputs of the substeps], y = R x + d u. */
struct reference_system {
    double S[STATES * WIDTH], R[CHANNELS][STATES], d[CHANNELS];
};

/* system[0] for drive records, system[1] for hammer records. Cost: one eigenproblem and two exponentials. */
void reference_prepare(const double p[PARAMETERS], struct reference_system system[2]);
/* y[c][k] for the first n samples of the record, which must be of this system's kind. Cost: n dense products. */
void reference_simulate(const struct reference_system *system, const struct reference_record *record, size_t n,
                        double *const y[CHANNELS]);

#endif
