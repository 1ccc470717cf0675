/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * replay_live LIVE IMAGE — every sample that the emulator took out of a board's memory, computed here once more by the
 * same source (the firmware's sampler over lib/) from the codes alone. LIVE: struct beam_live after struct beam_live;
 * IMAGE: the image that ran. From the last time that the model was put to rest by a download or a drive on. All
 * members but the CRC must be equal bit for bit. Prints samples compared, samples equal and the drive's rms in codes.
 */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "sampler.h"

enum {
    CODE_MAX = 4095,
    OURS =
        BEAM_LIVE_ALARM | BEAM_LIVE_SOLVE | BEAM_LIVE_RESET | BEAM_LIVE_CLIPPED | BEAM_LIVE_SENSOR | BEAM_LIVE_DISTURBED
};

static struct beam_image image;
static struct sampler sampler;

static void *read_file(const char *path, size_t *n)
{
    FILE *file = fopen(path, "rb");
    long size = -1;
    if (file != NULL && fseek(file, 0, SEEK_END) == 0)
        size = ftell(file);
    void *bytes = size > 0 ? malloc((size_t)size) : NULL;
    if (bytes == NULL || fseek(file, 0, SEEK_SET) != 0 || fread(bytes, (size_t)size, 1, file) != 1) {
        fprintf(stderr, "replay_live: %s cannot be read\n", path);
        exit(3);
    }
    (void)fclose(file);
    *n = (size_t)size;
    return bytes;
}

static int equal(const struct beam_live *board, struct beam_live *here)
{
    here->status = (board->status & ~(uint32_t)OURS) | (here->status & OURS);
    return memcmp(board, here, offsetof(struct beam_live, crc32)) == 0;
}

int main(int argc, char **argv)
{
    size_t n_bytes = 0, n_live = 0, first = 0, same = 0;
    double squares = 0.0;
    if (argc != 3)
        return 2;
    const struct beam_live *live = read_file(argv[1], &n_live);
    const uint8_t *bytes = read_file(argv[2], &n_bytes);
    const size_t n = n_live / sizeof *live;
    if (n_bytes != BEAM_IMAGE_BYTES || !beam_image_write(&image, 0, BEAM_IMAGE_BYTES, bytes) ||
        beam_image_check(&image, 0.0F) != BEAM_IMAGE_FINE)
        return 3;
    for (size_t i = 0; i < n; i++)
        if (live[i].step == 0 && !(live[i].status & BEAM_LIVE_RESET))
            first = i;
    for (size_t i = first < SAMPLER_PAST ? 0 : first - SAMPLER_PAST; i < first; i++)
        sampler.past[live[i].sequence % SAMPLER_PAST] = (uint16_t)live[i].codes;
    sampler.sequence = n > 0 ? live[first].sequence : 0;
    sampler_rest(&sampler, &image);
    for (size_t i = first; i < n; i++) {
        struct beam_live here;
        const uint16_t drive = (uint16_t)(live[i].codes >> 16);
        sampler_step(&sampler, &image, (uint16_t)live[i].codes, drive, CODE_MAX, &here);
        if (equal(&live[i], &here))
            same++;
        else if (same == i - first)
            fprintf(stderr, "first difference at sequence %u: predicted %.9g there, %.9g here\n", live[i].sequence,
                    (double)live[i].predicted, (double)here.predicted);
        squares += (drive - 2048.0) * (drive - 2048.0);
    }
    printf("%zu %zu %.1f\n", n - first, same, sqrt(squares / (double)(n - first)));
    return same == n - first ? 0 : 1;
}
