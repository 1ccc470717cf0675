/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_verdict.h — what the model leaves of the records, and which of them it was fitted to. Private to show/. */
#ifndef BEAMFIT_REPORT_VERDICT_H
#define BEAMFIT_REPORT_VERDICT_H

#include "show.h"

/* What a record that is not held out is called: "fitted" when the model's file says so of all of them, else "compared". */
const char *report_group(const struct report *report);
/* The record among those of the model's fit, by its bytes; NULL: not among them, or there was no fit. */
const struct fit_record *report_fit_record(const struct report *report, size_t record);

#endif
