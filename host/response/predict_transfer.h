/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * predict_transfer.h — transfer functions of a predictor's linear model on the Laplace line of a record, for stages that
 * look behind the outputs: what a functional of the deflection did, what a force at a functional does to a channel.
 *
 * Everything holds at the parameters of the last predictor_run(), which must have succeeded; theta is that vector.
 * A functional is g[dimension]: w = gᵀx in the reduced space, and a force at it is g f.
 */
#ifndef BEAMFIT_PREDICT_TRANSFER_H
#define BEAMFIT_PREDICT_TRANSFER_H

#include <complex.h>
#include "predict.h"
#include "beam/reduced.h"
#include "response.h"
#include "beam/system.h"

/* One record on its Laplace line. Pointers are the predictor's. */
struct transfer_record {
    const struct response_grid *grid;
    size_t grid_index;                /* records with equal numbers share a grid */
    bool free_decay;                  /* its motion is not predicted from inputs */
    size_t first_channel, n_channels; /* in the order of predictor_channels() */
    const struct record *record;
};

/* Lowest undamped modes at the parameters of the run, M-orthonormal. */
struct transfer_modes {
    size_t n;                /* modes */
    size_t dimension;        /* of the reduced space */
    const double *omega_rad; /* [n] */
    const double *shape;     /* [n][dimension]: mode k is shape + k·dimension */
    double *damping;         /* [n] diagonal of the modal damping matrix, 1/s; free with free() */
};

const struct model *transfer_model(const struct predictor *predictor);
const struct reduced *transfer_reduced(const struct predictor *predictor);
const struct parameter_map *transfer_map(const struct predictor *predictor);
bool transfer_nonlinear(const struct predictor *predictor); /* some effect of the model has a law */
size_t transfer_parameters(const struct predictor *predictor, const struct parameter_ref **refs);
size_t transfer_records(const struct predictor *predictor);
struct transfer_record transfer_record(const struct predictor *predictor, size_t record);
/* The functional of an output, [dimension], and its order of time derivative; borrowed. */
const double *transfer_output_functional(const struct predictor *predictor, size_t output, int *order);

/* Modes below highest_rad, at least one, at most `most`. */
struct transfer_modes transfer_modes(const struct predictor *predictor, double highest_rad, size_t most);

/* W[m] of w = gᵀx under the recorded inputs; zero for a free decay. */
void transfer_motion(const struct predictor *predictor, const double theta[], size_t record, const double g[],
                     double complex W[]);
/* gain · F of a channel (Ks, the sensor's filters, the recorder's where it is stated), [m]. */
enum bf_status transfer_chain(const struct predictor *predictor, const double theta[], size_t channel,
                              double complex F[], struct bf_error *err);
/* H[m]: output before gain and filters over a force at g, with the output's time derivatives. */
void transfer_force(const struct predictor *predictor, size_t grid_index, size_t output, const double g[],
                    double complex H[]);
/*
 * The change of the dynamic stiffness by parameter i in the modes of transfer_modes(): dA = s² D[0] + s D[1] + D[2],
 * each [n × n]; false when the parameter does not act there, or acts through a memory term or a moving place.
 */
bool transfer_stiffness_change(const struct predictor *predictor, const struct transfer_modes *modes, size_t i,
                               double *D[3]);
/* Gain parameter of a channel's output (Ks) in theta, or SIZE_MAX. */
size_t transfer_gain_parameter(const struct predictor *predictor, size_t channel);

#endif
