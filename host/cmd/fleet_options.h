/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fleet_options.h — options and answers of `beamfit fleet`, of all that it does, and of `beamfit-fleet`. */
#ifndef BEAMFIT_FLEET_OPTIONS_H
#define BEAMFIT_FLEET_OPTIONS_H

#include "ground/ground.h"
#include "show/show.h"

extern const struct option_row fleet_options[];
extern const struct answer_field fleet_fields[];

#endif
