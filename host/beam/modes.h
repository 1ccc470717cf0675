/* SPDX-License-Identifier: GPL-3.0-or-later */
/* modes.h — private to beam/: what its files share of modes. */
#ifndef BEAMFIT_MODES_PRIVATE_H
#define BEAMFIT_MODES_PRIVATE_H

#include "beam.h"

enum { DEPLOYED_DIMENSION = 10 };

#endif
