/* SPDX-License-Identifier: GPL-3.0-or-later */
/* evidence.h — the distribution behind the p-values of evidence_compare(). Private to noise/. */
#ifndef BEAMFIT_EVIDENCE_H
#define BEAMFIT_EVIDENCE_H

#include <stddef.h>

/* P(2ΔlogL ≥ x) when nothing is there: χ²_g, or with a one-sided parameter ½ χ²_{g−1} + ½ χ²_g (Self & Liang 1987). */
double likelihood_ratio_tail(double x, size_t added, size_t one_sided);

#endif
