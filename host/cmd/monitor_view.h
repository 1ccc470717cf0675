/* SPDX-License-Identifier: GPL-3.0-or-later */
/* monitor_view.h — a stream shown: a panel that is redrawn, plain lines, JSON lines, pictures. */
#ifndef BEAMFIT_MONITOR_VIEW_H
#define BEAMFIT_MONITOR_VIEW_H

#include "capture.h"

struct monitor_view {
    bool json, panel;
    double every_s, window_s;
    /* the view's own */
    uint32_t first; /* sequence of time 0 */
    size_t seen;    /* samples of the recording that are counted */
    uint64_t samples, lost;
    bool alarm, drawn;
};

/* After the first sample has come. */
void monitor_begin(struct monitor_view *view, const struct capture *capture);
/* What has come since the last call, and the rms values over every_s. */
void monitor_show(struct monitor_view *view, const struct capture *capture);
/* Drops what is older than `window` samples of the board. */
void monitor_forget(struct monitor_view *view, struct capture *capture, uint32_t window);
/* Pictures of the longest stretch that is still there. */
enum bf_status monitor_plot(const struct capture *capture, const char *directory, struct bf_error *err);

#endif
