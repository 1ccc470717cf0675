/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fleet_boards.h — `beamfit fleet export RESULTS -o DIR` and `beamfit fleet download RESULTS PORTS`. */
#ifndef BEAMFIT_FLEET_BOARDS_H
#define BEAMFIT_FLEET_BOARDS_H

#include "ground/ground.h"

/* argv[0] is "export", "download". */
enum bf_status fleet_export(int argc, char **argv, struct bf_error *err);
enum bf_status fleet_download(int argc, char **argv, struct bf_error *err);

#endif
