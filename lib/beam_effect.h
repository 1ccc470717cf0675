/* SPDX-License-Identifier: MIT */
/*
 * beam_effect.h — the interface of a physical effect; this header is the manual.
 *
 * One effect is one file in lib/effects/. The build finds it (no list to edit): lib/effects/tip_mass.c must define
 *
 *     const struct beam_effect BEAM_NAME(effect_tip_mass) = { .id = "tip_mass", ... };
 *
 * and from then on the effect is known to `beamfit effects`, `add`, `fit`, `diagnose` and to the target.
 *
 * An effect states what it adds to the left side of the weak form
 *     ⟨ρ y_tt + γ y_t, φ⟩ + ⟨EI y″ + cDI y″_t, φ″⟩ + (effect) = inputs
 * or what it does to an input or output channel. It never sees the discretisation: it names a place (an operator on
 * the deflection y) and a law there, and the host (any basis) and the target (10 dimensions) apply it alike.
 * Every slot that an effect does not use stays NULL or 0. An effect may use several slots.
 *
 *   terms     linear, frequency-domain exact: (m s² + d s + k + E τs/(1+τs)) on an operator: mass, damper, spring, memory
 *   law       a force that is not linear (or has internal state, or depends on time): f(w, w_t, z, t) with tangents
 *   filter    a linear filter on an output channel: (b1 s + b0)/(a1 s + a0) · e^(−s·delay)
 *   map       a memoryless nonlinear map on an output channel: v = g(v, u) (saturation, feedthrough)
 *   signal    something added to an output channel that does not come from the beam: hum, offset, drift
 *   drive     what happens to an input before it reaches the beam: hysteresis, saturation (with internal state)
 *   base      acceleration a_b(t) of the clamp: load −ρ(x) a_b on the relative motion; absolute sensors add a_b
 *             (`base` for the target's steps and `tone`, the same in closed form, for the host)
 *   geometry  shifts of places and of the clock: patch position, input position, sample interval
 *   axial_inertia  mass that large rotation sets in motion along the beam
 *
 * All functions are pure, reentrant, without malloc, and bounded. Parameters p[] stand in the order of `parameters`.
 * Derivatives are part of the contract: each slot returns d(result)/d(p_j); tests check them against complex steps.
 */
#ifndef BEAM_EFFECT_H
#define BEAM_EFFECT_H

#include "beam_real.h"
#include "beam_language.h"

BEAM_C_BEGIN

/* Text for people, of which a controller has no use and no room: NULL there. An effect's id is always kept. */
#ifdef BEAM_TARGET
#define BEAM_TEXT(text) 0
#else
#define BEAM_TEXT(text) text
#endif

enum {
    BEAM_EFFECT_PARAMETERS = 4, /* at most, per effect, positions included */
    BEAM_EFFECT_TERMS = 2,      /* at most, per effect */
    BEAM_LAW_WIDTH = 2,         /* coordinates of one law point, at most */
    BEAM_LAW_STATES = 2,        /* internal states of one law point, at most */
    BEAM_DRIVE_STATES = 1,
    BEAM_STEP_UNSTATED = 1000 /* instructions of a call that an effect does not state */
};

/* ---- Parameters ---- */

/*
 * What kind of quantity a parameter is, and so on which scale a search tries values of it. A parameter's role does not say
 * whether it makes the effect present; the flag INNER does: sensor_delay is nothing but a delay (TIME), whereas the
 * relaxation time (TIME) of viscoelastic has no influence while the strength is 0. A role of 0 is not stated; the tests of
 * effects refuse it.
 */
enum beam_role {
    BEAM_ROLE_PLACE = 1, /* a coordinate x at which the effect acts (m): along the span; held until it is freed */
    BEAM_ROLE_STRENGTH,  /* how much of the effect there is: none at 0, and its action begins in proportion */
    BEAM_ROLE_TIME,      /* a time constant or a delay (s): from the sample interval to the length of a record */
    BEAM_ROLE_LEVEL,     /* a size at which the form bends (gap, slip moment, limit, width): as `level_of` says */
    BEAM_ROLE_PHASE,     /* the angle of a sinusoid at a record's first sample (rad): any, one for each record */
    BEAM_ROLE_FREQUENCY, /* the frequency of a sinusoid (Hz): where the residual's spectrum has a line */
    BEAM_ROLE_SHARE,     /* a part of something that is there without the effect (no unit): between −1 and 1 */
    BEAM_ROLE_LOSS,      /* damping over the stiffness that it belongs to (no unit, or s): 0 or small */
    BEAM_ROLE_RESONANCE  /* the frequency at which something would swing alone (Hz): within the records' band */
};

/*
 * What a BEAM_ROLE_LEVEL is a value of, which a role cannot say: its scale is the largest value of that in the records.
 * Levels of force (ELASTIC, VISCOUS) are proportional to the strength: a search that scales one scales the other, so that
 * the form of the force stays.
 */
enum beam_level {
    BEAM_LEVEL_OWN = 0,    /* nothing that is measured: tried about the catalogue's start */
    BEAM_LEVEL_CHANNEL,    /* the channel that the effect acts on (a saturation's limit) */
    BEAM_LEVEL_COORDINATE, /* the law's coordinate w (a gap) */
    BEAM_LEVEL_RATE,       /* its rate w_t (the speed at which friction is built up) */
    BEAM_LEVEL_ELASTIC,    /* strength × w (the moment at which a spring slips) */
    BEAM_LEVEL_VISCOUS     /* strength × w_t */
};

/* Every PLACE, PHASE and FREQUENCY is INNER, every PHASE is PER_RECORD, and every PLACE is treated as HELD. */
enum beam_parameter_flag {
    BEAM_PARAMETER_PER_RECORD = 1, /* one unknown per record (a hum's phase) */
    BEAM_PARAMETER_LOG = 2,        /* positive, estimated as its logarithm */
    BEAM_PARAMETER_INNER = 4,      /* no influence while the others are neutral (place, time constant, threshold): */
                                   /* its `neutral` only stands in; scanned on a grid before a search */
    BEAM_PARAMETER_HELD = 8        /* held in a fit unless the user frees it */
};

/*
 * Of a BEAM_ROLE_PLACE the numbers neutral, minimum, maximum and start are fractions of the beam's length (start 1: the
 * free end), because an effect does not know the beam; its value p[] is in metres.
 */

struct beam_parameter_info {
    const char *name; /* catalogue name, ends in its unit: "mass_kg" */
    const char *unit; /* "kg"; "" when dimensionless; text for people: programs go by the role */
    const char *what; /* one phrase for a person */
    double neutral;   /* the effect is absent at this value; INFINITY is allowed (sensor_highpass tau_s) */
    double minimum;   /* physical range, inclusive */
    double maximum;
    double start;           /* a typical small value, from which a search starts */
    unsigned flags;         /* enum beam_parameter_flag */
    unsigned char role;     /* enum beam_role; a byte fits into the padding behind `flags` and takes no flash */
    unsigned char level_of; /* enum beam_level, of a BEAM_ROLE_LEVEL; likewise */
};

/* ---- Places: linear operators on the deflection y ---- */

/*
 * An effect has at most one coordinate of its own, and gives it a mass that is not 0. Only the host's spaces hold such coordinates: a controller
 * gets them inside the matrices that the host makes, and beam_assemble() refuses them.
 */

enum beam_operator_kind {
    BEAM_AT_NOTHING = 0,
    /* functionals: one number w; the term acts as w(φ)·(…)w(y) */
    BEAM_AT_POINT,            /* w = y(at)                       m   */
    BEAM_AT_SLOPE,            /* w = y'(at)                      rad */
    BEAM_AT_SLOPE_DIFFERENCE, /* w = y'(to) − y'(from)           rad */
    BEAM_AT_PATCH,            /* w = slope difference of the model's (first) patch, rad */
    BEAM_AT_ROOT,             /* w = y'(0), the rotation of a clamp that this effect releases, rad */
    BEAM_AT_OWN,              /* w = q, a coordinate of the effect's own beside y: what it hangs on the beam, m */
    BEAM_AT_POINT_TO_OWN,     /* w = y(at) − q, the stretch between the beam and that coordinate, m */
    /* forms over the whole span: bilinear, weight(x) inside the integral */
    BEAM_OVER_DEFLECTION, /* ∫ weight y φ dx   */
    BEAM_OVER_SLOPE,      /* ∫ weight y' φ' dx */
    BEAM_OVER_CURVATURE,  /* ∫ weight y″ φ″ dx */
    /* the form X with X M⁻¹ X = K: modal diagonal ω_j; hysteretic damping (model in mass and stiffness as they are) */
    BEAM_OVER_MODES
};

/*
 * BEAM_WEIGHT_PATCH: 1 over the model's (first) patch, 0 elsewhere. BEAM_WEIGHT_TURNING: ρ(x) EI₀/ρ₀ of the plain beam, so
 * that ρ r² of one r² = I/A everywhere is this over (E/ρ_volume).
 */
enum beam_weight {
    BEAM_WEIGHT_ONE = 0,
    BEAM_WEIGHT_RHO,
    BEAM_WEIGHT_EI,
    BEAM_WEIGHT_CDI,
    BEAM_WEIGHT_PATCH,
    BEAM_WEIGHT_TURNING
};

struct beam_operator {
    enum beam_operator_kind kind;
    enum beam_weight weight; /* of a BEAM_OVER_* form */
    beam_real at_m;          /* BEAM_AT_POINT, BEAM_AT_SLOPE */
    beam_real from_m, to_m;  /* BEAM_AT_SLOPE_DIFFERENCE */
    int at_parameter;        /* 1 + index of the parameter that is at_m; 0: the place is no parameter */
};

/* What an effect may know of the beam it sits on. */
struct beam_place {
    beam_real length_m;
    beam_real patch_from_m, patch_to_m; /* both 0 when the beam has no patch */
};

/* ---- Linear terms ---- */

struct beam_coefficients {
    beam_real mass;         /* m: multiplies s²; kg for a point, per metre for a form */
    beam_real damping;      /* d: multiplies s */
    beam_real stiffness;    /* k */
    beam_real memory;       /* E of one Maxwell branch E τs/(1+τs) (Boltzmann memory) */
    beam_real relaxation_s; /* τ of that branch, > 0 when memory is not 0 */
};

struct beam_term {
    struct beam_operator place;
    struct beam_coefficients value;
    struct beam_coefficients by_parameter[BEAM_EFFECT_PARAMETERS]; /* d value/d p_j */
};

/* ---- Laws: nonlinear, time-dependent or hysteretic forces ---- */

enum beam_law_points {
    BEAM_LAW_NONE = 0,
    BEAM_LAW_AT_POINT,                /* one point, coordinate w = y(at) */
    BEAM_LAW_AT_PATCH,                /* one point, w = the patch's slope difference */
    BEAM_LAW_AT_SPAN,                 /* one point, w = y'(at + width/2) − y'(at − width/2) (crack) */
    BEAM_LAW_OVER_DEFLECTION,         /* quadrature points over the span, w = y */
    BEAM_LAW_OVER_CURVATURE,          /* quadrature points over the span, w = y″ */
    BEAM_LAW_OVER_SLOPE_AND_CURVATURE /* quadrature points over the span, w = (y', y″) */
};

/* Where a law acts. Over the span the framework multiplies by the quadrature weight and by weight(x). */
struct beam_law_place {
    enum beam_law_points points;
    enum beam_weight weight;
    beam_real at_m, width_m;
    int at_parameter;    /* 1 + index of the parameter that is at_m; 0: none */
    int width_parameter; /* 1 + index of the parameter that is width_m; 0: none */
};

/* State of one law point at the end of a step; *_old are values at its beginning. */
struct beam_law_input {
    beam_real w[BEAM_LAW_WIDTH]; /* coordinate */
    beam_real v[BEAM_LAW_WIDTH]; /* its rate */
    beam_real w_old[BEAM_LAW_WIDTH];
    beam_real z[BEAM_LAW_STATES]; /* internal state, at the beginning of the step */
    beam_real t_s;                /* time at the end of the step, from the record's first sample */
    beam_real dt_s;
};

/* Derivatives that only a fit reads: a controller, whose stack they would fill, has one place for all of them. */
#ifdef BEAM_TARGET
#define BEAM_FOR_FITS union
#else
#define BEAM_FOR_FITS BEAM_NAMELESS struct
#endif

/*
 * Force (left side of the weak form) and every derivative. Index order: [of][by]. All zeroed by the caller. An effect
 * writes those after z; it does not read them back.
 */
struct beam_law_output {
    beam_real f[BEAM_LAW_WIDTH];
    beam_real f_w[BEAM_LAW_WIDTH][BEAM_LAW_WIDTH];
    beam_real f_v[BEAM_LAW_WIDTH][BEAM_LAW_WIDTH];
    beam_real z[BEAM_LAW_STATES]; /* internal state at the end of the step */
    BEAM_FOR_FITS
    {
        beam_real f_w_old[BEAM_LAW_WIDTH][BEAM_LAW_WIDTH];
        beam_real f_z[BEAM_LAW_WIDTH][BEAM_LAW_STATES];
        beam_real f_p[BEAM_LAW_WIDTH][BEAM_EFFECT_PARAMETERS];
        beam_real z_w[BEAM_LAW_STATES][BEAM_LAW_WIDTH];
        beam_real z_v[BEAM_LAW_STATES][BEAM_LAW_WIDTH];
        beam_real z_w_old[BEAM_LAW_STATES][BEAM_LAW_WIDTH];
        beam_real z_z[BEAM_LAW_STATES][BEAM_LAW_STATES];
        beam_real z_p[BEAM_LAW_STATES][BEAM_EFFECT_PARAMETERS];
    };
};

/* ---- Channels ---- */

/* v(s) = (b1 s + b0)/(a1 s + a0) · e^(−s·delay) · w(s) */
struct beam_filter {
    beam_real b1, b0, a1, a0, delay_s;
};

struct beam_filter_output {
    struct beam_filter value;
    struct beam_filter by_parameter[BEAM_EFFECT_PARAMETERS];
};

struct beam_sample_output {
    beam_real y;   /* the channel's new value */
    beam_real y_v; /* d y/d v, v the incoming value */
    beam_real y_u; /* d y/d u (feedthrough) */
    beam_real y_p[BEAM_EFFECT_PARAMETERS];
};

struct beam_drive_output {
    beam_real u;            /* what reaches the beam */
    beam_real u_u, u_u_old; /* by the commanded value at the end and beginning of the step */
    beam_real u_z[BEAM_DRIVE_STATES];
    beam_real u_p[BEAM_EFFECT_PARAMETERS];
    beam_real z[BEAM_DRIVE_STATES];
    beam_real z_z[BEAM_DRIVE_STATES][BEAM_DRIVE_STATES];
    beam_real z_u[BEAM_DRIVE_STATES], z_u_old[BEAM_DRIVE_STATES];
    beam_real z_p[BEAM_DRIVE_STATES][BEAM_EFFECT_PARAMETERS];
};

struct beam_geometry {
    beam_real patch_shift_m;
    beam_real input_shift_m;  /* of a point force */
    beam_real clock_relative; /* the sample interval is (1 + this) times what the record says */
    beam_real by_parameter[3][BEAM_EFFECT_PARAMETERS]; /* of the three above, in their order */
};

/* A tone: amplitude · sin(2π frequency t + phase), t from the record's first sample. */
struct beam_tone {
    beam_real amplitude, phase_rad, frequency_Hz;
    beam_real by_parameter[3][BEAM_EFFECT_PARAMETERS]; /* of the three above, in their order */
};

/* On which channels a measurement-chain effect sits when the user names none. */
enum beam_channels {
    BEAM_CHANNELS_NONE = 0,
    BEAM_CHANNELS_PATCH_OUTPUT, /* every patch_strain output */
    BEAM_CHANNELS_EVERY_OUTPUT,
    BEAM_CHANNELS_PATCH_INPUT, /* every patch_moment input */
    BEAM_CHANNELS_POINT_INPUT  /* every point_force input */
};

enum beam_family {
    BEAM_FAMILY_STRUCTURE,
    BEAM_FAMILY_DAMPING,
    BEAM_FAMILY_NONLINEAR,
    BEAM_FAMILY_MEASUREMENT,
    BEAM_FAMILY_ENVIRONMENT
};

/* ---- The effect ---- */

struct beam_effect {
    const char *id; /* catalogue id: "tip_mass" */
    enum beam_family family;
    const char *title;         /* one line: "a mass at the free end" */
    const char *form;          /* the term in the weak form, UTF-8: "m y_tt(ℓ) φ(ℓ)" */
    const char *source;        /* where the form comes from: paper, book, equation */
    const char *looks_like;    /* what it does to data, two or three sentences for an experimentalist */
    const char *confused_with; /* ids and the experiment that separates them, for an experimentalist */
    const char *target_cost;   /* extra cost of one step on the target, in the terms of this header */
    /*
     * Instructions that one call of law, map, signal, drive or base takes at most on a Cortex-M4F (-O2), whatever its
     * arguments; 0: not stated, beam_step_bound() then takes BEAM_STEP_UNSTATED. Measured: make target NAMES=costs.
     */
    unsigned short step_instructions;

    int n_parameters;
    struct beam_parameter_info parameters[BEAM_EFFECT_PARAMETERS];
    enum beam_channels channels; /* default channels; BEAM_CHANNELS_NONE for effects of the structure */
    int releases_root;           /* the clamp may turn: the basis needs y'(0) ≠ 0 */

    /* Each returns 0, or −1 when p is outside the physical range (the caller checks ranges first). */
    int (*terms)(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS]);
    int n_terms;

    int (*law_place)(const beam_real p[], const struct beam_place *place, struct beam_law_place *out);
    int (*law)(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out);
    int n_law_states; /* internal states per law point; 0 at the start of a record */

    int (*filter)(const beam_real p[], struct beam_filter_output *out);
    /* map: v the channel so far, u the model's first patch_moment input (0 where there is none) */
    int (*map)(const beam_real p[], beam_real v, beam_real u, struct beam_sample_output *out);
    /* signal: y = v + something(t); y_v is 1 */
    int (*signal)(const beam_real p[], beam_real t_s, beam_real v, struct beam_sample_output *out);
    int (*drive)(const beam_real p[], beam_real u, beam_real u_old, const beam_real z[BEAM_DRIVE_STATES],
                 struct beam_drive_output *out);
    int (*base)(const beam_real p[], beam_real t_s, struct beam_sample_output *out); /* y = a_b(t), m/s² */
    int (*tone)(const beam_real p[],
                struct beam_tone *out); /* the same a_b in closed form, for the host; with `base` */
    int (*geometry)(const beam_real p[], struct beam_geometry *out);
    /*
     * axial_inertia: y = κ of the kinetic energy ½ κ ∫ ρ u_t² dx with u(x) = −½ ∫₀ˣ y'² ds, the axial motion of an
     * inextensible beam; in the weak form κ ⟨ρ u_tt, −∫₀ˣ y' φ' ds⟩. It is not local, so no law can carry it; the host
     * evaluates it on the coordinates of the effect's law, which is one over the span.
     */
    int (*axial_inertia)(const beam_real p[], struct beam_sample_output *out);
};

/* All effects of the build, in alphabetical order of id; generated by tools/effects_table.sh. */
#define beam_effects       BEAM_NAME(effects)
#define beam_effects_count BEAM_NAME(effects_count)
extern const struct beam_effect *const beam_effects[];
extern const int beam_effects_count;

BEAM_C_END

#endif /* BEAM_EFFECT_H */
