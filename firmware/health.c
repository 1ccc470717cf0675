/* SPDX-License-Identifier: MIT */
/* Blocks of 64 codes, and the run of equal ones. */
#include "health.h"

enum { QUIET, STUCK, AT_END, FAULTS };
enum { OFF_MOST = 8191 /* 64 squares of it are below 2³²; a block that spans more is not quiet */ };

void health_begin(struct health *h, const struct beam_image_setup *setup)
{
    const float noise_codes = setup->noise_rms / beam_fabs(setup->sensor_V_per_code);
    const float limit = (float)HEALTH_BLOCK * setup->quiet_ratio * noise_codes, most = 65535.0F;
    h->quiet_limit = noise_codes >= 1.0F ? (uint32_t)(limit < most ? limit * limit : most * most) : 0;
    h->stuck_samples = setup->stuck_samples;
    h->run = 0;
    h->filled = 0;
}

static void judge_block(struct health *h)
{
    const int64_t sum = h->sum;
    if ((int64_t)HEALTH_BLOCK * h->square - sum * sum < (int64_t)h->quiet_limit) /* 64² times the variance */
        h->hold[QUIET] = HEALTH_HOLD;
    if (h->at_end >= HEALTH_END_LEAST)
        h->hold[AT_END] = HEALTH_HOLD;
    h->filled = 0;
}

static void add_to_block(struct health *h, uint16_t code, uint16_t code_max)
{
    if (h->filled == 0) {
        h->first = code;
        h->sum = 0;
        h->square = 0;
        h->at_end = 0;
    }
    int32_t off = (int32_t)code - (int32_t)h->first;
    off = off > OFF_MOST ? OFF_MOST : off < -OFF_MOST ? -OFF_MOST : off;
    h->sum += off;
    h->square += (uint32_t)(off * off);
    h->at_end = (uint8_t)(h->at_end + (code == 0 || code >= code_max));
    if (++h->filled == HEALTH_BLOCK)
        judge_block(h);
}

uint32_t health_sample(struct health *h, uint16_t code, uint16_t code_max)
{
    static const uint32_t bit[FAULTS] = {BEAM_LIVE_QUIET, BEAM_LIVE_STUCK, BEAM_LIVE_AT_END};
    uint32_t faults = 0;
    for (int f = 0; f < FAULTS; f++)
        h->hold[f] = (uint16_t)(h->hold[f] - (h->hold[f] > 0));
    add_to_block(h, code, code_max);
    h->run = h->run > 0 && code == h->last ? h->run + (h->run < h->stuck_samples) : 1;
    h->last = code;
    if (h->stuck_samples > 0 && h->run >= h->stuck_samples)
        h->hold[STUCK] = HEALTH_HOLD;
    for (int f = 0; f < FAULTS; f++)
        faults |= h->hold[f] > 0 ? bit[f] : 0;
    return faults;
}
