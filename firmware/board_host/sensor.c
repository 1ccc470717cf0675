/* SPDX-License-Identifier: MIT */
/* Sensor codes: from a plant at a unix socket, from a file, or mid scale. */
#include "host.h"
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>

enum { MAGIC = 0x5042, MID_SCALE = 2048, CODE_MAX = 4095 };

static int plant = -1;
static FILE *codes;

void host_sensor_open(const char *plant_path, const char *replay)
{
    if (plant_path) {
        struct sockaddr_un address = {.sun_family = AF_UNIX};
        if (strlen(plant_path) >= sizeof address.sun_path)
            host_fail("%s: too long for a socket", plant_path);
        memcpy(address.sun_path, plant_path, strlen(plant_path) + 1);
        plant = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
        if (plant < 0 || connect(plant, (const struct sockaddr *)&address, sizeof address) != 0)
            host_fail("%s: %s", plant_path, strerror(errno));
    }
    if (replay && !(codes = fopen(replay, "re")))
        host_fail("%s: %s", replay, strerror(errno));
}

static bool ask_plant(uint16_t drive_code, uint16_t *sensor_code)
{
    const uint8_t request[4] = {MAGIC & 0xFF, MAGIC >> 8, (uint8_t)drive_code, (uint8_t)(drive_code >> 8)};
    uint8_t answer[2];
    if (send(plant, request, sizeof request, MSG_NOSIGNAL) != (ssize_t)sizeof request ||
        recv(plant, answer, sizeof answer, MSG_WAITALL) != (ssize_t)sizeof answer)
        return false;
    *sensor_code = (uint16_t)(answer[0] | answer[1] << 8);
    return true;
}

bool host_sensor_next(uint16_t drive_code, uint16_t *sensor_code)
{
    unsigned code = MID_SCALE;
    if (plant >= 0 && !ask_plant(drive_code, sensor_code))
        return false;
    if (plant >= 0)
        return true;
    if (codes &&
        (fscanf(codes, "%u", &code) != 1 || code > CODE_MAX)) /* NOLINT(cert-err34-c): the count and range are */
        return false;
    *sensor_code = (uint16_t)code;
    return true;
}
