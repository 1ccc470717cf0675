/* SPDX-License-Identifier: MIT */
/* The chirp, made on the controller so that host and controller know it exactly. */
#include "drive.h"

bool drive_valid(const struct beam_drive *setting)
{
    return setting->amplitude >= 0.0F && setting->amplitude <= (float)DRIVE_AMPLITUDE_MAX;
}

void drive_start(struct drive *drive, const struct beam_drive *setting, uint16_t zero)
{
    *drive = (struct drive){.setting = *setting, .rate = setting->rate, .zero = zero};
    drive->amplitude = (int32_t)(setting->amplitude * 65536.0F);
}

static int32_t times(int32_t a, int32_t b)
{
    return (int32_t)((int64_t)a * b >> 31);
}

/* z (c0 + c1 z² + c2 z⁴ + c3 z⁶), z in quarter turns: interpolates sin(πz/2)/z at Chebyshev's four nodes of z² in 0..1. */
int32_t drive_sine(uint32_t phase)
{
    static const int32_t c[4] = {843314213, -346778731, 42681241, -2346440}; /* 2⁻²⁹ */
    uint32_t quarter = phase & 0x7FFFFFFFu; /* of half a turn: rises to 2³⁰, falls again */
    if (quarter > 0x40000000u)
        quarter = 0x80000000u - quarter;
    const int32_t z = quarter == 0x40000000u ? INT32_MAX : (int32_t)(quarter << 1); /* 2⁻³¹ of a quarter turn */
    const int32_t square = times(z, z);
    int32_t sum = c[3];
    for (int i = 2; i >= 0; i--)
        sum = times(sum, square) + c[i];
    int64_t sine = (int64_t)sum * z >> 29;
    if (sine > INT32_MAX)
        sine = INT32_MAX;
    return phase & 0x80000000u ? (int32_t)-sine : (int32_t)sine;
}

uint16_t drive_next(struct drive *drive)
{
    const struct beam_drive *setting = &drive->setting;
    int32_t off = 0;
    if (setting->period != 0 && drive->sample == setting->period) {
        drive->sample = drive->phase = 0;
        drive->rate = setting->rate;
    }
    if (setting->burst == 0 || drive->sample < setting->burst) /* rounded to the nearest code */
        off = (int32_t)(((int64_t)drive->amplitude * drive_sine(drive->phase) + (INT64_C(1) << 46)) >> 47);
    drive->phase += drive->rate;
    drive->rate += setting->sweep;
    if (setting->period != 0 || drive->sample != UINT32_MAX) /* a burst without a period happens once */
        drive->sample++;
    return (uint16_t)((int32_t)drive->zero + off);
}
