/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * truth.h — an independent simulator of a measured beam, to judge beamfit against.
 *
 * It shares no code with lib/ or host/: Hermite cubic finite elements with nodes on every region edge, normal modes of
 * those, exact modal integration of linear beams, CVODE for the others, smooth input signals on a fine grid, an
 * anti-alias filter on every channel, decimation, noise, an ADC.
 *
 *     struct truth_spec spec;
 *     truth_spec_default(&spec);                              the paper's beam, no signal, no channel, no effect
 *     truth_spec_line(&spec, "input hammer_N point_force at_m=0.0254", message);
 *     truth_spec_line(&spec, "signal hammer_N raised_cosine start_s=0.1 width_s=0.004 level=8", message);
 *     truth_spec_line(&spec, "output piezo_V patch_strain", message);
 *     truth_spec_line(&spec, "effect quadratic_drag coefficient_Ns2pm3=0.2", message);
 *     struct truth_record clean, noisy;
 *     truth_simulate(&spec, &clean, message);                 once: noise-free, filtered, decimated
 *     truth_measure(&spec, &clean, seed, &noisy);             any number of times: noise and ADC; cheap
 *     truth_record_free(&clean); truth_record_free(&noisy);
 *
 * Units are SI and stand in the names. Functions that can fail return 0 or −1 and fill message[TRUTH_MESSAGE].
 * Out of memory ends the program: this is a test tool.
 */
#ifndef TRUTH_H
#define TRUTH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum {
    TRUTH_MESSAGE = 200,
    TRUTH_NAME = 32,
    TRUTH_REGIONS = 16,
    TRUTH_PORTS = 12,
    TRUTH_SIGNALS = 16,
    TRUTH_EFFECTS = 16,
    TRUTH_PARAMETERS = 5
};

enum truth_support { TRUTH_CLAMPED_FREE, TRUTH_CLAMPED_CLAMPED, TRUTH_PINNED_PINNED, TRUTH_FREE_FREE };

/* Later regions lie over earlier ones: region 0 is the whole span, region 1 the patch. */
struct truth_region {
    double from_m, to_m;
    double EI_Nm2, rho_kgpm, cDI_sNm2;
    double gyration2_m2; /* r² = I/A of the section, for rotary inertia only */
};

enum truth_port_kind {
    TRUTH_POINT_FORCE,
    TRUTH_PATCH_MOMENT,
    TRUTH_PATCH_STRAIN,
    TRUTH_DISPLACEMENT,
    TRUTH_VELOCITY,
    TRUTH_ACCELERATION
};

/* One input or output channel. noise < 0: the record's noise level. */
struct truth_port {
    char name[TRUTH_NAME];
    enum truth_port_kind kind;
    double at_m;
    double noise;
    double gain;  /* what is written is gain × what happened (a hammer of unknown calibration) */
    bool omitted; /* an input that acts and is not recorded */
};

enum truth_signal_kind {
    TRUTH_RAISED_COSINE,
    TRUTH_HALF_SINE,
    TRUTH_TRIANGLE,
    TRUTH_CHIRP,
    TRUTH_MULTISINE,
    TRUTH_BURST,
    TRUTH_SINE,
    TRUTH_RECORDED,
    TRUTH_HELD
};

/* A signal starts at start_s and lasts width_s (0: to the end of the record and beyond). Signals on one input add. */
struct truth_signal {
    enum truth_signal_kind kind;
    size_t input;
    double start_s, width_s, level;
    double from_Hz, to_Hz; /* chirp, multisine; burst and sine use from_Hz */
    double taper_s;        /* raised-cosine ends of chirp, multisine and sine; rounding of a triangle's corners */
    double phase_rad;
    size_t count;  /* lines of a multisine */
    uint64_t seed; /* phases of a multisine */
    const double
        *samples; /* [n_samples] at sample_rate_Hz, not owned. TRUTH_RECORDED: read band-limited; TRUTH_HELD: each
                              held until the next, from t = 0, as after a D/A converter, and zero after the last */
    size_t n_samples;
};

enum { TRUTH_ALL_CHANNELS = -1 };

struct truth_effect {
    int kind;                           /* row of the table in truth_effects.c */
    double parameter[TRUTH_PARAMETERS]; /* in the order of that row */
    int output;                         /* measurement chain: index of the output, or TRUTH_ALL_CHANNELS */
};

/* Converters of a controller that is coupled to the beam: drive and sensor are the spec's first input and output. */
struct truth_live {
    double drive_per_code, drive_zero_code;   /* input's unit = (code − zero) × per_code */
    double sensor_per_code, sensor_zero_code; /* code = zero + output / per_code, rounded, cut at 0 and code_max */
    double code_max;
    double noise_rms; /* output's unit, before rounding; coloured by noise_ar */
};

struct truth_spec {
    double length_m;
    enum truth_support support;
    size_t n_regions;
    struct truth_region region[TRUTH_REGIONS];
    double gamma_sNpm2, Ks_V, KB_NmpV;
    size_t n_inputs, n_outputs, n_signals, n_effects;
    struct truth_port input[TRUTH_PORTS], output[TRUTH_PORTS];
    struct truth_signal signal[TRUTH_SIGNALS];
    struct truth_effect effect[TRUTH_EFFECTS];

    double sample_rate_Hz, duration_s;
    double keep_from_s;  /* the record begins here: everything before is not written */
    size_t filter_order; /* Butterworth, even; 0: none */
    double filter_ratio; /* −3 dB frequency of one pass / sample rate */
    bool filter_causal;  /* one pass (delays) instead of forward and backward */
    double noise;        /* rms / rms of the clean channel, outputs only */
    double input_noise;  /* the same for inputs */
    double noise_ar[2];  /* n_k = a1 n_{k−1} + a2 n_{k−2} + white, rms as stated */
    unsigned adc_bits;   /* 0: none */
    double adc_headroom; /* full scale / largest value */
    bool adc_inputs;     /* inputs are converted too */
    uint64_t seed;
    bool blind; /* the printed record does not state the truth */
    struct truth_live live;

    size_t elements;     /* at least, over the span */
    size_t modes;        /* ≤ 400 */
    bool static_vectors; /* static responses beside the modes, so that those left out answer slow forces */
    size_t oversampling; /* of the integration; 0: ≥ 16 and ≥ 16 kHz */
    bool linear_hold;    /* inputs are lines between fine samples instead of smooth: see docs/truth.md */
    double tolerance;    /* relative, of CVODE */
    bool force_ode;      /* CVODE for a linear beam too: to check one integrator by the other */
};

struct truth_channel {
    char name[TRUTH_NAME];
    bool is_input;
    double noise; /* relative rms */
    double *x;    /* [n] */
};

struct truth_record {
    size_t n, n_channels;
    double rate_Hz, t0_s;
    struct truth_channel channel[2 * TRUTH_PORTS];
};

void truth_spec_default(struct truth_spec *spec);
/* One line of a spec file; empty lines and '#' comments are accepted. See docs/truth.md for the words. */
int truth_spec_line(struct truth_spec *spec, const char *line, char message[TRUTH_MESSAGE]);
int truth_spec_read(struct truth_spec *spec, const char *path, char message[TRUTH_MESSAGE]);
/* Appends an effect with its default parameters; NULL when the id is unknown or there is no room. */
struct truth_effect *truth_effect_add(struct truth_spec *spec, const char *id);
/* −1 when this effect has no such parameter. */
int truth_effect_set(struct truth_effect *effect, const char *name, double value);
const char *truth_effect_id(const struct truth_effect *effect);
const char *truth_effect_parameter(const struct truth_effect *effect, int index); /* NULL past the last */
/* Catalogue by number, 0 … until NULL. in_catalogue: false for the effects beamfit does not know. */
const char *truth_effect_name(size_t index, bool *in_catalogue);

/* Lowest n frequencies and damping ratios (of the damped linear beam for proportional modes: C_jj / 2ω_j). */
int truth_modes(const struct truth_spec *spec, size_t n, double frequency_Hz[], double damping_ratio[],
                char message[TRUTH_MESSAGE]);
/* Noise-free record: inputs that are not omitted, then outputs. Cost: ~0.2 s linear, seconds with CVODE. */
int truth_simulate(const struct truth_spec *spec, struct truth_record *clean, char message[TRUTH_MESSAGE]);
/* Noise and ADC of the spec on a clean record. Equal seeds give equal records. */
void truth_measure(const struct truth_spec *spec, const struct truth_record *clean, uint64_t seed,
                   struct truth_record *out);
const double *truth_record_channel(const struct truth_record *record, const char *name); /* NULL when absent */
/* time_s first, '%.7g'; metadata lines say how the record came about. −1: the stream failed. */
int truth_record_print(const struct truth_record *record, const struct truth_spec *spec, const char *title,
                       FILE *stream);
void truth_record_free(struct truth_record *record);

/*
 * The same beam in lock step with a controller: each tick the drive's code for the sample interval that begins goes in
 * and the sensor's code at its end comes out. Begins at rest; the same spec and codes give the same answers.
 * Cost of a tick: 20 µs linear, some milliseconds with CVODE (docs/truth.md).
 */
struct truth_plant;
struct truth_plant *truth_plant_new(const struct truth_spec *spec, char message[TRUTH_MESSAGE]); /* NULL: refused */
int truth_plant_tick(struct truth_plant *plant, uint16_t drive_code, uint16_t *sensor_code,
                     char message[TRUTH_MESSAGE]);
/* What the sensor's converter saw at the last tick, without noise, in the output's unit. */
double truth_plant_sensor(const struct truth_plant *plant);
void truth_plant_free(struct truth_plant *plant);
/*
 * Listens on a unix stream socket until stop() says so, one client at a time; the beam goes on from one to the next. stop() is asked
 * before each tick and may put another beam at *plant.
 */
int truth_plant_serve(struct truth_plant *const *plant, const char *path, bool (*stop)(void),
                      char message[TRUTH_MESSAGE]);

#endif
