/* SPDX-License-Identifier: GPL-3.0-or-later */
/* curves.h — what the page's curves are made of. Private to show/; curves_json() of show.h has the whole. */
#ifndef BEAMFIT_CURVES_H
#define BEAMFIT_CURVES_H

#include "curve_grid.h"
#include "show.h"

/*
 * One channel over frequency, as each of n predictions has it (NULL: that model has no such channel). Where one input moves the beam, all is divided by
 * the input's spectrum ("response"), and lines that the input does not have are left out; else it is amplitudes ("spectrum").
 */
struct json *curves_over_frequency(const struct comparison *all, const struct comparison_channel *channel,
                                   const struct comparison_channel *const predictions[], size_t n, size_t most_points);

#endif
