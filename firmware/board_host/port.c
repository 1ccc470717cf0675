/* SPDX-License-Identifier: MIT */
/* The serial port: a pseudo terminal that outlives the programs that open it. */
#include "host.h"
#include "board.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

static int port = -1;
static bool full; /* the last bytes found no room */
static const char *link_path;

void host_port_open(const char *link)
{
    struct termios raw;
    port = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (port < 0 || grantpt(port) != 0 || unlockpt(port) != 0)
        host_fail("no pseudo terminal: %s", strerror(errno));
    const char *name = ptsname(port);
    const int other =
        open(name, O_RDWR | O_NOCTTY | O_CLOEXEC); /* held open: reading here gives no error between hosts */
    if (other < 0 || tcgetattr(other, &raw) != 0)
        host_fail("%s: %s", name, strerror(errno));
    cfmakeraw(&raw);
    tcsetattr(other, TCSANOW, &raw);
    fcntl(port, F_SETFL, O_NONBLOCK);
    if (link) {
        unlink(link);
        if (symlink(name, link) != 0)
            host_fail("%s: %s", link, strerror(errno));
        link_path = link;
    }
    printf("port: %s\n", name);
}

void host_port_close(void)
{
    if (link_path)
        unlink(link_path);
}

int host_port_fd(void)
{
    return port;
}

size_t board_receive(size_t n, uint8_t out[])
{
    const ssize_t got = read(port, out, n);
    return got > 0 ? (size_t)got : 0;
}

size_t board_send(size_t n, const uint8_t bytes[])
{
    const ssize_t sent = write(port, bytes, n);
    full = sent < 0 && errno == EAGAIN;
    return sent > 0 ? (size_t)sent : 0;
}

bool host_port_wait(int ms)
{
    struct pollfd fd = {.fd = port, .events = POLLOUT};
    return !full || poll(&fd, 1, ms) != 0;
}
