/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * survival_steps IMAGE COUNT: steps an image under a drive that repeats every second, and prints the largest difference
 * of the last period from an early one, over the rms of the early one.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "beam_image_file.h"

enum { PERIOD = 1000, SETTLED = 60 * PERIOD };

/* A chirp, then rest. */
static float drive_at(long k)
{
    const double s = (double)(k % PERIOD) / PERIOD;
    return s < 0.6 ? (float)(10.0 * sin(6.283185307179586 * (4.0 * s + 150.0 * s * s))) : 0.0F;
}

static struct beam_image_run *load(const char *path)
{
    static struct beam_image_file file;
    FILE *stream = fopen(path, "rb");
    struct beam_image_run *run = calloc(1, beam_image_run_bytes());
    if (!stream || !run || fread(&file, sizeof file, 1, stream) != 1) {
        fprintf(stderr, "%s: no image\n", path);
        exit(3);
    }
    fclose(stream);
    beam_image_run_load(run, &file);
    if (beam_image_run_check(run, NULL, 0.0F) != BEAM_IMAGE_FINE) {
        fprintf(stderr, "%s: refused\n", path);
        exit(3);
    }
    return run;
}

int main(int argc, char **argv)
{
    static float drive[PERIOD], early[PERIOD];
    const long count = argc == 3 ? strtol(argv[2], NULL, 10) / PERIOD * PERIOD : 0;
    if (count < SETTLED + PERIOD)
        return fputs("usage: survival_steps IMAGE COUNT, more than 61000\n", stderr), 2;
    struct beam_image_run *run = load(argv[1]);
    double square = 0.0, largest = 0.0;
    for (long k = 0; k < PERIOD; k++)
        drive[k] = drive_at(k);
    beam_image_run_rest(run);
    for (long k = 0; k < count; k++) {
        float y;
        if (beam_image_run_step(run, drive[k % PERIOD], &y) != BEAM_OK)
            return fprintf(stderr, "step %ld failed\n", k), 1;
        if (k >= SETTLED - PERIOD && k < SETTLED) {
            early[k % PERIOD] = y;
            square += (double)y * (double)y;
        }
        if (k >= count - PERIOD)
            largest = fmax(largest, fabs((double)y - (double)early[k % PERIOD]));
    }
    printf("%g of the rms after %ld steps\n", largest / sqrt(square / PERIOD), count);
    free(run);
    return 0;
}
