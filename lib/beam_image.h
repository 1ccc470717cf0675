/* SPDX-License-Identifier: MIT */
/*
 * beam_image.h — a target image: what travels from a fitted model to a controller, and what the controller keeps.
 *
 *     header 64 B | setup | observer | uses | counts | numbers | HMAC-SHA256 32 B            everything little-endian
 *
 * The bytes are the members of struct beam_image_front, then of beam_plan_counts, then of beam_plan_numbers in the
 * controller's sizes (BEAM_TARGET), then the code. So a page of the controller holds an image without decoding it:
 * the plan a step runs on is the memory the image was written to. Only an effect's name is resolved, beside it.
 * Host and controller compile this file alike; the sizes below do not depend on the build and are asserted against it.
 */
#ifndef BEAM_IMAGE_H
#define BEAM_IMAGE_H

#include <stdbool.h>
#include <stdint.h>
#include "beam.h"
#include "beam_language.h"

BEAM_C_BEGIN

enum {
    BEAM_IMAGE_MAGIC = 0x494D4642, /* "BFMI" in the order of the bytes */
    BEAM_IMAGE_LAYOUT = 4,         /* raised with every change of the bytes' meaning */
    BEAM_IMAGE_DEVICE_BYTES = 12,
    BEAM_IMAGE_CODE_BYTES = 32, /* HMAC-SHA256 */
    BEAM_IMAGE_KEY_BYTES = 32,
    BEAM_IMAGE_PROOFS = 4,    /* outputs of the proof run that must come out bit for bit */
    BEAM_IMAGE_COUNTS = 62,   /* of two bytes */
    BEAM_IMAGE_NUMBERS = 1114 /* of four */
};

struct beam_image_header {
    uint32_t magic, layout;
    uint32_t length;                         /* bytes of the whole image, code included */
    uint32_t counter;                        /* a controller takes only a greater one than it has stored */
    uint8_t device[BEAM_IMAGE_DEVICE_BYTES]; /* identity of the one controller this image is for */
    uint8_t model_sha256[32];                /* of the model file it was made from */
    uint32_t crc32;                          /* of everything between header and code; zlib's polynomial */
};

/* What the controller knows of its channels and of the model's worth. f32: IEEE 754 single. */
struct beam_image_setup {
    float sensor_V_per_code, sensor_zero_code; /* measured [output's unit] = (code − zero) × per_code */
    float drive_V_per_code, drive_zero_code;   /* input [input's unit] = (code − zero) × per_code */
    float noise_rms;                           /* expected residual, output's unit, > 0 */
    float alarm_ratio,
        clear_ratio;       /* residual rms about its mean ÷ noise_rms: alarm on above, off below; clear < alarm */
    float averaging_s;     /* time constant of the residual's running mean and variance, > 0 */
    float clock_relative;  /* the model's clock_error: plan's dt_s = (1 + this) × nominal interval */
    uint32_t proof_steps;  /* 1..1024: see beam_image_prove() */
    float proof_amplitude; /* of the proof run's input, input's unit */
    float proof[BEAM_IMAGE_PROOFS]; /* outputs of its last four steps */
    float quiet_ratio;              /* 0..1: the sensor is too quiet below this share of noise_rms; see beam_wire.h */
    float offset_ratio;             /* > 0: a mean residual above so many noise_rms is an offset of the sensor */
    uint32_t stuck_samples; /* equal codes in a row that noise does not give: 16..65535; 0: it may give any number */
};

/*
 * What tells a wrong model from an unknown push. The residual of a right model is free motion that nobody drove, an offset
 * and noise: each observed block of the plan turns on by itself, ε ← ε + ψ ε, the offset stays, and the sensor hears the
 * first coordinate of each. With the steady gain of a Kalman filter, K, what remains is the innovation:
 *     ν = r − Σ ε₀ − d,    ε ← ε + ψ ε + K ν,    d ← d + K_d ν
 */
enum { BEAM_OBSERVED = 8 /* blocks at most */ };
struct beam_image_observer {
    uint32_t blocks;      /* bit b: block b of the plan is observed; 0, and gain_offset 0: there is no observer */
    float innovation_rms; /* of a right model, output's unit, > 0 */
    float disturbance_s;  /* a push as large as the sensor shows is below the noise after this time; > 0 */
    float proof;          /* innovation of the proof run's last step, the model's output taken for a residual */
    float gain_offset;    /* 0..1 */
    float gain[BEAM_OBSERVED][2]; /* of each observed block in order; the rest 0 */
};

/*
 * On request, modes that the board follows beside the model: firmware/track.h. Each a complex amplitude ζ with ζ₀ the first coordinate of
 * its block, of which the sensor, its filters included, hears Re(heard ζ).
 */
enum {
    BEAM_TRACKED = 3 /* modes at most */,
    BEAM_TRACK_WORDS = 54 /* of the state's history that the plan must leave */
};
struct beam_image_tracking {
    uint32_t blocks; /* bit b: block b of the plan is followed, an observed one; 0: none is, and the rest is 0 */
    float wander_s;  /* time in which a parameter may change as much as it may be wrong at first; > 0 */
    float kappa;     /* of an innovation, what corrects a mode's motion; 0..1 */
    float heard[BEAM_TRACKED][2]; /* of each followed block in order, real and imaginary part */
};

/* Codes to values: the one expression that controller and replay share, since they must agree bit for bit. */
static inline float beam_image_sensor_value(const struct beam_image_setup *setup, uint32_t code)
{
    return ((float)code - setup->sensor_zero_code) * setup->sensor_V_per_code;
}
static inline float beam_image_drive_value(const struct beam_image_setup *setup, uint32_t code)
{
    return ((float)code - setup->drive_zero_code) * setup->drive_V_per_code;
}

struct beam_image_use {
    uint32_t effect;   /* CRC-32 of the effect's id, without a terminator: beam_image_effect_key() */
    uint32_t channels; /* as beam_use.channels */
    float p[BEAM_EFFECT_PARAMETERS];
};

struct beam_image_front {
    struct beam_image_header header;
    struct beam_image_setup setup;
    struct beam_image_observer observer;
    struct beam_image_tracking tracking;
    struct beam_image_use use[BEAM_USES];
};

enum {
    BEAM_IMAGE_FRONT_BYTES = sizeof(struct beam_image_front),
    BEAM_IMAGE_PLAN_BYTES = 2 * BEAM_IMAGE_COUNTS + 4 * BEAM_IMAGE_NUMBERS,
    BEAM_IMAGE_BYTES = BEAM_IMAGE_FRONT_BYTES + BEAM_IMAGE_PLAN_BYTES + BEAM_IMAGE_CODE_BYTES
};
BEAM_ASSERT(sizeof(struct beam_image_header) == 64, "header");
BEAM_ASSERT(sizeof(struct beam_image_setup) == 72, "setup");
BEAM_ASSERT(sizeof(struct beam_image_observer) == 84, "observer");
BEAM_ASSERT(sizeof(struct beam_image_tracking) == 36, "tracking");
BEAM_ASSERT(sizeof(struct beam_image_use) == 24, "use");
BEAM_ASSERT(sizeof(struct beam_image_front) == 448, "front");

/* Why an image is refused, in the order of the checks (the bound is looked at before the proof run); the controller reports the number. */
enum beam_image_fault {
    BEAM_IMAGE_FINE = 0,
    BEAM_IMAGE_BAD_MAGIC,
    BEAM_IMAGE_BAD_LAYOUT,
    BEAM_IMAGE_BAD_LENGTH,
    BEAM_IMAGE_BAD_CRC,
    BEAM_IMAGE_FOREIGN_DEVICE,
    BEAM_IMAGE_OLD_COUNTER,
    BEAM_IMAGE_BAD_CODE,       /* HMAC: not signed with this controller's key, or changed afterwards */
    BEAM_IMAGE_BAD_SETUP,      /* a scale, noise, ratio or gain not finite or out of range */
    BEAM_IMAGE_UNKNOWN_EFFECT, /* not in this firmware */
    BEAM_IMAGE_BAD_PLAN,       /* counts out of range, a number not finite, or a block that grows */
    BEAM_IMAGE_BAD_RATE,       /* dt_s is not the controller's sample interval */
    BEAM_IMAGE_BAD_PROOF,      /* the proof run came out otherwise here than where the image was made */
    BEAM_IMAGE_TOO_SLOW,       /* the step's bound, or a step of the proof run, does not fit the sample interval */
    BEAM_IMAGE_BAD_ARITHMETIC /* this processor rounds otherwise, or flushes denormal numbers: nothing could be proved */
};

/*
 * Limits, the same for who makes an image and who is given one. Every number of an image is 0 or of a size from 1.2e-38
 * (the least that is not denormal) to 1e18, so no product of two overflows; the setup's have limits of their own.
 */
#define BEAM_IMAGE_LARGEST 1e18F
enum { BEAM_IMAGE_LIMITS = 16 };
struct beam_image_limit {
    const char *name; /* for a person; NULL on a controller */
    uint16_t offset;  /* into struct beam_image_setup */
    bool of_size;     /* least and most are of |x| */
    float least, most;
};
#define beam_image_limits        BEAM_NAME(image_limits)
#define beam_image_setup_value   BEAM_NAME(image_setup_value)
#define beam_image_setup_outside BEAM_NAME(image_setup_outside)
#define beam_image_number        BEAM_NAME(image_number)
extern const struct beam_image_limit beam_image_limits[BEAM_IMAGE_LIMITS];
float beam_image_setup_value(const struct beam_image_setup *setup, int limit);
int beam_image_setup_outside(const struct beam_image_setup *setup); /* index of the first limit that is broken, or −1 */
bool beam_image_number(float x);                                    /* 0, or of a size from 1.2e-38 to 1e18 */

/*
 * Does single precision compute here as IEEE 754 says, rounded to nearest, denormal numbers kept? A program that was
 * linked with -ffast-math, or a start-up that left FPSCR.FZ set, says no: it would differ from others in its last bits,
 * first where a motion has died away.
 */
#define beam_arithmetic_is_exact BEAM_NAME(arithmetic_is_exact)
bool beam_arithmetic_is_exact(void);

/*
 * Instructions that a step may take, by its bound, on a controller of this clock and rate: three quarters of the interval at
 * one and a half cycles an instruction, less what the rest of the sample interrupt takes. core_Hz 0: any number.
 */
enum {
    BEAM_IMAGE_INTERRUPT =
        1700 /* instructions of the sample interrupt beside the step, observer and streaming included */
};
static inline uint32_t beam_image_budget(uint32_t core_Hz, uint32_t sample_mHz)
{
    const uint64_t half = (uint64_t)core_Hz * 1000u / (2u * (uint64_t)(sample_mHz > 0 ? sample_mHz : 1u));
    if (core_Hz == 0)
        return UINT32_MAX;
    return half < BEAM_IMAGE_INTERRUPT ? 0 : (uint32_t)(half - BEAM_IMAGE_INTERRUPT);
}

/* What following modes adds to the bound of a step. */
enum { BEAM_IMAGE_TRACK_FIXED = 480, BEAM_IMAGE_TRACK_MODE = 400 };
static inline uint32_t beam_image_tracking_bound(uint32_t blocks)
{
    uint32_t n = 0;
    for (; blocks != 0; blocks &= blocks - 1)
        n++;
    return n == 0 ? 0 : BEAM_IMAGE_TRACK_FIXED + n * BEAM_IMAGE_TRACK_MODE;
}

/* One English clause with the remedy; never NULL. */
#define beam_image_fault_text BEAM_NAME(image_fault_text)
const char *beam_image_fault_text(enum beam_image_fault fault);

/* CRC-32 of zlib and Ethernet; crc = 0 begins, the result continues. About 12 instructions a byte (table of 16 words). */
#define beam_crc32 BEAM_NAME(crc32)
uint32_t beam_crc32(uint32_t crc, uint32_t n, const uint8_t bytes[]);

/* What an image calls an effect, the CRC-32 of its id; the effect of this build that is called so, NULL when none is. */
#define beam_image_effect_key BEAM_NAME(image_effect_key)
#define beam_image_effect     BEAM_NAME(image_effect)
uint32_t beam_image_effect_key(const char *id);
const struct beam_effect *beam_image_effect(uint32_t key);

#ifdef BEAM_TARGET

/* A page: the image's memory and the plan that runs in it. The uses' bytes are in `effect` and in plan.use. */
struct beam_image {
    struct {
        struct beam_image_header header;
        struct beam_image_setup setup;
        struct beam_image_observer observer;
        struct beam_image_tracking tracking;
    } front;
    uint32_t effect[BEAM_USES]; /* beam_image_effect_key() of each use */
    uint8_t code[BEAM_IMAGE_CODE_BYTES];
    struct beam_plan plan; /* n and x are the image's counts and numbers; use[].effect is set by beam_image_check() */
};
BEAM_ASSERT((int)BEAM_PLAN_COUNTS == (int)BEAM_IMAGE_COUNTS, "counts");
BEAM_ASSERT((int)BEAM_PLAN_NUMBERS == (int)BEAM_IMAGE_NUMBERS, "numbers");
BEAM_ASSERT(sizeof(beam_count) == 2 && sizeof(beam_real) == 4, "words");

#define beam_image_observe      BEAM_NAME(image_observe)
#define beam_image_read         BEAM_NAME(image_read)
#define beam_image_write        BEAM_NAME(image_write)
#define beam_image_crc          BEAM_NAME(image_crc)
#define beam_image_header_check BEAM_NAME(image_header_check)
#define beam_image_check        BEAM_NAME(image_check)
#define beam_image_bound        BEAM_NAME(image_bound)
#define beam_image_prove        BEAM_NAME(image_prove)

/* n bytes of the image at this offset; false and nothing done when offset + n > BEAM_IMAGE_BYTES. */
bool beam_image_read(const struct beam_image *image, uint32_t offset, uint32_t n, uint8_t out[]);
bool beam_image_write(struct beam_image *image, uint32_t offset, uint32_t n, const uint8_t in[]);

/* CRC-32 of the bytes between header and code. */
uint32_t beam_image_crc(const struct beam_image *image);

/* Magic, layout, length, CRC, device. The counter and the code are the store's and the key's business. */
enum beam_image_fault beam_image_header_check(const struct beam_image *image,
                                              const uint8_t device[BEAM_IMAGE_DEVICE_BYTES]);

/*
 * Setup, effects, plan (one output, at least one input: the drive is input 0), sample interval (the plan's is
 * dt_s × (1 + clock_relative) to 1e-6, or any when dt_s is 0); fills plan.use. Bounded for any bytes whatever.
 * Call it only after the code was found right: it is then safe, not merely likely, that the numbers are the host's.
 */
enum beam_image_fault beam_image_check(struct beam_image *image, float dt_s);

/* beam_step_bound() of the plan, and what is followed beside it; only after a check without fault. */
uint32_t beam_image_bound(const struct beam_image *image);

/* The observer's state: zeros at rest. */
struct beam_observed {
    float block[BEAM_OBSERVED][2], offset;
};

/* Is there one? */
static inline bool beam_image_observed(const struct beam_image *image)
{
    return image->front.observer.blocks != 0 || image->front.observer.gain_offset > 0.0F;
}

/* One sample's residual in, its innovation out. About 30 instructions and 35 a block; without an observer the residual itself. */
float beam_image_observe(const struct beam_image *image, struct beam_observed *observed, float residual);

/*
 * The proof run: from rest, proof_steps steps with the input proof_amplitude × r/2³¹, r the successive signed words of
 * x ← 1664525 x + 1013904223, x₀ = 1, on every input alike; the last four outputs must equal setup.proof bit for bit, and
 * what the observer makes of the outputs, taken for residuals, observer.proof.
 * `steps` of it per call, so that a background loop stays responsive: starts when progress is 0, done when
 * *progress == proof_steps. state, random: scratch that lives from call to call.
 */
struct beam_image_proof {
    uint32_t progress, random;
    float last[BEAM_IMAGE_PROOFS];
    float innovation;
    struct beam_observed observed;
    struct beam_state state;
};
enum beam_image_fault beam_image_prove(const struct beam_image *image, uint32_t steps, struct beam_image_proof *proof);

#endif /* BEAM_TARGET */

BEAM_C_END

#endif /* BEAM_IMAGE_H */
