/* SPDX-License-Identifier: GPL-3.0-or-later */
/* population.h — pieces of fleet_population_find(). Private to fleet/. */
#ifndef BEAMFIT_FLEET_POPULATION_H
#define BEAMFIT_FLEET_POPULATION_H

#include "fleet.h"

/* Fills mixed and outliers of *out from its estimates; use[n]: those that do not stand out. Errors as fleet_mixed_fit(). */
enum bf_status population_outliers(struct fleet_population *out, bool use[], struct bf_error *err);

/* y = a + slope (t − middle) over n ≥ 3 units with errors sd and a scatter of their own, estimated; p_value for this one line. */
void population_line(size_t n, const double t[], const double y[], const double sd[], struct fleet_drift *out);

/* Verdicts and effects into *out. BF_BAD_FILE. */
enum bf_status population_verdicts(struct fleet_results *results, struct fleet_population *out, struct bf_error *err);

#endif
