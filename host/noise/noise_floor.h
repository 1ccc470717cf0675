/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * noise_floor.h — the stationary background under a residual that also holds distortion, harmonics, impacts and lines.
 *
 * The time–frequency plane is cut into tiles. Stationary noise has the same power at all times and a spectrum without
 * detail; distortion comes and goes. A tile counts as background when its neighbours are quiet, not when it is quiet
 * itself, so that choosing does not bias the estimate; what bias the overlap leaves is measured on simulated noise that is
 * processed in the same way, and divided out. The spectrum through the chosen tiles is a smooth curve (Whittle likelihood,
 * squared differences of its logarithm penalised, the penalty by the Bayesian criterion; "white" is one candidate).
 */
#ifndef BEAMFIT_NOISE_FLOOR_H
#define BEAMFIT_NOISE_FLOOR_H

#include <stdbool.h>
#include "maths/maths.h"

enum { FLOOR_ROWS_MAX = 64 };

struct noise_floor {
    size_t n_rows;                   /* bands of equal width from 0 to the Nyquist frequency */
    double variance[FLOOR_ROWS_MAX]; /* of white noise with the density of this band; the noise's is their mean */
    double relative_sd;              /* of the noise's rms */
    size_t n_cells;                  /* independent cells that carry it */
    double used_share;               /* of the tiles */
    bool white;
};

/* fit: of the record z; z: [n]. About 5 ms for 4096 samples. */
enum bf_status noise_floor_estimate(const struct local_rational *fit, const double *z, size_t n,
                                    struct noise_floor *out, struct bf_error *err);

#endif
