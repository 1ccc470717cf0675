/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * noise_tiles.h — a record's residual on the time–frequency plane, cut into tiles, beside simulated white noise that was
 * processed in the same way. Working data of noise_floor.c; private to noise/.
 */
#ifndef BEAMFIT_NOISE_TILES_H
#define BEAMFIT_NOISE_TILES_H

#include <stdbool.h>
#include "maths/maths.h"

enum { NOISE_DRAWS = 24 };

/* Tile (t, row) stands at [t · n_rows + row]; rows are equal bands from 0 to the Nyquist frequency. */
struct noise_tiles {
    size_t segment; /* samples of one transform */
    size_t n_times, n_rows, n_tiles;
    double cells_per_tile; /* independent spectral cells */
    double *power; /* [n_tiles] of the residual; 1 for white noise of variance 1 that the local fit leaves whole */
    double *gain;  /* [n_tiles] what the local fit leaves of white noise of variance 1 */
    bool *usable;  /* [n_tiles] gain is not small */
    double *draw[NOISE_DRAWS]; /* [n_tiles] each, powers of simulated noise of variance 1 */
    double *periodogram;       /* [n_bins] of the whole residual */
    size_t n_bins;
    double threshold; /* a tile is background when its neighbours' mean power is below this times the floor */
    double bias;      /* of choosing so: mean of chosen tiles of simulated noise over their gains */
    double *quiet;    /* [n_tiles] neighbours' mean power over the floor */
    bool *chosen;     /* [n_tiles] */
};

/* z: [n] the record that `fit` was made from. Free with noise_tiles_free(), also after a failure. */
enum bf_status noise_tiles_fill(const struct local_rational *fit, const double *z, size_t n, struct noise_tiles *out,
                                struct bf_error *err);
void noise_tiles_free(struct noise_tiles *tiles);
/* Fills quiet from the eight neighbours of each tile. floor: [n_rows] variance. */
void noise_tiles_neighbours(struct noise_tiles *tiles, const double *floor);
/* Sets the threshold and measures its bias. */
void noise_tiles_threshold(struct noise_tiles *tiles, double threshold);

#endif
