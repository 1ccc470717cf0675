/* SPDX-License-Identifier: GPL-3.0-or-later */
/* monitor_tracking.h — the modes that a board follows, as `monitor` shows them. */
#ifndef BEAMFIT_MONITOR_TRACKING_H
#define BEAMFIT_MONITOR_TRACKING_H

#include "capture.h"

struct json;

struct tracking_point {
    double time_s;
    struct beam_tracking at;
};

/* All that was read; n 0 when the board's image asks for no tracking. */
struct monitor_tracking {
    size_t n;
    struct tracking_point *points;
};

/* Reads what the board knows now. `first`: it is not known yet whether it follows any mode. */
enum bf_status monitor_tracking_read(struct monitor_tracking *t, struct link *link, double time_s, bool first,
                                     struct bf_error *err);
void monitor_tracking_free(struct monitor_tracking *t);

size_t monitor_tracking_modes(const struct monitor_tracking *t);
/* A line for each mode, `ending` at the end of each. */
void monitor_tracking_print(const struct monitor_tracking *t, const char *ending);
/* "modes", a list, into the line's object. */
void monitor_tracking_json(const struct monitor_tracking *t, struct json *root);
/* live-tracking: frequency, damping and gain over the time, with bands of two standard errors. */
enum bf_status monitor_tracking_plot(const struct monitor_tracking *t, const char *directory, const char *title,
                                     struct bf_error *err);

#endif
