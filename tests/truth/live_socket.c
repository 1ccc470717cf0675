/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The plant on a unix stream socket. A controller sends 4 bytes each tick: u16 0x5042, u16 drive code, and is answered
 * 2 bytes: u16 sensor code at the next tick; all little-endian. The drive code acts, held, from this tick to the next.
 */
#include "truth_internal.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

enum { MAGIC = 0x5042, REQUEST = 4, ANSWER = 2, POLL_MS = 100 };

static int listen_at(const char *path, char *message)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path)
        return truth_fail(message, "%.100s: the path of a socket has at most %zu characters", path,
                          sizeof address.sun_path - 1);
    strcpy(address.sun_path, path);
    struct stat there;
    if (lstat(path, &there) == 0 && !S_ISSOCK(there.st_mode))
        return truth_fail(message, "%.100s: there is another file at that path", path);
    unlink(path); /* what an earlier plant left */
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 && bind(fd, (const struct sockaddr *)&address, sizeof address) == 0 && listen(fd, 1) == 0)
        return fd;
    truth_fail(message, "%.100s: cannot listen: %s", path, strerror(errno));
    if (fd >= 0)
        close(fd);
    return -1;
}

/* True when fd can be read; false when stop() says so. */
static bool wait_readable(int fd, bool (*stop)(void))
{
    struct pollfd poll_fd = {.fd = fd, .events = POLLIN};
    while (!stop()) {
        int ready = poll(&poll_fd, 1, POLL_MS);
        if (ready > 0 || (ready < 0 && errno != EINTR))
            return ready > 0;
    }
    return false;
}

/* A whole request, or false: the controller is gone. */
static bool read_request(int fd, uint8_t request[REQUEST], bool (*stop)(void))
{
    for (size_t have = 0; have < REQUEST;) {
        if (!wait_readable(fd, stop))
            return false;
        ssize_t n = recv(fd, request + have, REQUEST - have, 0);
        if (n == 0 || (n < 0 && errno != EINTR))
            return false;
        have += n > 0 ? (size_t)n : 0;
    }
    return true;
}

static int serve_one(struct truth_plant *const *plant, int fd, bool (*stop)(void), char *message)
{
    uint8_t request[REQUEST];
    while (read_request(fd, request, stop)) {
        uint16_t code;
        if ((request[0] | request[1] << 8) != MAGIC) {
            fputs("beam_truth: a request without its mark; the line is closed\n", stderr);
            return 0;
        }
        if (truth_plant_tick(*plant, (uint16_t)(request[2] | request[3] << 8), &code, message) != 0)
            return -1;
        const uint8_t answer[ANSWER] = {(uint8_t)(code & 0xFF), (uint8_t)(code >> 8)};
        if (send(fd, answer, ANSWER, MSG_NOSIGNAL) != ANSWER)
            return 0;
    }
    return 0;
}

int truth_plant_serve(struct truth_plant *const *plant, const char *path, bool (*stop)(void),
                      char message[TRUTH_MESSAGE])
{
    int listening = listen_at(path, message), status = listening < 0 ? -1 : 0;
    while (status == 0 && wait_readable(listening, stop)) {
        int fd = accept(listening, NULL, NULL);
        if (fd < 0)
            continue;
        status = serve_one(plant, fd, stop, message);
        close(fd);
    }
    if (listening >= 0) {
        close(listening);
        unlink(path);
    }
    return status;
}
