/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "monitor_tracking.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "ground/ground.h"
#include "show/show.h"

enum bf_status monitor_tracking_read(struct monitor_tracking *t, struct link *link, double time_s, bool first,
                                     struct bf_error *err)
{
    struct tracking_point point = {.time_s = time_s};
    if (!first && t->n == 0)
        return BF_OK;
    if (link_read_tracking(link, &point.at, err) != BF_OK)
        return err->status;
    if (point.at.modes == 0 || point.at.modes > BEAM_TRACKED)
        return BF_OK;
    t->points = bf_grow(t->points, t->n + 1, sizeof *t->points);
    t->points[t->n++] = point;
    return BF_OK;
}

void monitor_tracking_free(struct monitor_tracking *t)
{
    free(t->points);
    *t = (struct monitor_tracking){.n = 0};
}

size_t monitor_tracking_modes(const struct monitor_tracking *t)
{
    return t->n == 0 ? 0 : t->points[t->n - 1].at.modes;
}

void monitor_tracking_print(const struct monitor_tracking *t, const char *ending)
{
    for (size_t m = 0; m < monitor_tracking_modes(t); m++) {
        const struct beam_tracked *q = &t->points[t->n - 1].at.mode[m];
        (void)printf("            mode %zu: %.5g ± %.2g Hz, damping %.3g ± %.2g %%, gain %.3g ± %.2g%s", m + 1,
                     (double)q->frequency_Hz, (double)q->frequency_se_Hz, 100.0 * (double)q->damping,
                     100.0 * (double)q->damping_se, (double)q->gain, (double)q->gain_se, ending);
    }
}

void monitor_tracking_json(const struct monitor_tracking *t, struct json *root)
{
    struct json *modes = json_put(root, "modes", json_new_array());
    for (size_t m = 0; m < monitor_tracking_modes(t); m++) {
        const struct beam_tracked *q = &t->points[t->n - 1].at.mode[m];
        struct json *mode = json_push(modes, json_new_object());
        json_put_number(mode, "mode", (double)(m + 1));
        json_put_number(mode, "frequency_Hz", (double)q->frequency_Hz);
        json_put_number(mode, "frequency_se_Hz", (double)q->frequency_se_Hz);
        json_put_number(mode, "damping_ratio", (double)q->damping);
        json_put_number(mode, "damping_ratio_se", (double)q->damping_se);
        json_put_number(mode, "gain", (double)q->gain);
        json_put_number(mode, "gain_se", (double)q->gain_se);
    }
}

enum bf_status monitor_tracking_plot(const struct monitor_tracking *t, const char *directory, const char *title,
                                     struct bf_error *err)
{
    const size_t modes = monitor_tracking_modes(t);
    double *values = bf_alloc(t->n * PLOT_TRACKED * 6 + 1, sizeof *values),
           *time_s = bf_alloc(t->n + 1, sizeof *time_s);
    for (size_t i = 0; i < t->n; i++) {
        time_s[i] = t->points[i].time_s;
        for (size_t m = 0; m < modes; m++) {
            const struct beam_tracked *q = &t->points[i].at.mode[m];
            double *to = &values[(i * PLOT_TRACKED + m) * 6];
            to[0] = (double)q->frequency_Hz, to[1] = (double)q->frequency_se_Hz;
            to[2] = 100.0 * (double)q->damping, to[3] = 100.0 * (double)q->damping_se;
            to[4] = (double)q->gain, to[5] = (double)q->gain_se;
        }
    }
    const struct plot_tracking plot = {directory, "live-tracking", title, modes, t->n, time_s, values};
    const enum bf_status status = plot_tracking(&plot, err);
    free(values), free(time_s);
    return status;
}
