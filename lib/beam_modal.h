/* SPDX-License-Identifier: MIT */
/* beam_modal.h — stages between a model and its poles. Private to lib/. */
#ifndef BEAM_MODAL_H
#define BEAM_MODAL_H

#include "beam_dense.h"

#define beam_modal_form BEAM_NAME(modal_form)
#define beam_real_poles BEAM_NAME(real_poles)

/* out = Ψᵀ X Ψ; the two must not overlap */
void beam_modal_form(const struct beam_modes *modes, const beam_real x[BEAM_N][BEAM_N], beam_real out[BEAM_N][BEAM_N]);

/*
 * Poles on the real axis whose form φᵀQ'φ is positive: `wanted` of them, appended to work->poles (modal shapes).
 * They may coincide (a memory proportional to the stiffness), so they are found together: the form is definite on
 * their common subspace, where the symmetric eigenproblem is solved by Jacobi. DEFECTIVE.
 */
enum beam_status beam_real_poles(struct beam_work *work, int wanted);

#endif
