/* SPDX-License-Identifier: GPL-3.0-or-later */
/* line_peaks.h — peaks of a spectrum without phase; private to estimate/. */
#ifndef BEAMFIT_LINE_PEAKS_H
#define BEAMFIT_LINE_PEAKS_H

#include "record/record.h"

/* Of the first response of a RECORD_MAGNITUDES: a RECORD_FREQUENCIES, n = 0 where nothing stands out. Free with record_free(). O(lines²) at worst. */
void line_peaks(const struct record *record, struct record *out);

#endif
