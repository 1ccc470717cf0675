/* SPDX-License-Identifier: GPL-3.0-or-later */
/* monitor_view.h — a stream shown: a panel that is redrawn, lines, pictures. */
#ifndef BEAMFIT_MONITOR_VIEW_H
#define BEAMFIT_MONITOR_VIEW_H

#include "capture.h"
#include "monitor_tracking.h"
#include "show/show.h"

extern const struct answer_field monitor_fields[]; /* of a line */

struct monitor_view {
    bool panel;
    double every_s, window_s;
    /* the view's own */
    uint32_t first; /* sequence of time 0 */
    size_t seen;    /* samples of the recording that are counted */
    uint64_t samples, lost;
    bool alarm, drawn, asked;
    struct monitor_tracking tracking;
};

/* After the first sample has come. */
void monitor_begin(struct monitor_view *view, const struct capture *capture);
void monitor_end(struct monitor_view *view);
/* What the board knows of the modes that it follows, if any: at most once in every_s. */
enum bf_status monitor_track(struct monitor_view *view, struct capture *capture, struct bf_error *err);
/* What has come since the last call, and the rms values over every_s. */
void monitor_show(struct monitor_view *view, const struct capture *capture);
/* Drops what is older than `window` samples of the board. */
void monitor_forget(struct monitor_view *view, struct capture *capture, uint32_t window);
/* Pictures of the longest stretch that is still there. */
enum bf_status monitor_plot(const struct monitor_view *view, const struct capture *capture, const char *directory,
                            struct bf_error *err);

#endif
