/* SPDX-License-Identifier: GPL-3.0-or-later */
/* line_statistics.h — how far rows that are no samples scatter; private to estimate/. */
#ifndef BEAMFIT_LINE_STATISTICS_H
#define BEAMFIT_LINE_STATISTICS_H

#include "fit_problem.h"
#include "intervals.h"

/*
 * Residual and Jacobian of the last evaluation. channels, known: [groups of p->lines]; nothing without lines. known false: nobody stated the standard errors,
 * and too few rows are left to tell them. O(rows · unknowns²).
 */
enum bf_status lines_noise(const struct fit_problem *p, struct interval_channel channels[], bool known[],
                           struct bf_error *err);

#endif
