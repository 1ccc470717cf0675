/* SPDX-License-Identifier: GPL-3.0-or-later */
/* evidence.h — private to noise/: what its files share of evidence. */
#ifndef BEAMFIT_EVIDENCE_PRIVATE_H
#define BEAMFIT_EVIDENCE_PRIVATE_H

#include "noise.h"

/* From a residual that is believed to be noise: Burg, order by BIC. r = 0: sigma 0, nothing is divided out. */
void whitener_from_residual(const double *r, size_t n, struct whitener *out);

/* P(2ΔlogL ≥ x) when nothing is there: χ²_g, or with a one-sided parameter ½ χ²_{g−1} + ½ χ²_g (Self & Liang 1987). */
double likelihood_ratio_tail(double x, size_t added, size_t one_sided);

#endif
