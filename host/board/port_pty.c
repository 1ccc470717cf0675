/* SPDX-License-Identifier: GPL-3.0-or-later */
/* port_pty.c — pseudo terminals, for emulated boards. */
#include <errno.h>
#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include "port_driver.h"

/* The rate means nothing to a pseudo terminal, but an emulated board may read it there. */
static speed_t speed_of(long baud)
{
    static const struct {
        long baud;
        speed_t speed;
    } table[] = {{9600, B9600},     {19200, B19200},   {38400, B38400},   {57600, B57600},     {115200, B115200},
                 {230400, B230400}, {460800, B460800}, {921600, B921600}, {1000000, B1000000}, {2000000, B2000000}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        if (table[i].baud == baud)
            return table[i].speed;
    return B115200;
}

static int pty_open(struct port *port)
{
    struct termios settings;
    port->fd = open(port->node, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (port->fd < 0)
        return errno;
    if (tcgetattr(port->fd, &settings) == 0) {
        cfmakeraw(&settings);
        settings.c_cc[VMIN] = 0;
        settings.c_cc[VTIME] = 0;
        if (cfsetspeed(&settings, speed_of(port->baud)) == 0 && tcsetattr(port->fd, TCSANOW, &settings) == 0)
            return 0;
    }
    const int reason = errno;
    (void)close(port->fd);
    return reason;
}

static void pty_close(struct port *port)
{
    (void)close(port->fd);
}

static long outcome(ssize_t n)
{
    if (n >= 0)
        return n;
    if (errno == EAGAIN || errno == EINTR)
        return 0;
    return errno == EIO ? PORT_GONE : PORT_FAILED;
}

static long pty_read(struct port *port, size_t n, uint8_t out[])
{
    return outcome(read(port->fd, out, n));
}

static long pty_write(struct port *port, size_t n, const uint8_t bytes[])
{
    return outcome(write(port->fd, bytes, n));
}

static int pty_flush(struct port *port)
{
    return tcflush(port->fd, TCIOFLUSH) == 0 ? 0 : PORT_FAILED;
}

const struct port_driver port_driver_pty = {pty_open, pty_close, pty_read, pty_write, pty_flush};
