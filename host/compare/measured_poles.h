/* SPDX-License-Identifier: GPL-3.0-or-later */
/* measured_poles.h — poles of the records with standard errors, and the residues of each channel. Private to compare/. */
#ifndef BEAMFIT_MEASURED_POLES_H
#define BEAMFIT_MEASURED_POLES_H

#include "compare.h"

/* How a channel of a record takes part in each pole under one of its inputs, or, where nothing drives the record, by how it moved at its beginning. */
struct residue {
    size_t record, output, input; /* of the model; input SIZE_MAX: nothing drives */
    double _Complex *of_pole;     /* [n_poles] units of the channel, over those of the input and s² */
};

struct measured_poles {
    size_t n;
    double _Complex *pole;             /* [n] 1/s, ascending in frequency */
    struct measured_frequency *values; /* [n] */
    size_t n_residues;
    struct residue *residues;
};

/*
 * From the stable poles of a stabilisation, in steps of Gauss and Newton over all lines of all fitted channels, everything but the poles eliminated in each: residues, the free
 * motion from before the record and out of it, and what lies above the band. n 0: no stable poles, or none that stays one. Free with measured_poles_free(), also after a failure.
 * Cost: some 20 ms a channel of 4096 samples.
 */
enum bf_status measured_poles_find(const struct comparison *all, const struct stabilisation *start,
                                   struct measured_poles *out, struct bf_error *err);
void measured_poles_free(struct measured_poles *poles);

/* Deflection of mode k, from 0, at a place, between the points of its shape (pole_table.c). */
double pole_table_shape_at(const struct modes *modes, size_t k, double x_m);

#endif
