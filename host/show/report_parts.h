/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_parts.h — the parts of the page, in their order; each is in the file that is named. Private to show/. */
#ifndef BEAMFIT_REPORT_PARTS_H
#define BEAMFIT_REPORT_PARTS_H

#include "report_page.h"

/* report_beam.c */
void report_beam(struct page *page);       /* geometry, channels, sketch */
void report_parameters(struct page *page); /* parameters, effects */
/* report_sketch.c: the figure of the beam, drawn in the page itself; called by report_beam() */
void report_sketch(struct page *page);
/* report_tables.c */
void report_modes(struct page *page);
void report_records(struct page *page);
void report_errors(struct page *page);
/* report_explore.c */
extern const char *const report_scripts[]; /* those of the page, NULL at the end */
void report_explore(struct page *page);
void report_chain(struct page *page);

#endif
