/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ground.h"

#include <math.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

enum { BAR = 24, LINE = 160 };

struct progress {
    char what[48];
    bool visible;
    double start_s, drawn_s;
};

static double now_s(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static struct {
    progress_listener *tell;
    void *context;
} listener;

void progress_listen(progress_listener *tell, void *context)
{
    listener.context = context;
    listener.tell = tell;
}

struct progress *progress_begin(const char *what)
{
    struct progress *progress = bf_alloc(1, sizeof *progress);
    (void)snprintf(progress->what, sizeof progress->what, "%s", what);
    progress->visible = isatty(STDERR_FILENO) == 1;
    progress->start_s = now_s();
    progress->drawn_s = -1e9;
    return progress;
}

static void print_estimate(char text[32], double fraction, double elapsed_s)
{
    double rest_s = elapsed_s * (1.0 - fraction) / fraction;
    text[0] = '\0';
    if (fraction < 0.02 || elapsed_s < 1.0 || !isfinite(rest_s))
        return;
    if (rest_s >= 3600.0)
        (void)snprintf(text, 32, ", %.1f h left", rest_s / 3600.0);
    else if (rest_s >= 90.0)
        (void)snprintf(text, 32, ", %.0f min left", rest_s / 60.0);
    else
        (void)snprintf(text, 32, ", %.0f s left", rest_s);
}

static size_t terminal_columns(void)
{
    struct winsize size;
    bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 10;
    return known && size.ws_col < LINE ? size.ws_col : known ? LINE : 80;
}

static void draw(const struct progress *progress, double now, double fraction, const char *note)
{
    char bar[BAR + 1], estimate[32], line[LINE];
    for (int i = 0; i < BAR; i++)
        bar[i] = (i + 0.5) / BAR <= fraction ? '#' : '.';
    bar[BAR] = '\0';
    print_estimate(estimate, fraction, now - progress->start_s);
    int used = snprintf(line, sizeof line, "%s [%s] %3.0f %%%s", progress->what, bar, fraction * 100.0, estimate);
    if (note && used > 0 && (size_t)used < sizeof line)
        (void)snprintf(line + used, sizeof line - (size_t)used, "; %s", note);
    size_t columns = terminal_columns() - 1;
    if (strlen(line) > columns)
        line[columns] = '\0'; /* a line that wraps could not be redrawn */
    (void)fprintf(stderr, "\r\033[K%s", line);
    (void)fflush(stderr);
}

void progress_update(struct progress *progress, double fraction, const char *note)
{
    if (!progress->visible && listener.tell == NULL)
        return;
    double now = now_s();
    if (now - progress->drawn_s < 0.1)
        return;
    progress->drawn_s = now;
    fraction = fraction > 0.0 ? fmin(fraction, 1.0) : 0.0;
    if (listener.tell != NULL)
        listener.tell(listener.context, progress->what, fraction, note != NULL ? note : "");
    if (progress->visible)
        draw(progress, now, fraction, note);
}

void progress_stage(struct progress *progress, double fraction, const char *note)
{
    progress->drawn_s = -1e9;
    progress_update(progress, fraction, note);
}

void progress_end(struct progress *progress)
{
    if (progress->visible && progress->drawn_s > 0.0) {
        (void)fputs("\r\033[K", stderr);
        (void)fflush(stderr);
    }
    free(progress);
}

static atomic_int interrupted; /* by the signal on any thread, and by progress_interrupt() */

static void on_interrupt(int number)
{
    (void)number;
    interrupted = 1;
}

void progress_catch_interrupts(void)
{
    struct sigaction action = {.sa_handler = on_interrupt};
    (void)sigemptyset(&action.sa_mask);
    action.sa_flags = (int)SA_RESETHAND; /* the second Ctrl-C ends the program */
    interrupted = 0;
    (void)sigaction(SIGINT, &action, NULL);
}

bool progress_interrupted(void)
{
    return interrupted != 0;
}

void progress_interrupt(void)
{
    interrupted = 1;
}
