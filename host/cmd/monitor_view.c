/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "monitor_view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "show/show.h"

enum { PANEL_LINES = 6, MOST_COLUMNS = 120 };

void monitor_begin(struct monitor_view *v, const struct capture *c)
{
    v->first = c->newest;
    v->seen = v->samples = v->lost = 0;
}

void monitor_end(struct monitor_view *v)
{
    monitor_tracking_free(&v->tracking);
}

enum bf_status monitor_track(struct monitor_view *v, struct capture *c, struct bf_error *err)
{
    const struct monitor_tracking *t = &v->tracking;
    const double time_s = v->asked ? (double)(c->newest - v->first) / c->recording.sample_Hz : 0.0;
    if (v->asked && (t->n == 0 || time_s - t->points[t->n - 1].time_s < 0.99 * v->every_s))
        return BF_OK;
    const bool first = !v->asked;
    v->asked = true;
    return monitor_tracking_read(&v->tracking, &c->link, time_s, first, err);
}

/* ---- What is shown ---- */

struct now {
    double time_s, measured_rms, predicted_rms, residual_rms, ratio, innovation_ratio;
    uint32_t status;
};

static void count(struct monitor_view *v, const struct capture *c)
{
    const struct recording *r = &c->recording;
    for (; v->seen < r->n; v->seen++) {
        uint64_t lost = 0;
        if (v->seen > 0)
            (void)recording_between(r, v->seen - 1, &lost);
        v->samples++;
        v->lost += lost;
    }
}

static struct now measure(const struct monitor_view *v, const struct capture *c)
{
    const struct recording *r = &c->recording;
    const struct beam_live *last = &r->live[r->n - 1];
    const double span = v->every_s * r->sample_Hz;
    struct now now = {.time_s = (double)(last->sequence - v->first) / r->sample_Hz,
                      .ratio = (double)last->ratio,
                      .innovation_ratio = (double)last->innovation_ratio,
                      .status = last->status};
    double n = 0.0;
    for (size_t i = r->n; i-- > 0 && (double)(last->sequence - r->live[i].sequence) < span; n++) {
        now.measured_rms += pow((double)r->live[i].measured, 2.0);
        now.predicted_rms += pow((double)r->live[i].predicted, 2.0);
        now.residual_rms += pow((double)r->live[i].residual, 2.0);
    }
    now.measured_rms = sqrt(now.measured_rms / n);
    now.predicted_rms = sqrt(now.predicted_rms / n);
    now.residual_rms = sqrt(now.residual_rms / n);
    return now;
}

/* ---- Lines ---- */

static const struct answer_field mode_fields[] = {
    ANSWER_ROW(COUNT, "mode", "of those that are followed, lowest first"),
    ANSWER_ROW(NUMBER, "frequency_Hz", "as it is now", .digits = 5),
    ANSWER_ROW(NUMBER, "frequency_se_Hz", "its standard error", .digits = 2),
    ANSWER_ROW(NUMBER, "damping_ratio", "share of critical damping", .flags = ANSWER_PERCENT, .digits = 3),
    ANSWER_ROW(NUMBER, "damping_ratio_se", "its standard error", .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_ROW(NUMBER, "gain", "from drive to sensor, of the model's", .digits = 3),
    ANSWER_ROW(NUMBER, "gain_se", "its standard error", .digits = 2),
    ANSWER_SAY(
        "            mode {mode}: {frequency_Hz} ± {frequency_se_Hz}, damping {damping_ratio} ± {damping_ratio_se}, "
        "gain {gain} ± {gain_se}",
        .flags = ANSWER_VERBATIM),
    {0},
};

const struct answer_field monitor_fields[] = {
    ANSWER_ROW(NUMBER, "time_s", "the board's time since the first line", .digits = -2),
    ANSWER_ROW(COUNT, "sequence", "the board's number of the newest sample"),
    ANSWER_ROW(NUMBER, "measured_rms", "of the sensor since the last line, in its unit", .digits = 4),
    ANSWER_ROW(NUMBER, "predicted_rms", "of the model", .digits = 4),
    ANSWER_ROW(NUMBER, "residual_rms", "of their difference", .digits = 4),
    ANSWER_ROW(NUMBER, "ratio", "residual over the expected noise", .digits = 3),
    ANSWER_ROW(NUMBER, "innovation_ratio", "what the board's observer leaves of it, over the same noise", .digits = 3),
    ANSWER_ROW(BOOL, "alarm", "the board has raised it"),
    ANSWER_ROW(BOOL, "disturbed", "the observer explains what the model does not: a push"),
    ANSWER_ROW(BOOL, "clipped", "the sensor was at an end of its range"),
    ANSWER_ROW(TEXT, "sensor", "what is wrong with the sensor; empty: in order"),
    ANSWER_ROW(COUNT, "counter", "of the image"),
    ANSWER_ROW(COUNT, "samples", "that came"),
    ANSWER_ROW(COUNT, "lost", "that did not come"),
    ANSWER_ROW(COUNT, "crc_failures", "frames with a wrong CRC-32"),
    ANSWER_ROW(COUNT, "bad_frames", "starts of frames that were none"),
    ANSWER_ROW(TEXT, "channel", "of the model, on the sensor"),
    ANSWER_ROW(TEXT, "event", "what has changed; empty: nothing"),
    ANSWER_SAY("[{time_s}  {event}]"),
    ANSWER_SAY("{time_s}  {channel} measured {measured_rms}, predicted {predicted_rms}, residual {residual_rms} rms; "
               "ratio to noise {ratio}, observed {innovation_ratio}{alarm? ALARM|}{disturbed? disturbed|}[ SENSOR "
               "{sensor}]; {lost} lost",
               .flags = ANSWER_VERBATIM),
    ANSWER_ROW_OF(LIST, "modes", "that the board follows beside the model; empty: its image asks for none", mode_fields,
                  .text = ""),
    {0},
};

static void show_line(struct monitor_view *v, const struct capture *c, const struct now *now)
{
    struct bf_error ignored;
    struct json *root = json_new_object();
    const bool alarm = (now->status & BEAM_LIVE_ALARM) != 0;
    json_put_number(root, "time_s", now->time_s);
    json_put_number(root, "sequence", c->newest);
    json_put_number(root, "measured_rms", now->measured_rms);
    json_put_number(root, "predicted_rms", now->predicted_rms);
    json_put_number(root, "residual_rms", now->residual_rms);
    json_put_number(root, "ratio", now->ratio);
    json_put_number(root, "innovation_ratio", now->innovation_ratio);
    json_put_bool(root, "alarm", alarm);
    json_put_bool(root, "disturbed", (now->status & BEAM_LIVE_DISTURBED) != 0);
    json_put_bool(root, "clipped", (now->status & BEAM_LIVE_CLIPPED) != 0);
    json_put_text(root, "sensor", link_sensor_fault(now->status));
    json_put_number(root, "counter", now->status >> BEAM_LIVE_COUNTER);
    json_put_number(root, "samples", (double)v->samples);
    json_put_number(root, "lost", (double)v->lost);
    json_put_number(root, "crc_failures", (double)c->stream.crc_failures);
    json_put_number(root, "bad_frames", (double)c->link.xcp.receiver.resyncs);
    monitor_tracking_json(&v->tracking, root);
    json_put_text(root, "channel", c->output);
    json_put_text(root, "event",
                  alarm == v->alarm ? ""
                  : alarm           ? "ALARM: the model no longer explains the measurement"
                                    : "alarm off");
    v->alarm = alarm;
    (void)answer_print_line_and_free(root, monitor_fields, &ignored); /* main() looks at standard output's state */
    (void)fflush(stdout);
}

/* ---- The panel ---- */

enum quantity { MEASURED, PREDICTED, RESIDUAL, RATIO };

static double value_of(enum quantity quantity, const struct beam_live *live)
{
    switch (quantity) {
    case MEASURED:
        return fabs((double)live->measured);
    case PREDICTED:
        return fabs((double)live->predicted);
    case RESIDUAL:
        return fabs((double)live->residual);
    default:
        return (double)live->ratio;
    }
}

/* Largest size in each column of the window, the newest at the right; NAN: no sample. Returns the largest of all. */
static double find_peaks(const struct monitor_view *v, const struct capture *c, enum quantity quantity, size_t columns,
                         double peak[MOST_COLUMNS])
{
    const struct recording *r = &c->recording;
    const double span = v->window_s * r->sample_Hz;
    double largest = 0.0;
    for (size_t i = 0; i < MOST_COLUMNS; i++)
        peak[i] = NAN;
    for (size_t i = r->n; i-- > 0;) {
        const double ago = (double)(c->newest - r->live[i].sequence);
        if (ago >= span)
            break;
        const size_t before = (size_t)(ago / span * (double)columns);
        const size_t column = before < columns ? columns - 1 - before : 0;
        peak[column] = fmax(peak[column], value_of(quantity, &r->live[i])); /* of NAN and x: x */
        largest = fmax(largest, peak[column]);
    }
    return largest;
}

static void draw_strip(size_t columns, const double peak[], double full)
{
    static const char *const blocks[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
    for (size_t i = 0; i < columns; i++) {
        const double level = full > 0.0 ? fmin(floor(8.0 * peak[i] / full), 7.0) : 0.0;
        (void)fputs(isnan(peak[i]) ? " " : blocks[level > 0.0 ? (int)level : 0], stdout);
    }
    (void)fputs("\033[K\n", stdout);
}

/* On one scale, so that a residual looks as small as it is. */
static void draw_signals(const struct monitor_view *v, const struct capture *c, const struct now *now, size_t columns)
{
    static const char *const names[] = {"measured", "predicted", "residual"};
    const double rms[] = {now->measured_rms, now->predicted_rms, now->residual_rms};
    double peak[3][MOST_COLUMNS], full = 0.0;
    for (enum quantity q = MEASURED; q <= RESIDUAL; q++)
        full = fmax(full, find_peaks(v, c, q, columns, peak[q]));
    for (enum quantity q = MEASURED; q <= RESIDUAL; q++) {
        (void)printf("%-10.10s %-9s %10.4g rms  ", q == MEASURED ? c->output : "", names[q], rms[q]);
        draw_strip(columns, peak[q], full);
    }
}

static void show_panel(struct monitor_view *v, const struct capture *c, const struct now *now)
{
    const size_t width = text_columns(), columns = width - 38 < MOST_COLUMNS ? width - 38 : MOST_COLUMNS;
    double peak[MOST_COLUMNS];
    if (v->drawn)
        (void)printf("\033[%dA", PANEL_LINES + (int)monitor_tracking_modes(&v->tracking));
    v->drawn = true;
    (void)printf("board %s  model %u  %.6g Hz  %.1f s  %s\033[K\n", c->device, now->status >> BEAM_LIVE_COUNTER,
                 c->recording.sample_Hz / c->recording.prescale, now->time_s,
                 now->status & BEAM_LIVE_ALARM                          ? "\033[1;31mALARM\033[0m"
                 : now->status & BEAM_LIVE_STUCK                        ? "\033[1;31msensor stuck\033[0m"
                 : now->status & BEAM_LIVE_QUIET                        ? "\033[1;31msensor too quiet\033[0m"
                 : now->status & BEAM_LIVE_OFFSET                       ? "\033[1;33msensor has an offset\033[0m"
                 : now->status & (BEAM_LIVE_CLIPPED | BEAM_LIVE_AT_END) ? "\033[1;33msensor at its end\033[0m"
                 : now->status & BEAM_LIVE_DISTURBED                    ? "\033[1;33mpushed\033[0m"
                                                                        : "in order");
    draw_signals(v, c, now, columns);
    const double largest = find_peaks(v, c, RATIO, columns, peak);
    (void)printf("ratio to noise  %8.3g (alarm %5.3g)  ", now->ratio, (double)c->setup.alarm_ratio);
    draw_strip(columns, peak, fmax(largest, (double)c->setup.alarm_ratio));
    monitor_tracking_print(&v->tracking, "\033[K\n");
    (void)printf("%llu samples, %llu lost, %llu CRC failures, %llu bad frames; Ctrl-C ends\033[K\n",
                 (unsigned long long)v->samples, (unsigned long long)v->lost,
                 (unsigned long long)c->stream.crc_failures, (unsigned long long)c->link.xcp.receiver.resyncs);
    (void)fflush(stdout);
}

void monitor_show(struct monitor_view *v, const struct capture *c)
{
    count(v, c);
    const struct now now = measure(v, c);
    if (v->panel)
        show_panel(v, c, &now);
    else
        show_line(v, c, &now);
}

void monitor_forget(struct monitor_view *v, struct capture *c, uint32_t window)
{
    const size_t before = c->recording.n;
    recording_drop_before(&c->recording, c->newest - window);
    const size_t dropped = before - c->recording.n;
    v->seen = v->seen > dropped ? v->seen - dropped : 0;
}

/* ---- Pictures ---- */

static double *column_of(const struct recording *r, const struct recording_summary *s,
                         double (*value)(const struct beam_live *live))
{
    double *x = bf_alloc(s->n, sizeof *x);
    for (size_t i = 0; i < s->n; i++)
        x[i] = value(&r->live[s->from + i]);
    return x;
}

static double measured(const struct beam_live *live)
{
    return (double)live->measured;
}

static double predicted(const struct beam_live *live)
{
    return (double)live->predicted;
}

static double residual(const struct beam_live *live)
{
    return (double)live->residual;
}

static double ratio(const struct beam_live *live)
{
    return (double)live->ratio;
}

enum bf_status monitor_plot(const struct monitor_view *v, const struct capture *c, const char *directory,
                            struct bf_error *err)
{
    const struct recording *r = &c->recording;
    const struct recording_summary s = recording_summarise(r);
    const double dt_s = r->prescale / r->sample_Hz;
    char title[128];
    if (s.n < 16)
        return bf_fail(err, BF_DEVICE, "%s: only %zu samples in a row arrived, too few for a picture",
                       port_path(c->link.port), s.n);
    (void)snprintf(title, sizeof title, "board %s, model %u", c->device, (unsigned)c->link.info.counter);
    double *y = column_of(r, &s, measured), *p = column_of(r, &s, predicted);
    double *e = column_of(r, &s, residual), *q = column_of(r, &s, ratio);
    const struct plot_live live = {directory,
                                   "live",
                                   title,
                                   c->output,
                                   s.n,
                                   dt_s,
                                   y,
                                   p,
                                   e,
                                   q,
                                   (double)c->setup.noise_rms,
                                   (double)c->setup.alarm_ratio};
    const struct plot_panels panels = {.directory = directory,
                                       .stem = "live-panels",
                                       .title = title,
                                       .quantity = c->output,
                                       .n = s.n,
                                       .dt_s = dt_s,
                                       .measured = y,
                                       .model = p};
    enum bf_status status = plot_live(&live, err);
    if (status == BF_OK)
        status = plot_panels(&panels, err);
    if (status == BF_OK && v->tracking.n > 1)
        status = monitor_tracking_plot(&v->tracking, directory, title, err);
    free(y), free(p), free(e), free(q);
    return status;
}
