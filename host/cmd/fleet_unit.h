/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fleet_unit.h — one unit of a fleet: the stages of `fit` and `diagnose`, and what is kept of them. */
#ifndef BEAMFIT_FLEET_UNIT_H
#define BEAMFIT_FLEET_UNIT_H

#include "estimate/estimate.h"
#include "fleet/fleet.h"

struct fleet_settings {
    bool diagnose;
    struct fit_options fit;
};

/* What of the settings changes a result, in words that stand in RESULTS: "diagnose; start near". */
enum { FLEET_SETTINGS = 160 };
void fleet_settings_text(const struct fleet_settings *settings, char text[FLEET_SETTINGS]);

/*
 * The unit fitted (and diagnosed) into rows; identity: SHA-256 of its inputs' contents, the settings and the program's version, said through `report`
 * before the work. When it is the job's, nothing is done and no rows are said. A unit that fails is rows with status "failed" and the reason.
 */
void fleet_unit_work(const struct fleet_unit *unit, const struct fleet_settings *settings, const struct fleet_job *job,
                     struct fleet_report *report);

#endif
