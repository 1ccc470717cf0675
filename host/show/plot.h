/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * plot.h — pictures, drawn by gnuplot as a program. Only plot_gnuplot.c runs it.
 *
 * Every picture is STEM.png and STEM.pdf in `directory` (made when missing), with STEM.gp (the script) and STEM-*.dat (the
 * data) left beside it, so that a person can change and redraw it: `cd DIR && gnuplot STEM.gp`. A stem is reduced to letters,
 * digits, '.', '_' and '-'. Text is shown as it is (no gnuplot markup). When gnuplot is missing the data and the script
 * are there, and the status is BF_USAGE with a text that names the package.
 */
#ifndef BEAMFIT_PLOT_H
#define BEAMFIT_PLOT_H

#include <stdbool.h>
#include "ground/error.h"

/* The seed paper's four panels of one channel: (a) measured, (b) model, (c) amplitude spectra, (d) a short interval. */
struct plot_panels {
    const char *directory, *stem;
    const char *title;    /* NULL: none */
    const char *quantity; /* "piezo_V": the unit is read from the name's last part */
    size_t n;
    double t0_s, dt_s;
    const double *measured, *model; /* [n] */
    double from_Hz, to_Hz;          /* of panel (c); to_Hz 0: the Nyquist frequency */
    double detail_from_s,
        detail_to_s;         /* of panel (d), on the record's time axis; equal: chosen at the largest motion */
    const double *noise_psd; /* [n_noise] one-sided, from 0 to Nyquist, drawn as floor in (c); NULL: none */
    size_t n_noise;
};
enum bf_status plot_panels(const struct plot_panels *panels, struct bf_error *err);

/* Residual in time with ±2σ of the noise, its spectrum over the floor, its autocorrelation, its correlation with the
 * input, and the share of the misfit per band. Parts that are absent (NULL) leave their panel out. */
struct plot_residual {
    const char *directory, *stem, *title, *quantity;
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

/* Lines with points over logarithmic axes. Points that are not positive and finite are left out. */
struct plot_line {
    const char *legend;
    size_t n;
    const double *x, *y; /* [n] */
};
struct plot_convergence {
    const char *directory, *stem, *title, *x_label, *y_label;
    size_t n_lines;
    const struct plot_line *lines;
    bool linear_x, linear_y; /* false: logarithmic */
};
enum bf_status plot_convergence(const struct plot_convergence *plot, struct bf_error *err);

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

/* Frequency and damping ratio of one mode against its amplitude: points with standard errors, and two models as lines. */
struct plot_drift_curve {
    size_t n;
    const double *amplitude, *frequency_Hz, *damping; /* [n] NAN: none */
    const double *frequency_sd_Hz, *damping_sd;       /* [n] or NULL */
};
struct plot_drift {
    const char *directory, *stem, *title;
    const char *quantity; /* of the amplitude, as in plot_panels */
    size_t n_measured, n_before, n_after;
    const struct plot_drift_curve *measured, *before, *after;
};
enum bf_status plot_drift(const struct plot_drift *drift, struct bf_error *err);

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

/* A board's stream: measured and predicted, their difference with ±2σ of the noise, the running ratio with its alarm. */
struct plot_live {
    const char *directory, *stem, *title, *quantity;
    size_t n;
    double dt_s;
    const double *measured, *predicted, *residual, *ratio; /* [n] */
    double noise_rms, alarm_ratio;
};
enum bf_status plot_live(const struct plot_live *live, struct bf_error *err);

/* "piezo_V" -> "piezo (V)", "accel_mps2" -> "accel (m/s²)". suffix is put behind the unit: "²/Hz"; out: [size]. */
void plot_quantity(const char *name, const char *suffix, char *out, size_t size);

#endif
