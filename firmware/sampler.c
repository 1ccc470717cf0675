/* SPDX-License-Identifier: MIT */
/* Measured against predicted, sample by sample. */
#include "sampler.h"

void sampler_rest(struct sampler *s, const struct beam_image *image)
{
    beam_reset(&image->plan, &s->state);
    s->averaged = 0;
    s->mean_square = 0.0F;
    s->alarm = false;
}

/* Exponential mean of time constant averaging_s; the plain mean until that time has passed, so it starts without a bias. */
static void average(struct sampler *s, const struct beam_image *image, float square)
{
    const float dt_s = image->plan.x.dt_s, constant_s = image->front.setup.averaging_s;
    float share = dt_s / constant_s;
    if ((float)(s->averaged + 1) * dt_s < constant_s) {
        s->averaged++;
        share = 1.0F / (float)s->averaged;
    } else if (share > 1.0F) {
        share = 1.0F;
    }
    s->mean_square += share * (square - s->mean_square);
}

/* On above alarm_ratio, off below clear_ratio; not judged before the mean spans its time constant. */
static void judge(struct sampler *s, const struct beam_image *image, float ratio)
{
    const struct beam_image_setup *setup = &image->front.setup;
    const bool spans = (float)(s->averaged + 1) * image->plan.x.dt_s >= setup->averaging_s;
    if (spans && ratio > setup->alarm_ratio)
        s->alarm = true;
    else if (ratio < setup->clear_ratio)
        s->alarm = false;
}

void sampler_step(struct sampler *s, const struct beam_image *image, uint16_t sensor_code, uint16_t drive_code,
                  uint16_t sensor_code_max, struct beam_live *out)
{
    const struct beam_image_setup *setup = &image->front.setup;
    const uint32_t newest = s->sequence % SAMPLER_PAST;
    s->past[newest] = sensor_code;
    const uint16_t code = s->past[(newest - (uint32_t)image->plan.n.latency) % SAMPLER_PAST]; /* same sample as y */

    const float input = beam_image_drive_value(setup, drive_code);
    const float u[BEAM_INPUTS] = {input};
    float y[BEAM_OUTPUTS] = {0.0F};
    *out = (struct beam_live){.sequence = s->sequence++, .step = s->state.k, .input = input};
    out->codes = (uint32_t)sensor_code | (uint32_t)drive_code << 16;
    out->measured = beam_image_sensor_value(setup, code);

    const enum beam_status status = beam_step(&image->plan, &s->state, u, y);
    const float residual = out->measured - y[0];
    average(s, image, residual * residual);
    if (status == BEAM_ERROR_STATE || !beam_finite(s->mean_square)) {
        sampler_rest(s, image);
        out->status |= BEAM_LIVE_RESET;
        out->residual = out->measured;
    } else {
        out->predicted = y[0];
        out->residual = residual;
    }
    out->ratio = beam_sqrt(s->mean_square) / setup->noise_rms;
    judge(s, image, out->ratio);
    if (status == BEAM_ERROR_SOLVE || status == BEAM_ERROR_EFFECT_RANGE)
        out->status |= BEAM_LIVE_SOLVE;
    if (code == 0 || code >= sensor_code_max)
        out->status |= BEAM_LIVE_CLIPPED;
    if (s->alarm)
        out->status |= BEAM_LIVE_ALARM;
}
