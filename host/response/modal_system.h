/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * modal_system.h — all that the stepping of nonlinear forces knows of the rest: the linear system in modes, one record's
 * inputs on their way to the coordinates of the laws, and the way of forces at the coordinates to the record's outputs.
 *
 * Made by predict_law.c, which owns nothing of it but the lists; read by law_*.c. [m] is a spectrum on the grid.
 */
#ifndef BEAMFIT_MODAL_SYSTEM_H
#define BEAMFIT_MODAL_SYSTEM_H

#include "clamp_motion.h"
#include "functional.h"
#include "response.h"
#include "kernel.h"

/* Which derivatives are wanted. */
struct modal_parameter {
    bool wanted;
    bool structural; /* wanted, and the poles or some functional change with it */
    bool of_input;   /* wanted, and an input or the clamp changes with it */
};

/* A transfer function and its derivatives, from an input to a coordinate or from a force at one to an output. */
struct modal_path {
    double complex *H;   /* [m] */
    double complex **dH; /* [n_parameters] of [m]; NULL where the structure does not depend on the parameter */
};

/* A parameter changes a spectrum: of an input, or of the chain behind an output. */
struct modal_change {
    size_t parameter;
    double scale;            /* of the chain; 1 for an input */
    const double complex *d; /* [m] */
};

/* u = gain · U. */
struct modal_input {
    const double complex *U; /* [m] what reaches the beam */
    double gain;
    size_t gain_parameter;          /* SIZE_MAX: none */
    const struct modal_path *paths; /* [n_coordinates] */
    size_t n_changes;               /* of U */
    const struct modal_change *changes;
};

/* y = chain of −Σ H f: y += gain · filter · that, in the time domain. */
struct modal_output {
    double gain;
    const double complex *filter;   /* [m] of the channel, without the recorder's */
    const struct modal_path *paths; /* [n_coordinates] */
    size_t n_changes;               /* of gain · filter, by the parameters of the chain; each scale · d */
    struct modal_change *changes;
    double *y;        /* [grid->n] what is added to */
    double *jacobian; /* the same rows of the first parameter's column; the next one's begin n_rows later */
    double *states;   /* likewise of the first unknown of the initial state */
};

/*
 * A mode whose state at the record's beginning is an unknown a: every coordinate moves by 2 Re(a b α e^(pt)) besides what the
 * inputs do. Two real unknowns, the parts of a.
 */
struct modal_state {
    size_t pole;
    double complex amplitude;  /* a */
    double complex to_beam;    /* b, with the mode's sign */
    double complex *d_to_beam; /* [n_parameters]; NULL: b is constant */
};

struct modal_system {
    const struct system *system; /* poles and their derivatives */
    size_t n_coordinates;
    const struct functional *coordinates; /* of all laws */
    size_t n_parameters;
    const struct modal_parameter *parameters; /* [n_parameters]; NULL: no derivatives are wanted */
    const struct response_grid *grid;
    const double complex *recorder; /* [m] the recorder's filter; NULL: not stated */
    const struct clamp *clamp;      /* NULL: it is at rest */
    bool free_state;                /* the beam moved before the record began */
    double t0_s;                    /* of the first row, since the record's first sample */
    size_t n_states;
    const struct modal_state *states;
    size_t n_inputs;
    const struct modal_input *inputs;
    size_t n_outputs;
    const struct modal_output *outputs;
    size_t n_rows;
};

static inline double *modal_column(const struct modal_system *s, const struct modal_output *output, size_t parameter)
{
    return output->jacobian + parameter * s->n_rows;
}

#endif
