/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fit_problem.h — the weighted least-squares problem of a fit; inside the fit stage only.
 *
 *   r(x) = [ w (ŷ(θ(x)) − z) per sample ; (x − x0)/prior per parameter with a prior ]
 *   w    = e^(−s (t − onset)) / √(σ_c² + (floor · rms_c)²)
 *
 * x is ln θ for a logarithmic parameter and θ/scale for any other; a residual term's scale is what would make it as large
 * as the signal, and one that no record shows is held. Unknowns that enter linearly (initial states of a free
 * decay, a record's unknown force level) are solved for at every x and projected out (variable projection, Golub &
 * Pereyra 1973, with Kaufman's Jacobian).
 */
#ifndef BEAMFIT_FIT_PROBLEM_H
#define BEAMFIT_FIT_PROBLEM_H

#include "line_rows.h"
#include "maths/maths.h"
#include "response/response.h"

struct unknown {
    size_t ref;       /* index into refs */
    bool logarithmic; /* x = ln θ, else x = θ/scale */
    double scale, least_scale;
    double prior, prior_x; /* standard deviation and centre in x; prior 0: none */
};

/* How the beam was driven in a record. */
struct fit_drive {
    double onset_s;  /* of the excitation, since the first row of the record */
    bool level;      /* its level is an unknown factor */
    bool free_state; /* the record did not begin at rest */
    bool driven;     /* record_is_driven() */
    size_t n_inputs; /* of the model that were recorded */
};

/* What of the last evaluation holds. */
enum fit_holds {
    HOLDS_NOTHING,
    HOLDS_VALUE /* residual, fitted, half_square */,
    HOLDS_JACOBIAN /* these, and the Jacobian */
};

struct fit_problem {
    const struct model *model;
    const struct record *records;
    size_t n_records;
    struct predictor *predictor; /* of the samples; NULL: there are none */
    struct line_rows *lines; /* of the records that are no samples, the last ones; NULL: there are none; not owned */
    size_t n_refs;
    const struct parameter_ref *refs;
    const char *const *names; /* [n_records] base names */
    size_t n_unknowns;
    struct unknown *unknowns;
    double *lower, *upper;           /* [n_unknowns] in x */
    bool *held;                      /* [n_unknowns] not moved in this stage */
    bool *want;                      /* [n_refs] */
    const struct fit_shares *shares; /* who has the samples; NULL: they are here */
    struct fit_drive *drives;        /* [n_records] */
    bool has_decay;                  /* some record did not begin at rest */
    double latest_s;                 /* largest onset of any record, wherever it is */
    double *
        horizon_s; /* [n_records] since the first row of the record: rows from here on have no weight; INFINITY: all count */
    double *weighed_s; /* [n_records] the same when the rows were weighed */
    size_t n_channels; /* whose samples are here */
    size_t n_signals;  /* the same and those of the shares */
    double *sigma;     /* [n_channels] noise, unit of the channel */
    bool released;     /* bounds are those of the file alone: see fit_problem_release() */
    /* stage */
    double decay_ps, floor; /* s and the relative floor of the weights */
    double rebase_limit;    /* largest move in x of a structural parameter before the reduced space is rebuilt */
    double *base;           /* [n_unknowns] x of the last rebase */
    bool based;             /* there was one */
    const struct predict_channel *channels; /* of the current window */
    size_t n_sample_rows;                   /* the first ones; those of lines follow */
    size_t n_rows, n_used;                  /* n_used: rows with a weight; of all shares */
    double
        noise_rows; /* Σ (w/max w)² of the samples: so many rows of noise; a window or a floor makes rows count less */
    double *weight; /* [n_rows] */
    /* last evaluation */
    double *theta;      /* [n_refs] */
    double half_square; /* ½‖data rows‖² */
    double *residual;   /* [n_rows], weighted, after projection; of shares nobody has the rows */
    double *
        fitted; /* [n_rows] ŷ with the linear unknowns in place; of a compressed problem the predictor's [n_sample_rows] */
    /*
     * Weighted, by x, after projection: [n_unknowns][n_jacobian]. Rows of long records and of shares are not kept: compressed, these are R of the samples' [J r],
     * by blocks, above the rows of lines, so that JᵀJ and Jᵀr are those of all rows.
     */
    bool compressed;
    size_t n_jacobian; /* n_rows, or those of the compressed ones */
    double *jacobian;
    double *beside; /* [n_jacobian] residual, or that of the compressed rows */
    double *levels; /* [n_records] factor of the record; 1 where it is known */
    size_t n_nuisance;
    double *coefficients;   /* [n_nuisance] */
    double *states;         /* [n_nuisance] the same at the last evaluation with a Jacobian; NULL: there was none */
    double *at;             /* [n_unknowns] x of the last evaluation */
    enum fit_holds held_at; /* what is still that of x = at */
    size_t runs;            /* predictor evaluations so far */
    bool stop;              /* set by the caller or by Ctrl-C */
    bool (*interrupted)(void *context); /* asked before every evaluation, besides Ctrl-C; may be NULL */
    void *context;
    double prior_scale;  /* ≥ 1, see fit_problem_weigh_priors() */
    double explained_ps; /* smallest s of a window that was explained to the floor, by careful windows; 0: none */
    double *explained;   /* [n_refs] θ of that window */
    double
        abandon_above; /* χ²/n; a window or the last step of a staircase ends where it would not get below; 0: never */
    size_t most_runs;  /* interrupted after so many; 0: never */
};

/* refs, names, records and predictor are borrowed; sigma[n_channels] is copied. start: θ[n_refs]. */
enum bf_status fit_problem_new(struct fit_problem *p, const struct model *model, struct predictor *predictor,
                               const struct record records[], size_t n_records, const char *const names[],
                               const struct parameter_ref refs[], size_t n_refs, const double sigma[],
                               struct bf_error *err);
/* The same with records that are no samples; predictor NULL: all are such. lines is borrowed and may be NULL. */
enum bf_status fit_problem_new_with_lines(struct fit_problem *p, const struct model *model, struct predictor *predictor,
                                          struct line_rows *lines, const struct record records[], size_t n_records,
                                          const char *const names[], const struct parameter_ref refs[], size_t n_refs,
                                          const double sigma[], struct bf_error *err);
/* The same of records that shares have, opened; refs and names are of all records. */
enum bf_status fit_problem_new_shared(struct fit_problem *p, const struct model *model, const struct fit_shares *shares,
                                      const char *const names[], const struct parameter_ref refs[], size_t n_refs,
                                      struct bf_error *err);
void fit_problem_free(struct fit_problem *p);
/* Gives back the memory of derivatives until they are wanted again. */
void fit_problem_rest(struct fit_problem *p);
/* Inside fit_problem.c, fit_window.c and fit_evaluate.c: fitted rows, jacobian and beside freed; jacobian and beside made. */
void fit_problem_free_rows(struct fit_problem *p);
void fit_problem_make_jacobian(struct fit_problem *p);

/* Begin a stage: window, weights, and the reduced space rebuilt at x. */
enum bf_status fit_problem_stage(struct fit_problem *p, double decay_ps, double floor, const double x[],
                                 struct bf_error *err);
/* Of a stage without a floor: the least that such a floor would leave of a channel's weights. */
double fit_problem_floor_part(const struct fit_problem *p, double floor);
/* On failure the reduced space is that of the last base again. */
enum bf_status fit_problem_rebase(struct fit_problem *p, const double x[], struct bf_error *err);
/* The same, and each measured frequency goes to the mode that is nearest now; as at the beginning of a stage. */
enum bf_status fit_problem_pair(struct fit_problem *p, const double x[], struct bf_error *err);
/* In such moves: the reduced space is exact to second order in this. */
extern const double fit_problem_unmoved;
/* Largest move of a structural unknown since the last rebase. */
double fit_problem_moved(const struct fit_problem *p, const double x[]);

void fit_problem_to_x(const struct fit_problem *p, const double theta[], double x[]);
/* Only the unknowns of theta[n_refs] are written. */
void fit_problem_to_theta(const struct fit_problem *p, const double x[], double theta[]);
/* dθ/dx of unknown i. */
double fit_problem_slope(const struct fit_problem *p, size_t i, const double x[]);

/*
 * Where the file sets no bound of it, damping goes as far as model_most_damping(): records that the model cannot explain are often followed better by a beam of which nothing
 * swings than by one that swings elsewhere. After fit_problem_release() the file's bounds are all that there is.
 */
void fit_problem_release(struct fit_problem *p);
/* x[n_unknowns] lies on a bound that the file does not set. */
bool fit_problem_presses(const struct fit_problem *p, const double x[]);

/*
 * A step of 1 must stay large: the scale of an effect's strength that has outgrown it becomes its size; x[n_unknowns] follows.
 * Never smaller than it was to begin with.
 */
void fit_problem_rescale(struct fit_problem *p, double x[]);
/* Unknown i is not moved, and no derivative by it is computed. */
void fit_problem_hold(struct fit_problem *p, size_t i, bool held);
bool fit_problem_interrupted(const struct fit_problem *p);
/* Evaluations since there were `before` of them do not count among most_runs. */
void fit_problem_do_not_count(struct fit_problem *p, size_t before);

/* The last evaluation was at x, to rounding, and holds. */
bool fit_problem_holds(const struct fit_problem *p, const double x[]);
/* Fills residual, fitted (and jacobian), unless they hold. data_square: ½‖data rows‖². BF_NUMERIC when there is no value at x. */
enum bf_status fit_problem_evaluate(struct fit_problem *p, const double x[], bool with_jacobian, double *data_square,
                                    struct bf_error *err);
/*
 * What the form of the model is wrong by is as large in one sample as in the next: a misfit that the noise does not account for is a few facts
 * a channel, not thousands of samples. With q = ½‖r‖² at x, q₀ what the noise may account for, and m facts, the data count (q − q₀)/(m/2) times
 * too much against the priors, and so the priors are weighed by
 *
 *     prior_scale = max(1, (q − q₀)/(m/2)),
 *
 * which is one step of the reweighting that minimises (m/2) log q + ½ Σ ((x − x₀)/prior)². At the noise it is 1. Nothing without priors. Cost: an
 * evaluation without derivatives. The scale is 1 where x has no value.
 */
void fit_problem_weigh_priors(struct fit_problem *p, const double x[]);
/* The stage of whole records without a floor at x, its priors weighed there. Nothing where the problem is in it and holds x. */
enum bf_status fit_problem_whole(struct fit_problem *p, const double x[], struct bf_error *err);
/* That scale at the last evaluation, with or without priors: how many times the data say the same, ≥ 1. */
double fit_problem_form_scale(const struct fit_problem *p);
/* Variances grow with the residual and with the error of form: that scale or the mean square of a row, whichever is larger. */
double fit_problem_spread(const struct fit_problem *p);
struct optimise_options;
/*
 * Relative limits of a descent that ends where so many nats are left to gain: a row counts for itself at the noise; above it what is left is an error of form,
 * and its facts count (some ten to a channel, not thousands of rows: else the last digits of a misfit that nothing explains take most of the steps).
 */
void fit_problem_end_within(const struct fit_problem *p, double nats, struct optimise_options *options);

/*
 * fit_blocks.c, of a compressed problem: a prediction at p->theta, which is that of x, whose rows are handed on. take: n rows from `row` on, all of one channel,
 * of the weighted Jacobian by x, J[n × n_unknowns], and of the residual r[n]; of each channel the last ones come first.
 */
struct fit_rows_sink {
    enum bf_status (*take)(void *context, size_t channel, size_t row, size_t n, const double J[], const double r[],
                           struct bf_error *err);
    void *context;
};
enum bf_status fit_problem_blocks(struct fit_problem *p, const double x[], const struct fit_rows_sink *sink,
                                  struct prediction *out, struct bf_error *err);
/* Such a prediction; fills jacobian and beside but for the rows of lines. O(n_rows n_unknowns²). */
enum bf_status fit_problem_compress(struct fit_problem *p, const double x[], struct prediction *out,
                                    struct bf_error *err);

/* The problem as the optimiser sees it; valid while p stays where it is. */
struct least_squares fit_problem_view(struct fit_problem *p);
/* Mean square of the data rows in use of the last evaluation: χ²/n when the weights are those of the noise. */
double fit_problem_mean_square(const struct fit_problem *p);

#endif
