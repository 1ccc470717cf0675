/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fleet_report.h — `beamfit fleet report RESULTS`. */
#ifndef BEAMFIT_FLEET_REPORT_H
#define BEAMFIT_FLEET_REPORT_H

#include "ground/ground.h"

/* argv[0] is "report". */
enum bf_status fleet_report(int argc, char **argv, struct bf_error *err);

#endif
