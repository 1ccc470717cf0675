/* SPDX-License-Identifier: GPL-3.0-or-later */
/* lines.h — private to ground/: what its files share of lines. */
#ifndef BEAMFIT_LINES_PRIVATE_H
#define BEAMFIT_LINES_PRIVATE_H

#include "ground.h"

enum { LINES_LONGEST = 1 << 20 }; /* bytes in a line */

#endif
