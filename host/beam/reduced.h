/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reduced.h — private to beam/: what its files share of reduced. */
#ifndef BEAMFIT_REDUCED_PRIVATE_H
#define BEAMFIT_REDUCED_PRIVATE_H

#include "beam.h"

/* The term `term` of effect `e` at the model's parameters. */
enum bf_status effect_terms(const struct model *model, size_t e, struct beam_term out[BEAM_EFFECT_TERMS],
                            struct bf_error *err);

#endif
