/* SPDX-License-Identifier: GPL-3.0-or-later */
/* law.h — private to response/: what its files share of law. */
#ifndef BEAMFIT_LAW_PRIVATE_H
#define BEAMFIT_LAW_PRIVATE_H

#include "response.h"

/* Where the value of a weight stands in the parameter vector; SIZE_MAX: it is 1. */
size_t law_weight_parameter(const struct parameter_map *map, enum beam_weight weight, size_t material);

#endif
