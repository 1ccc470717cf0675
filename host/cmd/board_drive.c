/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "board_drive.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "ground/ground.h"

static const double turn = 4294967296.0; /* 2³² */
enum { MOST_CODES = 2047 };

enum bf_status chirp_read(const char *text, struct chirp *out, struct bf_error *err)
{
    static const char *const what[4] = {"--chirp: the first frequency", "--chirp: the last frequency",
                                        "--chirp: the time of the sweep", "--chirp: the amplitude"};
    double *const into[4] = {&out->from_Hz, &out->to_Hz, &out->sweep_s, &out->amplitude};
    for (int i = 0; i < 4; i++) {
        char part[64];
        const size_t n = strcspn(text, ":");
        if (n == 0 || n >= sizeof part || (text[n] == ':') != (i < 3))
            return bf_fail(err, BF_USAGE,
                           "--chirp is F0:F1:T:AMPL: from Hz, to Hz, seconds, amplitude in the input's unit; e.g. "
                           "5:200:8:2");
        (void)snprintf(part, sizeof part, "%.*s", (int)n, text);
        if (options_number(what[i], part, into[i], err) != BF_OK)
            return BF_USAGE;
        text += n + (i < 3);
    }
    if (out->from_Hz < 0.0 || out->to_Hz < 0.0 || !(out->sweep_s > 0.0) || out->amplitude < 0.0)
        return bf_fail(err, BF_USAGE,
                       "--chirp: frequencies and amplitude cannot be negative, and the sweep needs time");
    return BF_OK;
}

enum bf_status chirp_make(const struct chirp *chirp, double sample_Hz, const struct beam_image_setup *setup,
                          struct beam_drive *out, struct bf_error *err)
{
    const double sweep = round(chirp->sweep_s * sample_Hz),
                 codes = chirp->amplitude / fabs((double)setup->drive_V_per_code);
    const double every = chirp->every_s > 0.0 ? round(chirp->every_s * sample_Hz) : sweep;
    if (chirp->from_Hz > 0.5 * sample_Hz || chirp->to_Hz > 0.5 * sample_Hz)
        return bf_fail(err, BF_USAGE, "--chirp: the board samples at %.6g Hz; give frequencies up to half of that",
                       sample_Hz);
    if (!(codes <= MOST_CODES))
        return bf_fail(err, BF_USAGE, "--chirp: amplitude %.4g is more than the board's D/A gives; give at most %.4g",
                       chirp->amplitude, MOST_CODES * fabs((double)setup->drive_V_per_code));
    if (sweep < 2.0 || sweep > 4e9 || every > 4e9 || every < sweep)
        return bf_fail(err, BF_USAGE,
                       "--chirp: a sweep takes from 2 samples to 4e9, and --every must not be shorter than it");
    out->amplitude = (float)codes;
    out->rate = (uint32_t)fmin(round(chirp->from_Hz / sample_Hz * turn), turn - 1.0);
    out->sweep = (uint32_t)(int64_t)round((chirp->to_Hz - chirp->from_Hz) / sample_Hz / sweep * turn);
    out->period = chirp->every_s < 0.0 ? 0 : (uint32_t)every;
    out->burst = chirp->every_s != 0.0 ? (uint32_t)sweep : 0;
    out->flags = out->generation = 0;
    return BF_OK;
}

double chirp_start_Hz(const struct beam_drive *drive, double sample_Hz)
{
    return (double)drive->rate / turn * sample_Hz;
}

double chirp_end_Hz(const struct beam_drive *drive, double sample_Hz)
{
    const uint32_t samples = drive->burst > 0 ? drive->burst : drive->period;
    return ((double)drive->rate + (double)(int32_t)drive->sweep * (double)samples) / turn * sample_Hz;
}
