/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "board_drive.h"
#include "capture.h"
#include "commands.h"
#include "monitor_view.h"
#include "show/show.h"
#include "ground/ground.h"

static const char help[] =
    "Usage: beamfit monitor --port PORT [--seconds S] [--plot DIR] [options]\n"
    "\n"
    "Shows live how well the board's model predicts what its sensor measures: measured, predicted, their\n"
    "difference, and that difference over the expected noise. A ratio near 1 means that the model explains all\n"
    "but noise; the board raises its alarm when its observer does not explain the rest either, above a ratio that\n"
    "the image states (`beamfit info`): a push disturbs, a wrong model alarms. A sensor that is stuck, at an end\n"
    "of its range, too quiet or has an offset is said apart from that. Modes that the board follows (`beamfit\n"
    "export --track`) are shown with two standard errors' worth of doubt in the pictures, one in the lines.\n"
    "Without --chirp nothing is changed. On a\n"
    "terminal a few lines are redrawn ten times a second; piped, one line is printed each second.\n";

static const struct option_row options[] = {
    BOARD_OPTIONS,
    {'s', 0, "seconds", "S", NULL, "end after so long in the board's time (default: Ctrl-C ends it)"},
    {'e', 0, "every", "S", NULL, "time between printed lines, and what their rms values span (default 1)"},
    {'w', 0, "window", "S", NULL, "what strips and pictures show: the last S seconds (default 10)"},
    {'P', 0, "prescale", "P", NULL, "every P-th sample only (default: the least that the line carries)"},
    {'c', 0, "chirp", "F0:F1:T:AMPL", NULL,
     "drive meanwhile: from F0 to F1 Hz in T seconds, amplitude AMPL in the input's unit, again and again; "
     "needs --key FILE, the board's key. Else nothing is driven: a drive ends with its session"},
    {'k', 0, "key", "FILE", NULL, "the board's secret key, for --chirp"},
    {'m', 0, "model", "MODEL", NULL, "name of the sensor's channel (default piezo_V)"},
    {'d', 0, "plot", "DIR", NULL,
     "pictures at the end: live (signals, residual, ratio), live-panels (spectra), live-tracking (followed modes)"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace pictures even when `monitor` has not made them or somebody has changed them"},
    OPTIONS_JSON,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit monitor --port /dev/ttyUSB0 --baud 921600 --seconds 60 --plot pictures\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 MODEL bad, or DIR not writable; 5 no port, no answer, or the board fell\n"
    "silent.\n";

struct arguments {
    struct board_options board;
    const char *model, *plot, *key;
    struct chirp chirp;
    bool drives;
    double seconds, every_s, window_s;
    long prescale;
};

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case 's':
        return options_positive("--seconds", optarg, INFINITY, &a->seconds, err);
    case 'e':
        return options_positive("--every", optarg, INFINITY, &a->every_s, err);
    case 'w':
        return options_positive("--window", optarg, INFINITY, &a->window_s, err);
    case 'P':
        return options_count("--prescale", optarg, 1, BOARD_MOST_PRESCALE, &a->prescale, err);
    case 'm':
        a->model = optarg;
        return BF_OK;
    case 'd':
        a->plot = optarg;
        return BF_OK;
    case 'k':
        a->key = optarg;
        return BF_OK;
    case 'c':
        a->drives = true;
        return chirp_read(optarg, &a->chirp, err);
    default:
        return board_take_option(code, &a->board, err);
    }
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1)
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    if (options_only(argc, argv, err) != BF_OK)
        return BF_USAGE;
    if (a->drives && a->key == NULL)
        return bf_fail(err, BF_USAGE, "a board drives only for who has its key: --chirp with --key FILE");
    return board_check_options(&a->board, "monitor", err);
}

/* So many of the board's samples; at least one. */
static uint32_t samples_in(const struct capture *c, double seconds)
{
    const double n = seconds * c->recording.sample_Hz;
    return n < 1.0 ? 1 : n > 2e9 ? 2000000000u : (uint32_t)n;
}

/* From one look to the next, at most to sample `last`: on a terminal 0.1 s of the clock. */
static enum bf_status look(const struct arguments *a, struct capture *c, bool panel, uint32_t last,
                           struct bf_error *err)
{
    enum { REDRAW_MS = 100 };
    if (!panel)
        return capture_until(c, last, NULL, 0, err);
    const int64_t until_ms = port_clock_ms() + REDRAW_MS;
    for (int64_t left_ms = REDRAW_MS; left_ms > 0 && !progress_interrupted(); left_ms = until_ms - port_clock_ms()) {
        if (a->seconds > 0.0 && (int32_t)(c->newest - last) >= 0)
            break;
        if (link_run_stream(&c->link, (int)left_ms, err) != BF_OK)
            return err->status;
    }
    return BF_OK;
}

static enum bf_status watch(const struct arguments *a, struct capture *c, struct monitor_view *view,
                            struct bf_error *err)
{
    const uint32_t first = c->newest, every = samples_in(c, a->every_s), window = samples_in(c, a->window_s);
    const uint32_t last = first + samples_in(c, a->seconds);
    uint32_t next = first + every;
    while (!progress_interrupted() && !ferror(stdout) && (a->seconds <= 0.0 || (int32_t)(c->newest - last) < 0)) {
        if (a->seconds > 0.0 && (int32_t)(next - last) > 0)
            next = last;
        if (look(a, c, view->panel, view->panel ? last : next, err) != BF_OK)
            return err->status;
        if (monitor_track(view, c, err) != BF_OK)
            return err->status;
        monitor_show(view, c);
        while ((int32_t)(c->newest - next) >= 0)
            next += every;
        if (c->recording.n > 2 * (size_t)(window / c->recording.prescale + 1))
            monitor_forget(view, c, window);
    }
    return BF_OK;
}

/* From now on; the model goes on as it is. */
static enum bf_status drive(const struct arguments *a, struct capture *c, struct bf_error *err)
{
    struct beam_drive drive = {.amplitude = 0.0F};
    if (chirp_make(&a->chirp, c->recording.sample_Hz, &c->setup, &drive, err) != BF_OK ||
        capture_unlock(c, a->key, err) != BF_OK)
        return err->status;
    return link_start_drive(&c->link, &drive, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.every_s = 1.0, .window_s = 10.0};
    struct capture c = {0};
    struct monitor_view view = {0};
    if (parse(argc, argv, &a, err) != BF_OK || capture_name(&c, a.model, err) != BF_OK ||
        plot_prepare(a.plot, (const char *const[]){"live", "live-panels", "live-tracking"}, 3, err) != BF_OK)
        return err->status;
    progress_catch_interrupts();
    if (capture_open(&c, &a.board, a.prescale, err) != BF_OK)
        return err->status;
    view.panel = options_format() == OPTIONS_TEXT && isatty(STDOUT_FILENO) == 1;
    view.every_s = a.every_s;
    view.window_s = a.window_s;
    enum bf_status status = monitor_track(&view, &c, err); /* before the stream: is there anything to follow? */
    if (status == BF_OK)
        status = capture_start(&c, err);
    if (status == BF_OK && a.drives)
        status = drive(&a, &c, err);
    if (status == BF_OK)
        status = capture_until(&c, 0, NULL, 0, err);
    if (status == BF_OK) {
        monitor_begin(&view, &c);
        status = watch(&a, &c, &view, err);
    }
    if (status == BF_OK)
        status = capture_stop(&c, err);
    if (status == BF_OK && a.plot != NULL) {
        status = monitor_plot(&view, &c, a.plot, err);
        if (status == BF_OK && options_format() == OPTIONS_TEXT && plot_can_draw(NULL))
            (void)printf("Pictures: %s/live.png, live-panels.png\n", a.plot);
    }
    monitor_end(&view);
    capture_close(&c);
    return status;
}

const struct command command_monitor = {
    .place = 180,
    .name = "monitor",
    .summary = "watch the board's prediction against its measurement, live",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = monitor_fields,
    .run = run,
};
