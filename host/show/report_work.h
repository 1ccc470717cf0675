/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_work.h — the page's parts, one file each, and what they share. For report*.c only. */
#ifndef BEAMFIT_REPORT_WORK_H
#define BEAMFIT_REPORT_WORK_H

#include "html.h"
#include "show.h"

struct page {
    FILE *out;
    const struct report *report;
    const struct report_pictures *pictures;
    size_t n_figures; /* so far */
};

/* "V" of "piezo_V"; "" when the name has no known unit. */
void report_unit(const char *name, char unit[24]);
/*
 * Format and factor of a quantity with that unit, for a person: 1.74e-5 V is "%.3g µV" and 1e6. Units that take no prefix
 * keep theirs.
 */
double report_prefix(double x, const char *unit, char format[40]);
/* What a record that is not held out is called: "fitted" when the model's file says so of all of them, else "compared". */
const char *report_group(const struct report *report);
/* The record among those of the model's fit, by its bytes; NULL: not among them, or there was no fit. */
const struct fit_record *report_fit_record(const struct report *report, size_t record);

/* Some channel has more than its noise left. */
bool report_leaves_more(const struct report *report);
/* Two cells: an error in per cent and times the noise; NAN: a dash. */
void report_error_cells(FILE *out, double nrmse, double noise_ratio);
/* Text in which `this` is a command. */
void page_text(struct page *page, const char *text);
/* <h2>; <p class=note>text</p>. */
void page_heading(struct page *page, const char *heading);
void page_note(struct page *page, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A figure of a file in the pictures' directory, numbered; the caption is also what stands for the picture. */
enum bf_status page_figure(struct page *page, const char *file, const char *caption, struct bf_error *err);

/* The parts, in their order. */
void report_beam(struct page *page);       /* geometry, channels, sketch */
void report_sketch(struct page *page);     /* the figure of the beam, drawn in the page itself */
void report_parameters(struct page *page); /* parameters, effects */
void report_modes(struct page *page);
void report_records(struct page *page);
void report_errors(struct page *page);
enum bf_status report_figures(struct page *page, struct bf_error *err);
enum bf_status report_chain(struct page *page, struct bf_error *err);

#endif
