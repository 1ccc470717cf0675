/* SPDX-License-Identifier: GPL-3.0-or-later */
/* findings.h — the parts of record_findings_find(). Private to record/. */
#ifndef BEAMFIT_FINDINGS_H
#define BEAMFIT_FINDINGS_H

#include "hits.h"
#include "record.h"

/* Mains and harmonics in the first `quiet` samples of a column; false: none that matter. */
bool findings_hum(const struct record *record, size_t column, size_t quiet, struct record_finding *out);

#endif
