/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_page.h — pieces that every part of the page is written with: headings, notes, cells. Private to show/. */
#ifndef BEAMFIT_REPORT_PAGE_H
#define BEAMFIT_REPORT_PAGE_H

#include "html.h"
#include "show.h"

struct page {
    FILE *out;
    const struct report *report;
};

/* Text in which `this` is a command. */
void page_text(struct page *page, const char *text);
/* <h2>; <p class=note>text</p>. */
void page_heading(struct page *page, const char *heading);
void page_note(struct page *page, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Two cells: an error in per cent and times the noise; NAN: a dash. */
void report_error_cells(FILE *out, double nrmse, double noise_ratio);
/* "V" of "piezo_V"; "" when the name has no known unit. */
void report_unit(const char *name, char unit[24]);
/*
 * Format and factor of a quantity with that unit, for a person: 1.74e-5 V is "%.3g µV" and 1e6. Units that take no prefix
 * keep theirs.
 */
double report_prefix(double x, const char *unit, char format[40]);

#endif
