/* SPDX-License-Identifier: GPL-3.0-or-later */
/* estimate_motion.h — the measured motion, laws along it, and the force that is missing; part of estimate.h */
#ifndef BEAMFIT_ESTIMATE_MOTION_H
#define BEAMFIT_ESTIMATE_MOTION_H

#include <complex.h>
#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"
#include "model/model.h"
#include "response/response.h"

/*
 * MOTION — what the beam really did, as the recordings tell it, without knowing why.
 *
 * A linear baseline at θ leaves the residual r = z − ŷ(θ). The smallest modal forces F that explain it in all channels of
 * a record are the Wiener estimate on the Laplace line of the predictor,
 *     F̂ = Φ Hᴴ (Φ H Hᴴ + Σ)⁻¹ R,   H_ok = ψ_k(o) s^ν/(s² + C_kk s + ω_k²),
 * Σ the channels' noise, Φ(s) the power of the forces, estimated from R in bands around s. Then the motion of any
 * functional w = gᵀx is the linear response to the inputs plus Σ ψ_k(g) F̂_k/(s² + C_kk s + ω_k²). It follows the
 * sensors, so it holds where the baseline is far off, and needs no place of the missing force.
 *
 * Also here: the linear model as equation error. With the measured motion x̂ in place of the predicted one,
 *     r = −H (ΔA x̂ + f(x̂)) + noise
 * holds for changes ΔA of mass, damping and stiffness of any size, not only small ones; column j of the Jacobian is
 * −H (∂A/∂θ_j) x̂.
 *
 * In the last two periods of the first mode the motion is less certain: what the sensors would have said next is not known.
 * A record that did not begin at rest (a free decay) moves from the state that is nearest to it; in regressions that state is unknown.
 */

struct motion_record {
    size_t n, m;       /* samples; points of the Laplace line */
    double complex *q; /* [modes.n][m] deviation of the modal coordinates from the linear response */
};

struct motion {
    struct predictor *predictor; /* borrowed; its last run is at theta */
    size_t n_parameters, n_rows, n_channels, n_records;
    const struct predict_channel *channels; /* borrowed from the predictor */
    double *theta;                          /* [n_parameters] */
    double *sigma;                          /* [n_channels] noise rms, unit of the channel */
    double floor;
    double *weight;         /* [n_channels] 1/√(σ² + (floor·rms r)²) */
    double *residual;       /* [n_rows] z − ŷ */
    double complex **chain; /* [n_channels][m] gain and filters of the channel */
    struct transfer_modes modes;
    struct motion_record *records; /* [n_records] */
    bool *free;                    /* [n_parameters] estimated by the regressions */
    size_t n_states;
    const double *states;    /* [n_states][n_rows] columns of the initial states, of the same run; the predictor's */
    const double *predicted; /* [n_parameters][n_rows] Jacobian of the predictor's last run; the predictor's */
    double *jacobian;        /* [n_parameters][n_rows] along the measured motion; columns of held ones are zero */
};

/* A good `floor`: equation error is wrong in proportion to what it explains. */
#define MOTION_FLOOR 0.2

/*
 * The linear model of `predictor` at theta; sigma: [n_channels] in the order of predictor_channels(). floor: relative
 * error of the motion that the weights allow for, of each channel's residual (0: the noise alone). The predictor must not
 * run elsewhere while the motion is in use. BF_USAGE when the model has a law or no record with an input.
 */
enum bf_status motion_new(struct predictor *predictor, const double theta[], const double sigma[], double floor,
                          struct motion *out, struct bf_error *err);

/* The same without the Jacobian, for a motion that is to be renewed first; motion_update_jacobian() fills it. */
enum bf_status motion_prepare(struct predictor *predictor, const double theta[], const double sigma[], double floor,
                              struct motion *out, struct bf_error *err);
void motion_free(struct motion *motion);

/*
 * TRIAL — would this nonlinear effect explain the residual? The force that the effect would exert along the measured motion is computed
 * once, and its response is regressed on the residual together with the baseline's parameters (equation error, trial_search.h). Nothing
 * is simulated, so there are no local minima and no stability limits; the result is a start for a refit.
 */

struct trial_options {
    int rounds;          /* renewals of θ and the motion after the scan, at most; 0: none (a score), 3: start values */
    bool keep_positions; /* positions stay where the search begins: at the catalogue's start, if the beam moves there */
};

struct trial {
    const struct beam_effect *effect;
    bool possible;                    /* false: no valid force along this motion, or its sign is against the range */
    double p[BEAM_EFFECT_PARAMETERS]; /* start values, catalogue order, SI (places in metres) */
    double *theta;                    /* [n_parameters] baseline parameters to start from with the effect */
    double strength, strength_sd;     /* the parameter in which the force is linear, and one standard error */
    double chi_square_baseline;       /* weighted, rows and priors, after the best Δθ without the effect */
    double chi_square;                /* with it */
    double share;                     /* 1 − chi_square/chi_square_baseline, 0 … 1; the score that ranks */
    double p_value;                   /* of the strength, F test with the effective number of samples */
    double unexplained;               /* √(chi_square/rows): 1 is the noise when the weights have no floor */
    size_t forces;                    /* evaluations of the force over all records */
};

/* One candidate along a motion. Free with trial_free(). Cost: about 5 ms a force for 4 records of 4096 samples. */
enum bf_status trial_run(const struct motion *motion, const struct beam_effect *effect,
                         const struct trial_options *options, struct trial *out, struct bf_error *err);
void trial_free(struct trial *trial);

/* All laws of the catalogue that the model does not have, best first; *n of them, free each and the array. */
enum bf_status trial_all(const struct motion *motion, const struct trial_options *options, struct trial **out,
                         size_t *n, struct bf_error *err);

/*
 * RECONSTRUCT — the missing force, when no effect of the catalogue explains the residual: where it acts, what it was in
 * time, and what it looks like against displacement, velocity, amplitude and frequency.
 *
 * At each place two questions are asked, the baseline's parameters free in both: which part of the residual does a
 * force explain that is some function of displacement and velocity there (a regression on powers, steps and hinges of the
 * measured motion, one function for all records); and which part does any history of a force there explain (the Wiener
 * estimate from all channels of a record). The first tells places apart even with one channel, if the force is such a
 * function; the second needs records with two or more channels.
 */

enum { RECONSTRUCT_BINS = 24, RECONSTRUCT_TEXT = 600 };

enum reconstruct_place { RECONSTRUCT_POINT, RECONSTRUCT_PATCH, RECONSTRUCT_SPREAD };

struct reconstruct_site {
    enum reconstruct_place place;
    double at_m;       /* RECONSTRUCT_POINT */
    double by_law;     /* part of the weighted residual's square that no function of (w, v) there explains, 0 … 1 */
    double by_history; /* that no force there explains, in records of two or more channels; NaN when none has two */
};

/* One record's force and motion at the chosen place, [n] each, on the record's samples. */
struct reconstruct_record {
    size_t record, n;
    double dt_s;
    double *f, *w, *v; /* N, m, m/s at a point; N·m, rad, rad/s at the patch; N/m, m², m²/s spread (w = ∫ y dx).
                          f stands on the left side of the weak form: a spring has f = k w */
};

struct reconstruction {
    size_t n_sites;
    struct reconstruct_site *sites; /* best first: by_law where some place explains the main part so, else by_history */
    bool is_law;                    /* the first */
    bool located;                   /* the best place is clearly better than others away from it */
    struct reconstruct_site best;
    size_t n_records;
    struct reconstruct_record *records;
    /* What the force at the best place looks like: shares of the residual's square that go away, 0 … 1. */
    double linear;                    /* with k w + d v alone */
    double elastic_odd, elastic_even; /* with odd functions of w; with even ones beside them */
    double dissipative;               /* with odd functions of v beside all functions of w */
    double memory;                    /* what stays: hysteresis, a force from outside, noise, or the wrong place */
    bool hardening, drag;             /* the odd part grows faster than w; the part of v faster than v */
    double dissipated;                /* mean f v/(rms f · rms v), −1 … 1: > 0 takes energy out */
    double amplitude_power;           /* rms f grows as rms w to this power between records; NaN: one level only */
    double frequency_Hz;              /* of the largest line of |F| with at least four periods in the record */
    double band_share;                /* part of its square within 5 % of that, least of all records */
    bool resonant;                    /* every record has its force there, and no mode of the baseline does */
    bool sensor_like;                 /* one output carries the misfit in every record and no other shows any */
    char channel[MODEL_NAME];
    /* Binned curves for plotting, of the record with the largest force: its mean at w, and what is left of it at v. */
    size_t strongest; /* index into records */
    double w_bin[RECONSTRUCT_BINS], f_of_w[RECONSTRUCT_BINS];
    double v_bin[RECONSTRUCT_BINS], f_of_v[RECONSTRUCT_BINS];
    size_t n_lines; /* |F| of the same record: one-sided amplitude spectrum */
    double df_Hz;
    double *spectrum;
    char text[RECONSTRUCT_TEXT]; /* one or two plain sentences */
};

/* motion: of the baseline fitted to all records or to the weak ones. About 1 s for 4 records of 4096 samples. */
enum bf_status reconstruct_run(const struct motion *motion, struct reconstruction *out, struct bf_error *err);
void reconstruct_free(struct reconstruction *reconstruction);

#endif
