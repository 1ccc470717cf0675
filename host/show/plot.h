/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot.h — the pictures that only the answers of show/ draw. Private to show/; see PLOT in show.h for the files that come out. */
#ifndef BEAMFIT_PLOT_H
#define BEAMFIT_PLOT_H

#include <complex.h>

#include "show.h"

/* Residual in time with ±2σ of the noise, its spectrum over the floor, its autocorrelation, its correlation with the
 * input, and the share of the misfit per band. Parts that are absent (NULL) leave their panel out. */
struct plot_residual {
    const char *directory, *stem, *title, *quantity;
    const char *note; /* small, in the corner: whose record it is; NULL: none */
    size_t n;
    double t0_s, dt_s;
    const double *residual;  /* [n] */
    double noise_rms;        /* 0: unknown */
    const double *noise_psd; /* [n_noise] */
    size_t n_noise;
    const double *autocorrelation; /* [n_autocorrelation], lag 0 first */
    size_t n_autocorrelation;
    double autocorrelation_bound;
    const double *input_correlation; /* [2 n_lags + 1] */
    size_t n_lags;
    double input_bound;
    const char *input_name;
    const double *edge_Hz, *share; /* [n_bands + 1], [n_bands] */
    size_t n_bands;
};
enum bf_status plot_residual(const struct plot_residual *residual, struct bf_error *err);

/* A frequency response: magnitude and phase, measured and of the model; with `noise` its standard error and the coherence. */
struct plot_bode {
    const char *directory, *stem, *title;
    const char *note;           /* as of plot_residual */
    const char *quantity, *per; /* output, as in plot_panels; what it is divided by, "/N" */
    size_t n;
    const double *frequency_Hz;             /* [n] */
    const double complex *measured, *model; /* [n] */
    const double *noise, *coherence;        /* [n] or NULL, both */
    bool without_phase;                     /* only magnitudes were measured */
};
enum bf_status plot_bode(const struct plot_bode *bode, struct bf_error *err);

/* Error against model version. */
struct plot_history {
    const char *directory, *stem, *title;
    size_t n;                 /* models, oldest first */
    const char *const *label; /* [n] */
    const double *fitted;     /* [n] nrmse on fitted records; NAN: none */
    const double *held_out;   /* [n] nrmse on held-out records; NAN: none */
    double noise_floor;       /* nrmse of pure noise on fitted records, drawn as a line; 0 or NAN: none */
    double held_out_floor;    /* the same on held-out records; a line of its own where it differs by more than 2 % */
};
enum bf_status plot_history(const struct plot_history *history, struct bf_error *err);

/* Misfit in units of the noise: a bar group for each band, and lines against the amplitude of motion. NAN: none. */
enum { PLOT_BEFORE, PLOT_BEFORE_HELD_OUT, PLOT_AFTER, PLOT_AFTER_HELD_OUT, PLOT_STATES };
struct plot_misfit {
    const char *directory, *stem, *title;
    size_t n_bands;
    const double *band_Hz; /* [n_bands] the mode in each band, or its upper edge */
    bool bands_are_modes;
    const double *band[PLOT_STATES]; /* [n_bands] */
    size_t n_levels;
    const double *level;                 /* [n_levels] motion over the largest motion, > 0 */
    const double *at_level[PLOT_STATES]; /* [n_levels] */
};
enum bf_status plot_misfit(const struct plot_misfit *misfit, struct bf_error *err);

/* Explanations, best first, with what each leaves in units of the noise; the last row may be the model as it was. */
struct plot_rank {
    const char *name;
    double fitted, held_out; /* NAN: none */
    double gain;             /* evidence, BIC; NAN: none */
    bool named;              /* belongs to the verdict: shaded */
};
struct plot_ranking {
    const char *directory, *stem, *title;
    size_t n;
    const struct plot_rank *rows;
};
enum bf_status plot_ranking(const struct plot_ranking *ranking, struct bf_error *err);

/* A decay, a column a mode: its amplitude in time, and its frequency and damping ratio against that amplitude; points with
 * standard errors, and models as lines. Without a model before, the one after is "model". */
enum { PLOT_DRIFT_MODES = 3 };
struct plot_drift_curve {
    size_t n;
    const double *t_s, *amplitude, *frequency_Hz, *damping; /* [n] NAN: none */
    const double *frequency_sd_Hz, *damping_sd;             /* [n] or NULL */
    double amplitude_sd;                                    /* 0: none */
};
struct plot_drift_mode {
    const char *title; /* of the column */
    size_t n_measured, n_before, n_after;
    const struct plot_drift_curve *measured, *before, *after;
};
struct plot_drift {
    const char *directory, *stem, *title;
    const char *note;     /* as of plot_residual */
    const char *quantity; /* of the amplitude, as in plot_panels */
    size_t n_modes;       /* 1 … PLOT_DRIFT_MODES */
    const struct plot_drift_mode *modes;
};
enum bf_status plot_drift(const struct plot_drift *drift, struct bf_error *err);

/* Poles of free linear models over the number of their modes, with the mean spectrum behind and a model's frequencies as lines. */
struct plot_stabilisation {
    const char *directory, *stem, *title;
    const struct stabilisation *found;
    size_t n_modes;
    const double *mode_Hz; /* [n_modes] of the model */
};
enum bf_status plot_stabilisation(const struct plot_stabilisation *diagram, struct bf_error *err);

/* A force against displacement and velocity at its place (samples and means in bins), its size against the size of the
 * displacement, and its amplitude spectrum with the modes as thin lines. */
struct plot_force {
    const char *directory, *stem, *title;
    const char *force, *displacement, *velocity; /* axis labels with units */
    size_t n;
    const double *f, *w, *v; /* [n] */
    size_t n_bins;
    const double *w_bin, *f_of_w, *v_bin, *f_of_v; /* [n_bins] f_of_v: of what f_of_w leaves; NAN: empty bin */
    size_t n_sizes;
    const double *size_w, *size_f; /* [n_sizes] running rms */
    size_t n_lines;
    double df_Hz;
    const double *spectrum; /* [n_lines] */
    size_t n_modes;
    const double *mode_Hz; /* [n_modes] */
};
enum bf_status plot_force(const struct plot_force *force, struct bf_error *err);

/* "piezo_V" -> "piezo (V)", "accel_mps2" -> "accel (m/s²)". suffix is put behind the unit: "²/Hz"; out: [size]. */
void plot_quantity(const char *name, const char *suffix, char *out, size_t size);

/* The start of the `length` (1 to n) samples of z[n] with the most energy. */
size_t plot_most_motion(const double z[], size_t n, size_t length);

/* "m" for a value of 0.02 V, "" where the unit takes no prefix; its values times *factor have that prefix. */
const char *plot_prefix(double x, const char *unit, double *factor);
/* plot_quantity() with the prefix of its largest value, "piezo (mV)"; returns the factor of its values. */
double plot_scaled(const char *name, double largest, char *out, size_t size);

#endif
