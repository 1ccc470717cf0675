/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The bad line: a process between a pseudo terminal of its own and the board's port. */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>
#include "board.h"

struct relay {
    struct line_faults faults;
    int program, board,
        other; /* descriptors; other: the far end of program, so that it exists while nobody has it open */
    long passed;
    double free_s[2]; /* per direction: when the line has sent what it was given */
    unsigned random;
};

static volatile sig_atomic_t stopped;

static void stop(int signal)
{
    (void)signal;
    stopped = 1;
}

static double draw(struct relay *r)
{
    r->random = r->random * 1664525u + 1013904223u;
    return (r->random >> 8) / 16777216.0;
}

/* n bytes with their faults; up to 2 n. */
static size_t damage(struct relay *r, size_t n, const unsigned char in[], unsigned char out[])
{
    size_t m = 0;
    for (size_t i = 0; i < n; i++) {
        out[m++] = in[i];
        if (r->faults.noise <= 0.0 || draw(r) >= r->faults.noise)
            continue;
        const double kind = draw(r);
        if (kind < 0.2)
            m--;
        else if (kind < 0.4)
            out[m++] = (unsigned char)(256.0 * draw(r));
        else
            out[m - 1] ^= (unsigned char)(1u << (unsigned)(8.0 * draw(r)));
    }
    return m;
}

static void write_all(int to, size_t n, const unsigned char bytes[])
{
    while (n > 0 && !stopped) {
        const ssize_t sent = write(to, bytes, n);
        if (sent < 0 && errno != EAGAIN && errno != EINTR)
            return;
        if (sent > 0) {
            bytes += sent;
            n -= (size_t)sent;
        } else {
            (void)poll(&(struct pollfd){.fd = to, .events = POLLOUT}, 1, 20);
        }
    }
}

static void wait_out(struct relay *r, int direction, size_t n)
{
    struct timespec now;
    if (r->faults.baud <= 0)
        return;
    clock_gettime(CLOCK_MONOTONIC, &now);
    const double now_s = (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
    double *free_s = &r->free_s[direction];
    *free_s = (*free_s > now_s ? *free_s : now_s) + 10.0 * (double)n / (double)r->faults.baud;
    const double s = *free_s - now_s;
    nanosleep(&(struct timespec){(time_t)s, (long)(1e9 * (s - (double)(time_t)s))}, NULL);
}

/* 0: the cable is cut. */
static int pass(struct relay *r, int direction, int from, int to)
{
    unsigned char in[256], out[512];
    size_t most = r->faults.baud > 0 ? 64 : sizeof in;
    if (r->faults.cut_after > 0 && (long)most > r->faults.cut_after - r->passed)
        most = (size_t)(r->faults.cut_after - r->passed);
    const ssize_t got = read(from, in, most);
    if (got <= 0)
        return 1;
    r->passed += got;
    wait_out(r, direction, (size_t)got);
    write_all(to, damage(r, (size_t)got, in, out), out);
    return r->faults.cut_after == 0 || r->passed < r->faults.cut_after;
}

static void run(struct relay *r)
{
    struct pollfd ready[2] = {{.fd = r->program, .events = POLLIN}, {.fd = r->board, .events = POLLIN}};
    int whole = 1;
    while (!stopped && whole) {
        if (poll(ready, 2, 100) <= 0)
            continue;
        if (ready[0].revents != 0)
            whole = pass(r, 0, r->program, r->board);
        if (whole && (ready[1].revents & POLLIN) != 0)
            whole = pass(r, 1, r->board, r->program);
    }
    if (!whole && r->faults.unplug) {
        close(r->other);
        close(r->program);
    }
    while (!stopped)
        (void)poll(NULL, 0, 50);
}

static int open_raw(const char *port)
{
    struct termios settings;
    const int fd = open(port, O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (fd >= 0 && tcgetattr(fd, &settings) == 0) {
        cfmakeraw(&settings);
        tcsetattr(fd, TCSANOW, &settings);
    }
    return fd;
}

void line_start(struct line *line, const char *port, const struct line_faults *faults)
{
    int counts[2];
    struct relay r = {.faults = *faults, .random = faults->seed * 2654435761u + 1u};
    r.board = open_raw(port);
    r.program = posix_openpt(O_RDWR | O_NOCTTY);
    if (r.board < 0 || r.program < 0 || grantpt(r.program) != 0 || unlockpt(r.program) != 0 || pipe(counts) != 0) {
        fprintf(stderr, "tests: no line to %s\n", port);
        exit(99);
    }
    snprintf(line->port, sizeof line->port, "%s", ptsname(r.program));
    r.other = open_raw(line->port);
    line->process = fork();
    if (line->process == 0) {
        signal(SIGTERM, stop);
        run(&r);
        _exit(write(counts[1], &r.passed, sizeof r.passed) == sizeof r.passed ? 0 : 1);
    }
    close(counts[1]);
    close(r.board);
    close(r.program);
    close(r.other);
    line->counts = counts[0];
}

long line_stop(struct line *line)
{
    long passed = 0;
    if (line->process <= 0)
        return 0;
    kill(line->process, SIGTERM);
    if (read(line->counts, &passed, sizeof passed) != sizeof passed)
        passed = -1;
    waitpid(line->process, NULL, 0);
    close(line->counts);
    line->process = 0;
    return passed;
}
