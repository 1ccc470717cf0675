/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_plot.h — the pictures of one channel of a comparison. Private to show/. */
#ifndef BEAMFIT_COMPARE_PLOT_H
#define BEAMFIT_COMPARE_PLOT_H

#include "compare/compare.h"
#include "show.h"

enum { COMPARE_PLOT = 16 }; /* samples that a picture needs */

/* "train1-piezo_V": the r-th record's name without directory and ".csv", and what is drawn of it. */
void compare_name_picture(const struct record records[], size_t r, const char *what, char stem[PLOT_STEM]);

/* A frequency response with one input, whole. */
bool compare_is_response(const struct comparison *all, const struct comparison_channel *c);
/* Its picture: coherence, magnitude and phase over frequency. */
enum bf_status compare_plot_bode(const struct comparison *all, const struct comparison_channel *c,
                                 const char *directory, const char *stem, const char *title, struct bf_error *err);

/* Four panels, or a frequency response's three, and the residual: DIR/STEM.png and DIR/STEM-residual.png (and PDF). BF_NUMERIC with fewer than COMPARE_PLOT samples. */
enum bf_status compare_plot_channel(const struct comparison *comparison, size_t channel, const char *directory,
                                    const char *stem, struct bf_error *err);

/* "train1-piezo_V-amplitude", and the one diagram of all records. */
void compare_amplitude_stem(const struct record records[], size_t r, const char *channel, char stem[PLOT_STEM + 16]);
#define COMPARE_STABILISATION "stabilisation"

/* Up to where its spectrum is worth showing: twice the frequency below which all but 0.01 % of its power is; 0 when that is everything. */
double compare_worth_showing_Hz(const struct comparison_channel *channel);

#endif
