/* SPDX-License-Identifier: MIT */
/* What a setup and a plan's numbers may be, for whoever makes an image and whoever is given one, signed or not. */
#include <stddef.h>
#include <string.h>
#include "beam_image.h"

#define AT(member) offsetof(struct beam_image_setup, member)

const struct beam_image_limit beam_image_limits[BEAM_IMAGE_LIMITS] = {
    {BEAM_TEXT("the sensor's per_code"), AT(sensor_V_per_code), true, 1e-15F, 1e9F},
    {BEAM_TEXT("the sensor's zero_code"), AT(sensor_zero_code), false, -65535.0F, 65535.0F},
    {BEAM_TEXT("the drive's per_code"), AT(drive_V_per_code), true, 1e-15F, 1e9F},
    {BEAM_TEXT("the drive's zero_code"), AT(drive_zero_code), false, -65535.0F, 65535.0F},
    {BEAM_TEXT("noise_rms"), AT(noise_rms), false, 1e-15F, 1e12F},
    {BEAM_TEXT("alarm_ratio"), AT(alarm_ratio), false, 1e-3F, 1e6F},
    {BEAM_TEXT("clear_ratio"), AT(clear_ratio), false, 1e-3F, 1e6F},
    {BEAM_TEXT("averaging_s"), AT(averaging_s), false, 1e-4F, 1e5F},
    {BEAM_TEXT("the clock's error"), AT(clock_relative), false, -0.5F, 0.5F},
    {BEAM_TEXT("the proof's amplitude"), AT(proof_amplitude), true, 0.0F, 1e14F},
    {BEAM_TEXT("an output of the proof run"), AT(proof[0]), true, 0.0F, BEAM_IMAGE_LARGEST},
    {BEAM_TEXT("an output of the proof run"), AT(proof[1]), true, 0.0F, BEAM_IMAGE_LARGEST},
    {BEAM_TEXT("an output of the proof run"), AT(proof[2]), true, 0.0F, BEAM_IMAGE_LARGEST},
    {BEAM_TEXT("an output of the proof run"), AT(proof[3]), true, 0.0F, BEAM_IMAGE_LARGEST},
    {BEAM_TEXT("quiet_ratio"), AT(quiet_ratio), false, 0.0F, 1.0F},
    {BEAM_TEXT("offset_ratio"), AT(offset_ratio), false, 1e-3F, 1e6F},
};

float beam_image_setup_value(const struct beam_image_setup *setup, int limit)
{
    float x;
    memcpy(&x, (const uint8_t *)setup + beam_image_limits[limit].offset, sizeof x);
    return x;
}

/* By its bits, so that it holds in an arithmetic that flushes what is denormal. */
bool beam_image_number(float x)
{
    const float largest = BEAM_IMAGE_LARGEST;
    uint32_t word, most;
    memcpy(&word, &x, sizeof word);
    memcpy(&most, &largest, sizeof most);
    word &= 0x7FFFFFFFu;
    return word == 0 || (word >= 0x00800000u && word <= most);
}

int beam_image_setup_outside(const struct beam_image_setup *setup)
{
    for (int i = 0; i < BEAM_IMAGE_LIMITS; i++) {
        const struct beam_image_limit *limit = &beam_image_limits[i];
        const float x = beam_image_setup_value(setup, i), size = limit->of_size && x < 0.0F ? -x : x;
        if (!beam_image_number(x) || !(size >= limit->least && size <= limit->most))
            return i;
    }
    return -1;
}
