/* SPDX-License-Identifier: MIT */
/* Measured against predicted, sample by sample. */
#include "sampler.h"
#include "track.h"

enum { CONFIRM = 4 /* an alarm's cause must last this part of averaging_s, without an observer */, OFFSET_SHARE = 8 };
#define LARGEST_SQUARE   1.25F /* of an innovation, in alarm_ratio²: a push is no louder than this */
#define OBSERVED_CONFIRM 2.0F  /* averaging_s */

static void average_anew(struct sampler *s)
{
    s->averaged = s->above = s->lasted = 0;
    s->mean = s->variance = s->innovation_square = 0.0F;
    s->alarm = false;
}

void sampler_rest(struct sampler *s, const struct beam_image *image)
{
    beam_reset(&image->plan, &s->state);
    s->observed = (struct beam_observed){.offset = 0.0F};
    average_anew(s);
    s->offset = false;
    health_begin(&s->health, &image->front.setup);
}

/*
 * Exponential mean and variance of time constant averaging_s; the plain ones until that time has passed, so they start
 * without a bias.     d = r − m,  m ← m + a d,  v ← (1 − a)(v + a d²)
 */
static void average(struct sampler *s, const struct beam_image *image, float residual, float innovation)
{
    const struct beam_image_setup *setup = &image->front.setup;
    const float rms = image->front.observer.innovation_rms;
    const float dt_s = image->plan.x.dt_s, constant_s = setup->averaging_s, off = residual - s->mean;
    float share = dt_s / constant_s;
    if ((float)(s->averaged + 1) * dt_s < constant_s) {
        s->averaged++;
        share = 1.0F / (float)s->averaged;
    } else if (share > 1.0F) {
        share = 1.0F;
    }
    s->mean += share * off;
    s->variance = (1.0F - share) * (s->variance + share * off * off);
    if (!beam_image_observed(image))
        return;
    const float most = LARGEST_SQUARE * setup->alarm_ratio * setup->alarm_ratio,
                square = innovation * innovation / (rms * rms);
    s->innovation_square += share * ((square < most ? square : most) - s->innovation_square);
}

/* Nothing is judged before the mean spans its time constant. */
static bool spans(const struct sampler *s, const struct beam_image *image)
{
    return (float)(s->averaged + 1) * image->plan.x.dt_s >= image->front.setup.averaging_s;
}

/*
 * On when the mean is above its limit and not just the slow part of a motion: m² > v/8 holds for a step of any size from
 * 0.12 averaging_s on, before an alarm is confirmed; a sine of frequency f gives m²/v = 2/(2π f averaging_s)². What the
 * offset did to the variance on its way is forgotten.
 */
static void judge_offset(struct sampler *s, const struct beam_image_setup *setup)
{
    const float limit = setup->offset_ratio * setup->noise_rms, mean = beam_fabs(s->mean);
    const bool was = s->offset;
    if (mean > limit && (float)OFFSET_SHARE * mean * mean > s->variance)
        s->offset = true;
    else if (mean < 0.5F * limit)
        s->offset = false;
    if (s->offset != was)
        average_anew(s);
}

/*
 * Without an observer the ratio counts: on above alarm_ratio for a quarter of averaging_s, off below clear_ratio.
 * With one it is the innovation's, which is limited: a push keeps it up for a time about as long as averaging_s, a wrong model as long as it is
 * driven. On a quarter of the way above clear_ratio for twice averaging_s. What the observer can follow may still be a wrong model, close to the
 * right one: no push makes a residual that outlasts disturbance_s.
 */
static void judge_model(struct sampler *s, const struct beam_image *image, float ratio, float innovation_ratio)
{
    const struct beam_image_setup *setup = &image->front.setup;
    const bool observed = beam_image_observed(image);
    const float dt_s = image->plan.x.dt_s, step = setup->alarm_ratio - setup->clear_ratio;
    const float on = observed ? setup->clear_ratio + 0.25F * step : setup->alarm_ratio;
    const float confirm_s = setup->averaging_s * (observed ? OBSERVED_CONFIRM : 1.0F / (float)CONFIRM);
    if (ratio > setup->alarm_ratio || s->lasted > 0)
        s->lasted = ratio < setup->clear_ratio ? 0 : s->lasted + (s->lasted < UINT32_MAX);
    const bool lasts = observed && (float)s->lasted * dt_s >= image->front.observer.disturbance_s;
    s->above = innovation_ratio > on ? s->above + 1 : 0;
    if (lasts || (spans(s, image) && (float)s->above * dt_s >= confirm_s))
        s->alarm = true;
    else if (innovation_ratio < setup->clear_ratio)
        s->alarm = false;
}

/* The sensor before the model: with a sensor that is out of order there is nothing to compare, and it begins anew after it. */
static uint32_t judge(struct sampler *s, const struct beam_image *image, uint32_t sensor_faults, float ratio,
                      float innovation_ratio)
{
    bool disturbed = false;
    const bool was_faulty = s->sensor_fault;
    s->sensor_fault = sensor_faults != 0;
    if (s->sensor_fault) {
        s->alarm = false;
        s->above = s->lasted = 0;
    } else if (was_faulty) {
        average_anew(s);
    } else {
        if (spans(s, image))
            judge_offset(s, &image->front.setup);
        judge_model(s, image, ratio, innovation_ratio);
        disturbed = !s->alarm && beam_image_observed(image) && ratio > image->front.setup.alarm_ratio;
    }
    return sensor_faults | (s->offset ? BEAM_LIVE_OFFSET : 0u) | (s->alarm ? BEAM_LIVE_ALARM : 0u) |
           (disturbed ? BEAM_LIVE_DISTURBED : 0u);
}

void sampler_step(struct sampler *s, const struct beam_image *image, uint16_t sensor_code, uint16_t drive_code,
                  uint16_t sensor_code_max, struct beam_live *out)
{
    const struct beam_image_setup *setup = &image->front.setup;
    const int latency = image->plan.n.latency;
    const uint32_t newest = s->taken++ % SAMPLER_PAST;
    s->past[newest] = sensor_code;
    const uint16_t code = s->past[(newest - (uint32_t)latency) % SAMPLER_PAST]; /* same sample as y */

    const float input = beam_image_drive_value(setup, drive_code);
    const float u[BEAM_INPUTS] = {input};
    float y[BEAM_OUTPUTS] = {0.0F};
    *out = (struct beam_live){.sequence = s->sequence++, .step = s->state.k, .input = input};
    out->codes = (uint32_t)sensor_code | (uint32_t)drive_code << 16;
    out->measured = beam_image_sensor_value(setup, code);

    const enum beam_status status = beam_step(&image->plan, &s->state, u, y);
    const float residual = out->measured - y[0], innovation = beam_image_observe(image, &s->observed, residual);
    average(s, image, residual, innovation);
    if (status == BEAM_ERROR_STATE || !beam_finite(s->variance + innovation)) {
        sampler_rest(s, image);
        out->status |= BEAM_LIVE_RESET;
        out->residual = out->innovation = out->measured;
    } else {
        out->predicted = y[0];
        out->residual = residual;
        out->innovation = innovation;
        track_sample(image, &s->state, residual, !s->sensor_fault);
    }
    out->ratio = beam_sqrt(s->variance) / setup->noise_rms;
    out->innovation_ratio = beam_image_observed(image) ? beam_sqrt(s->innovation_square) : out->ratio;
    out->status |=
        judge(s, image, health_sample(&s->health, sensor_code, sensor_code_max), out->ratio, out->innovation_ratio);
    if (status == BEAM_ERROR_SOLVE || status == BEAM_ERROR_EFFECT_RANGE)
        out->status |= BEAM_LIVE_SOLVE;
    if (code == 0 || code >= sensor_code_max)
        out->status |= BEAM_LIVE_CLIPPED;
}
