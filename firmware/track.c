/* SPDX-License-Identifier: MIT */
/* Modes that move: a recursive prediction-error method for each, on the residual of the running model. */
#include "track.h"
#include <stddef.h>

enum { FREQUENCY, DAMPING, GAIN, PARAMETERS };
/*
 * Units of θ: each is 0 ± 1 at the start, so a unit is how far a beam is believed to be from its model before anything was heard. A tenth of
 * the frequency is what a fifth more mass, spread over the beam, does (1/√1.2). That a gain moves by 0.3 is assumed; it sets how
 * fast a gain is followed, and limits are ten times as far.
 */
#define FREQUENCY_UNIT 0.1F /* of the pole's distance from 1, by which the frequency moves */
#define GAIN_UNIT      0.3F
/* As Huber cuts, in rms of the innovations: of white noise 0.3 % is beyond it, and their mean square is 0.5 % less for it. */
#define CUT 3.0F
/*
 * Of θ: a standard error of 3e-4 units, 3e-5 of the frequency, a two-hundredth of the smallest that the demonstration's beam shows (docs/target.md).
 * Below it what the covariance's update subtracts from a start of 1 is the rounding of float, 6e-8, and the difference may be negative.
 */
#define LEAST_VARIANCE 1e-7F
#define CORRELATED     5.0F /* innovations of a mode that has moved are not white: so many count as one */
static const float least[PARAMETERS] = {-3.0F, -0.9F, -3.0F}, most[PARAMETERS] = {3.0F, 9.0F, 10.0F};
static const uint8_t row[PARAMETERS][PARAMETERS] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}; /* place in the covariance */

struct complex_number {
    float re, im;
};

static inline __attribute__((always_inline)) struct complex_number times(struct complex_number a,
                                                                         struct complex_number b)
{
    return (struct complex_number){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

static inline __attribute__((always_inline)) struct complex_number plus(struct complex_number a,
                                                                        struct complex_number b)
{
    return (struct complex_number){a.re + b.re, a.im + b.im};
}

static inline __attribute__((always_inline)) struct complex_number scaled(float s, struct complex_number a)
{
    return (struct complex_number){s * a.re, s * a.im};
}

/* ---- The block as one complex number: the first coordinate is its real part ---- */

struct mode_model {
    struct complex_number pole, heard;
    float half, inverse; /* ψ₀₀'s mean with ψ₁₁; 1/Im λ₀ */
    const float *psi;
    float frequency_unit, damping_unit, kappa;
};

static struct mode_model model_of(const struct beam_image *image, int block, int which)
{
    const float *psi = image->plan.x.phi[block], *heard = image->front.tracking.heard[which];
    const float half = 0.5F * (psi[0] + psi[3]);
    const float im = beam_sqrt(psi[0] * psi[3] - psi[1] * psi[2] - half * half);
    struct mode_model m = {.pole = {1.0F + half, im}, .heard = {heard[0], heard[1]}, .half = half, .psi = psi};
    m.inverse = 1.0F / im;
    m.frequency_unit = FREQUENCY_UNIT * beam_sqrt(half * half + im * im);
    m.damping_unit = -half - 0.5F * (half * half + im * im); /* (1 − |λ₀|²)/2 */
    m.kappa = image->front.tracking.kappa;
    return m;
}

static struct complex_number amplitude(const struct mode_model *m, const float x[2])
{
    const struct complex_number own = {x[0], ((m->half - m->psi[0]) * x[0] - m->psi[1] * x[1]) * m->inverse};
    return times(m->heard, own);
}

/* 1/(1 − c/2) */
static struct complex_number inverse_of(struct complex_number c)
{
    const float re = 1.0F - 0.5F * c.re, im = -0.5F * c.im, size = 1.0F / (re * re + im * im);
    return (struct complex_number){re * size, -im * size};
}

static struct complex_number change_of(const struct mode_model *m, const float theta[PARAMETERS])
{
    return (struct complex_number){-m->damping_unit * theta[DAMPING], m->frequency_unit * theta[FREQUENCY]};
}

/* ---- A sample ---- */

/* θ ← θ + L ν,  L = P ψ/(s + ψᵀPψ),  P ← P − L ψᵀP, s the innovations' variance. */
static void learn(struct track_mode *t, float innovation, float size)
{
    float towards[PARAMETERS];
#pragma GCC unroll 3
    for (int i = 0; i < PARAMETERS; i++) {
        towards[i] = 0.0F;
#pragma GCC unroll 3
        for (int j = 0; j < PARAMETERS; j++)
            towards[i] += t->covariance[row[i][j]] * t->slope[j][0];
    }
#pragma GCC unroll 3
    for (int i = 0; i < PARAMETERS; i++)
        size += towards[i] * t->slope[i][0];
    const float share = 1.0F / size, off = share * innovation;
#pragma GCC unroll 3
    for (int i = 0; i < PARAMETERS; i++) {
        const float theta = t->theta[i] + towards[i] * off;
        t->theta[i] = theta < least[i] ? least[i] : theta > most[i] ? most[i] : theta;
#pragma GCC unroll 3
        for (int j = i; j < PARAMETERS; j++)
            t->covariance[row[i][j]] -= share * towards[i] * towards[j];
    }
}

/* Below the noise there is nothing to learn of a mode but what the noise itself makes of it. */
static bool moves(const struct mode_model *m, const struct track_mode *t, const float x[2], float noise)
{
    const struct complex_number motion = plus(amplitude(m, x), (struct complex_number){t->e[0], t->e[1]});
    return motion.re * motion.re + motion.im * motion.im > noise * noise;
}

static void wander(struct track_mode *t, float variance)
{
#pragma GCC unroll 3
    for (int i = 0; i < PARAMETERS; i++) {
        float *p = &t->covariance[row[i][i]], more = *p + variance;
        more = more > 1.0F && *p <= 1.0F ? 1.0F : more;
        *p = more < LEAST_VARIANCE ? LEAST_VARIANCE : more;
    }
}

/* e and its slopes to the next sample. */
static void turn(struct track_mode *t, const struct mode_model *m, const float x[2], const float gamma[2], float u,
                 float correction)
{
    const struct complex_number c = change_of(m, t->theta), inverse = inverse_of(c), e = {t->e[0], t->e[1]};
    const struct complex_number z = amplitude(m, x), b = scaled(u, amplitude(m, gamma)), bent = times(b, inverse);
    const struct complex_number more = times(times(m->pole, c), inverse), pole = plus(m->pole, more);
    const float gain = 1.0F + GAIN_UNIT * t->theta[GAIN];
    const struct complex_number by_c = plus(times(times(m->pole, times(inverse, inverse)), plus(e, z)),
                                            scaled(0.5F * gain, times(bent, inverse))); /* of what drives e */
    const struct complex_number drives[PARAMETERS] = {{-m->frequency_unit * by_c.im, m->frequency_unit * by_c.re},
                                                      scaled(-m->damping_unit, by_c),
                                                      scaled(GAIN_UNIT, bent)};
    const struct complex_number next =
        plus(plus(times(pole, e), times(more, z)), plus(scaled(gain, bent), scaled(-1.0F, b)));
    t->e[0] = next.re + m->kappa * correction;
    t->e[1] = next.im;
#pragma GCC unroll 3
    for (int i = 0; i < PARAMETERS; i++) {
        const struct complex_number slope = {t->slope[i][0], t->slope[i][1]};
        const struct complex_number turned = plus(times(pole, slope), drives[i]);
        t->slope[i][0] = turned.re - m->kappa * slope.re;
        t->slope[i][1] = turned.im;
    }
}

static void begin(struct track *track, float variance)
{
    *track = (struct track){.square = variance};
    for (int i = 0; i < BEAM_TRACKED; i++)
#pragma GCC unroll 3
        for (int j = 0; j < PARAMETERS; j++)
            track->mode[i].covariance[row[j][j]] = 1.0F;
}

struct track *track_of(const struct beam_image *image, struct beam_state *state)
{
    return image->front.tracking.blocks == 0 ? NULL : (struct track *)&state->history[BEAM_HISTORY - BEAM_TRACK_WORDS];
}

/*
 * Is this innovation one to learn from? One above three times the running rms is a push, or a model that has just become wrong; the
 * latter raises the rms. That begins with the noise and is never below it.
 */
static bool is_usual(const struct beam_image *image, struct track *track, float innovation)
{
    const float noise = image->front.setup.noise_rms, rate = image->plan.x.dt_s / image->front.setup.averaging_s;
    const float most_square = CUT * CUT * track->square, square = innovation * innovation;
    const float cut = square > most_square ? most_square : square;
    track->square += (rate < 1.0F ? rate : 1.0F) * (cut - track->square);
    if (track->square < noise * noise)
        track->square = noise * noise;
    return square <= most_square;
}

void track_sample(const struct beam_image *image, struct beam_state *state, float residual, bool hears)
{
    const struct beam_image_tracking *setup = &image->front.tracking;
    struct track *track = track_of(image, state);
    const float u = state->u_last[0], dt_s = image->plan.x.dt_s; /* acts from now to the next step */
    float innovation = residual, sum = 0.0F;
    if (track == NULL)
        return;
    if (track->samples < 1.0F)
        begin(track, image->front.setup.noise_rms * image->front.setup.noise_rms);
    innovation -= track->offset;
    for (int i = 0; i < BEAM_TRACKED; i++)
        innovation -= track->mode[i].e[0];
    const bool learns = hears && is_usual(image, track, innovation);
    const float correction = hears ? innovation : 0.0F;
    int n = 0, block = 0;
    for (uint32_t blocks = setup->blocks; blocks != 0 && n < BEAM_TRACKED; blocks >>= 1, block++) {
        if ((blocks & 1u) == 0)
            continue;
        struct track_mode *t = &track->mode[n];
        const struct mode_model m = model_of(image, block, n++);
        if (learns && moves(&m, t, &state->x[2 * block], image->front.setup.noise_rms))
            learn(t, innovation, CORRELATED * track->square);
        wander(t, dt_s / setup->wander_s);
        turn(t, &m, &state->x[2 * block], &image->plan.x.gamma[0][2 * block], u, correction);
        sum += t->e[0] + t->slope[0][0] + t->theta[0] + t->theta[1] + t->theta[2] + t->covariance[0];
    }
    track->offset += 0.5F * image->front.observer.gain_offset * correction;
    if (track->samples < 16777216.0F)
        track->samples += 1.0F;
    if (!beam_finite(sum + track->square + track->offset))
        track->samples = 0.0F;
}

/* ---- In physical units ---- */

/* Angle of a number in the upper half plane; each turn of the loop cubes the error. */
static float angle_of(struct complex_number z)
{
    const float size = beam_sqrt(z.re * z.re + z.im * z.im);
    float angle = 1.57079633F * (1.0F - z.re / size);
    for (int i = 0; i < 5; i++)
        angle += (z.im * beam_cos(angle) - z.re * beam_sin(angle)) / size;
    return angle;
}

static void report_mode(const struct mode_model *m, const struct track_mode *t, float dt_s, struct beam_tracked *out)
{
    const struct complex_number c = change_of(m, t->theta), inverse = inverse_of(c);
    const struct complex_number pole = plus(m->pole, times(times(m->pole, c), inverse));
    const float angle = angle_of(pole), decay = -0.5F * beam_log(pole.re * pole.re + pole.im * pole.im);
    const float turn = beam_sqrt(angle * angle + decay * decay), per_Hz = 6.28318531F * dt_s;
    out->frequency_Hz = turn / per_Hz;
    out->frequency_se_Hz = m->frequency_unit * beam_sqrt(t->covariance[0]) / per_Hz;
    out->damping = decay / turn;
    out->damping_se = m->damping_unit * beam_sqrt(t->covariance[3]) / turn;
    out->gain = 1.0F + GAIN_UNIT * t->theta[GAIN];
    out->gain_se = GAIN_UNIT * beam_sqrt(t->covariance[5]);
}

void track_report(const struct beam_image *image, const struct track *track, struct beam_tracking *out)
{
    static const struct track_mode fresh = {.covariance = {1.0F, 0.0F, 0.0F, 1.0F, 0.0F, 1.0F}};
    int n = 0, block = 0;
    *out = (struct beam_tracking){.modes = 0};
    if (track == NULL)
        return;
    const bool begun = track->samples >= 1.0F;
    out->samples = begun ? (uint32_t)track->samples : 0;
    out->innovation_rms = begun ? beam_sqrt(track->square) : image->front.setup.noise_rms;
    for (uint32_t blocks = image->front.tracking.blocks; blocks != 0 && n < BEAM_TRACKED; blocks >>= 1, block++)
        if ((blocks & 1u) != 0) {
            const struct mode_model m = model_of(image, block, n);
            report_mode(&m, begun ? &track->mode[n] : &fresh, image->plan.x.dt_s, &out->mode[n]);
            n++;
        }
    out->modes = (uint32_t)n;
}
