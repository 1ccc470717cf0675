/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * motion.h — what the beam really did, as the recordings tell it, without knowing why.
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
 * Free decays have no motion here (nothing recorded drives them); their rows are left out with weight zero.
 */
#ifndef BEAMFIT_MOTION_H
#define BEAMFIT_MOTION_H

#include "response/predict_transfer.h"

struct motion_record {
    size_t n, m;       /* samples; points of the Laplace line */
    bool valid;        /* false: a free decay */
    double complex *q; /* [modes.n][m] deviation of the modal coordinates from the linear response */
};

struct motion {
    struct predictor *predictor; /* borrowed; its last run is at theta */
    size_t n_parameters, n_rows, n_channels, n_records;
    const struct predict_channel *channels; /* borrowed from the predictor */
    double *theta;                          /* [n_parameters] */
    double *sigma;                          /* [n_channels] noise rms, unit of the channel */
    double floor;
    double *weight;         /* [n_channels] 1/√(σ² + (floor·rms r)²), 0 for a free decay */
    double *residual;       /* [n_rows] z − ŷ */
    double complex **chain; /* [n_channels][m] gain and filters of the channel */
    struct transfer_modes modes;
    struct motion_record *records; /* [n_records] */
    bool *free;                    /* [n_parameters] estimated by the regressions */
    const double *predicted;       /* [n_parameters][n_rows] Jacobian of the predictor's last run; the predictor's */
    double *jacobian;              /* [n_parameters][n_rows] along the measured motion; columns of held ones are zero */
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
 * w = gᵀx of a record, its rate and its acceleration, [n · oversample] each on a grid of `oversample` points a sample, the
 * first at the record's first sample. Each may be NULL.
 */
enum bf_status motion_of(const struct motion *motion, size_t record, const double g[], int oversample, double w[],
                         double v[], double a[], struct bf_error *err);
/* Value and rate of the deflection at a point (derivative 0), slope (1), curvature (2), and the patch's slope difference. */
enum bf_status motion_point(const struct motion *motion, size_t record, int derivative, double at_m, int oversample,
                            double w[], double v[], struct bf_error *err);
enum bf_status motion_patch(const struct motion *motion, size_t record, int oversample, double w[], double v[],
                            struct bf_error *err);

/* F[m] of a force given on the oversampled grid, f[n · oversample · stride] read with that stride. */
enum bf_status motion_transform(const struct motion *motion, size_t record, const double f[], size_t stride,
                                int oversample, double complex F[], struct bf_error *err);

/* What forces at functionals g do to every channel. Transfer functions are kept, so that many forces cost little. */
struct motion_paths {
    size_t d;           /* functionals */
    double complex **H; /* [n_channels][d · m] before gain and filters; channels of one output may share it */
    bool *own;          /* [n_channels] */
};
void motion_paths_new(const struct motion *motion, const double g[], size_t d, struct motion_paths *out);
void motion_paths_free(const struct motion *motion, struct motion_paths *paths);
/* rows += −H F of a record; F: [d][m], rows: [n_rows] stacked as the prediction. */
enum bf_status motion_respond(const struct motion *motion, const struct motion_paths *paths, size_t record,
                              const double complex F[], double rows[], struct bf_error *err);

/*
 * The motion when forces F[record][d · m] at g[d] (left side of the weak form) are believed to act: their response is
 * taken off the residual, and only what is left asks for smallest modal forces. F of a free decay is NULL. The Jacobian
 * follows with motion_update_jacobian().
 */
enum bf_status motion_assume(struct motion *motion, const double g[], const struct motion_paths *paths,
                             double complex *const F[], struct bf_error *err);
enum bf_status motion_update_jacobian(struct motion *motion, struct bf_error *err);

/*
 * Records of the smallest input level of each kind of excitation (same inputs in use, rms within a factor of `ratio`, say
 * 1.5, of the smallest); level: the input's rms; weak[n_records]. Returns how many are weak; equal to n_records: all
 * records are of one level, and amplitude can tell nothing.
 */
size_t motion_weak_records(const struct model *model, const struct record records[], size_t n_records, double ratio,
                           bool weak[]);

#endif
