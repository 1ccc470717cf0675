/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predict_geometry.h — what predict_geometry.c and predict_patch.c share; for nobody else. */
#ifndef BEAMFIT_PREDICT_GEOMETRY_H
#define BEAMFIT_PREDICT_GEOMETRY_H

#include "predict_work.h"

static inline bool not_zero(double x)
{
    return x < 0.0 || x > 0.0;
}

/* Zero for an effect without geometry. */
enum bf_status read_geometry(const struct predictor *p, size_t record, size_t e, const double theta[],
                             struct beam_geometry *out, struct bf_error *err);
/* g of the model's inputs and outputs in the current space. */
void place_inputs(struct predictor *p);

/* predict_patch.c: only where an effect shifts the patch. */
enum bf_status patch_rebase(struct predictor *p, struct bf_error *err);
void patch_free(struct geometry *geometry);
/* Model, space and functionals at the run's shift; with derivatives where the run wants them. */
enum bf_status patch_evaluate(const struct run *run, struct bf_error *err);

#endif
