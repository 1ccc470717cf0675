/* SPDX-License-Identifier: GPL-3.0-or-later */
/* findings_of.h — what is wrong with the records of a command before its model is asked. */
#ifndef BEAMFIT_FINDINGS_OF_H
#define BEAMFIT_FINDINGS_OF_H

#include "model/model.h"
#include "record/record.h"

/* One for each record; the model's point forces and outputs are looked at. free with findings_free(). */
struct record_findings *findings_of(const struct model *model, const struct record records[], size_t n_records);
void findings_free(struct record_findings *findings, size_t n_records);

#endif
