/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predict_geometry.h — what predict_geometry.c and predict_patch.c share; for nobody else. */
#ifndef BEAMFIT_PREDICT_GEOMETRY_H
#define BEAMFIT_PREDICT_GEOMETRY_H

#include "predict_work.h"

static inline bool not_zero(double x)
{
    return x < 0.0 || x > 0.0;
}

/* out[n] += scale · x. */
static inline void add_scaled(size_t n, double scale, const double x[], double out[])
{
    for (size_t i = 0; i < n; i++)
        out[i] += scale * x[i];
}

/* Zero for an effect without geometry. */
enum bf_status read_geometry(const struct predictor *p, size_t record, size_t e, const double theta[],
                             struct beam_geometry *out, struct bf_error *err);
/* Term t of effect e at theta; false: there is none, or it does not act at a point. */
bool point_mass(const struct predictor *p, size_t e, int t, const double theta[], struct beam_term *out);
/* g of the model's inputs and outputs in the current space. */
void place_inputs(struct predictor *p);

/* predict_patch.c: only where an effect shifts the patch. */
enum bf_status patch_rebase(struct predictor *p, struct bf_error *err);
void patch_free(struct geometry *geometry);
/* Model, space and functionals at the run's shift; with derivatives where the run wants them. */
enum bf_status patch_evaluate(const struct run *run, struct bf_error *err);

#endif
