/* SPDX-License-Identifier: GPL-3.0-or-later */
/* port.c — a port by one of its two back ends: waiting, locking, and every message. */
#include "port.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>

#include "port_driver.h"

int64_t port_clock_ms(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

const char *port_path(const struct port *port)
{
    return port->path;
}

long port_baud(const struct port *port)
{
    return port->baud;
}

bool port_is_pty(const struct port *port)
{
    return port->driver == &port_driver_pty;
}

/* ---- Opening ---- */

/* reason: as of port_driver.open(). */
static enum bf_status fail_open(const struct port *port, int reason, struct bf_error *err)
{
    char list[512];
    switch (reason) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
        port_list(sizeof list, list);
        return bf_fail(err, BF_DEVICE, "%s: there is no such port%s", port->path, list);
    case EACCES:
    case EPERM:
        return bf_fail(err, BF_DEVICE,
                       "%s: no permission; join the group that owns serial ports and log in again: sudo adduser $USER "
                       "dialout",
                       port->path);
    case EBUSY:
    case EWOULDBLOCK:
        return bf_fail(err, BF_DEVICE,
                       "%s: another program uses the port (a second beamfit, a terminal program, ModemManager); end it "
                       "and try again",
                       port->path);
    case EIO:
        return bf_fail(err, BF_DEVICE, "%s: the far end is gone; plug it in, or start the board, and try again",
                       port->path);
    case PORT_NOT_SERIAL:
        return bf_fail(err, BF_DEVICE, "%s: is not a serial port; give one, e.g. /dev/ttyUSB0", port->path);
    case PORT_NO_SUCH_RATE:
        return bf_fail(err, BF_DEVICE,
                       "%s: does not take %ld bit/s; give a rate that the adapter has, e.g. --baud 115200", port->path,
                       port->baud);
    default:
        return bf_fail(err, BF_DEVICE, "%s: cannot be opened: %s; give a serial port, e.g. /dev/ttyUSB0", port->path,
                       strerror(reason));
    }
}

static void free_port(struct port *port)
{
    free(port->path);
    free(port->node);
    free(port);
}

static enum bf_status check_node(struct port *port, struct bf_error *err)
{
    struct stat info;
    port->node = realpath(port->path, NULL);
    if (port->node == NULL || stat(port->node, &info) != 0)
        return fail_open(port, errno, err);
    if (!S_ISCHR(info.st_mode))
        return fail_open(port, PORT_NOT_SERIAL, err);
    return BF_OK;
}

enum bf_status port_open(const char *path, long baud, struct port **out, struct bf_error *err)
{
    *out = NULL;
    struct port *port = bf_alloc(1, sizeof *port);
    port->path = bf_strdup(path);
    port->baud = baud;
    port->fd = -1;
    enum bf_status status = check_node(port, err);
    if (status == BF_OK) {
        port->driver = strncmp(port->node, "/dev/pts/", 9) == 0 ? &port_driver_pty : &port_driver_serial;
        const int reason = port->driver->open(port);
        if (reason != 0)
            status = fail_open(port, reason, err);
    }
    if (status == BF_OK && flock(port->fd, LOCK_EX | LOCK_NB) != 0) {
        status = fail_open(port, errno, err);
        port->driver->close(port);
    }
    if (status == BF_OK)
        *out = port;
    else
        free_port(port);
    return status;
}

void port_close(struct port *port)
{
    if (port == NULL)
        return;
    port->driver->close(port);
    free_port(port);
}

/* ---- Reading and writing ---- */

static enum bf_status failed(const struct port *port, long result, const char *what, struct bf_error *err)
{
    if (result == PORT_GONE || errno == EIO || errno == ENXIO || errno == ENODEV)
        return bf_fail(err, BF_DEVICE,
                       "%s: the port is gone: cable out, board without power, or its program ended; "
                       "plug it in and try again",
                       port->path);
    return bf_fail(err, BF_DEVICE, "%s: %s failed: %s", port->path, what, strerror(errno));
}

/* Waits until the port is ready: > 0; 0 when the time is over; PORT_GONE when the far end hung up. */
static int wait_ready(const struct port *port, short events, int64_t until_ms)
{
    struct pollfd ready = {.fd = port->fd, .events = events};
    const int64_t left_ms = until_ms - port_clock_ms();
    const int n = poll(&ready, 1, left_ms > 0 ? (int)left_ms : 0);
    if (n < 0)
        return errno == EINTR ? 0 : PORT_FAILED;
    if (n > 0 && (ready.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
        return PORT_GONE;
    return n;
}

enum bf_status port_read(struct port *port, size_t n, uint8_t out[], size_t *got, int timeout_ms, struct bf_error *err)
{
    *got = 0;
    long result = port->driver->read(port, n, out);
    if (result == 0) { /* a hung-up port reads as empty */
        const int ready = wait_ready(port, POLLIN, port_clock_ms() + timeout_ms);
        result = ready > 0 ? port->driver->read(port, n, out) : ready;
    }
    if (result < 0)
        return failed(port, result, "reading", err);
    *got = (size_t)result;
    return BF_OK;
}

enum bf_status port_write(struct port *port, size_t n, const uint8_t bytes[], int timeout_ms, struct bf_error *err)
{
    const int64_t until_ms = port_clock_ms() + timeout_ms;
    for (size_t sent = 0; sent < n;) {
        const int ready = wait_ready(port, POLLOUT, until_ms);
        const long result = ready > 0 ? port->driver->write(port, n - sent, bytes + sent) : ready;
        if (result < 0)
            return failed(port, result, "writing", err);
        sent += (size_t)result;
        if (sent < n && port_clock_ms() >= until_ms)
            return bf_fail(err, BF_DEVICE,
                           "%s: the board takes no bytes; check that it runs, and that flow control is off",
                           port->path);
    }
    return BF_OK;
}

enum bf_status port_flush(struct port *port, struct bf_error *err)
{
    return port->driver->flush(port) == 0 ? BF_OK : failed(port, PORT_FAILED, "flushing", err);
}
