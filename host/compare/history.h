/* SPDX-License-Identifier: GPL-3.0-or-later */
/* history.h — private to compare/: what its files share of history. */
#ifndef BEAMFIT_HISTORY_PRIVATE_H
#define BEAMFIT_HISTORY_PRIVATE_H

#include "compare.h"

enum { HISTORY_NONE = -1 };

#endif
