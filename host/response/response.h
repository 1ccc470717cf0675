/* SPDX-License-Identifier: GPL-3.0-or-later */
/* response.h — matrices + input -> prediction with exact derivatives, linear and stepped with laws. */
#ifndef BEAMFIT_RESPONSE_H
#define BEAMFIT_RESPONSE_H

#include <complex.h>

#include "beam/beam.h"
#include "ground/ground.h"
#include "model/model.h"
#include "record/record.h"
#include "response/response_law.h"

/* INTERSAMPLE — what an input does between its samples. */

enum intersample { INTERSAMPLE_BAND_LIMITED, INTERSAMPLE_ZERO_ORDER_HOLD, INTERSAMPLE_FIRST_ORDER_HOLD };

/* What --intersample of the commands can be: bl, foh, zoh. BF_USAGE for anything else. */
enum bf_status intersample_from_text(const char *text, enum intersample *out, struct bf_error *err);

/* In a command's table of options. */
#define OPTION_INTERSAMPLE(code)                                                                                       \
    {                                                                                                                  \
        code, 0, "intersample", "HOW", "bl|foh|zoh",                                                                   \
            "what inputs do between samples: bl (band-limited, default), foh (linear), zoh (held)"                     \
    }

/*
 * False when nothing in a record moves the model: every input that it holds is zero throughout, it is no free decay, and the model has
 * no effect that moves by itself. The prediction is silence then, whatever the parameters.
 */
bool record_is_driven(const struct model *model, const struct record *record);

/*
 * RECORDER RINGS — what has set a beam moving went through the recorder's filter, too, which rings for some samples after a free decay has begun: e^(q k) in
 * sample k, of every pole q of the filter (1/sample), with an unknown amplitude on each channel.
 *
 * recorder_rings: of the filter that a record of a free decay states, or is taken to have, one pole of each pair, and a real one last. Returns the filter's
 * order, the number of columns; 0 where there is none, or one that ran forward and backward.
 * recorder_ring: column i of them, Re e^(q k) and Im e^(q k) in turn. O(n) stores, and an exponential for each sample before it is below 1e-18.
 */
enum { RECORDER_RINGS = 12 };
size_t recorder_rings(const struct record *record, double complex poles[RECORDER_RINGS]);
void recorder_ring(const double complex poles[], size_t i, size_t n, double column[]);

/*
 * PREDICT — model + inputs of records -> prediction of the outputs, with exact derivatives by every parameter.
 *
 * A predictor is built once for a model's structure and a list of records; then predictor_run() evaluates it at a
 * parameter vector in the order of model_parameters(model, record names). Rows of a prediction are stacked channel by
 * channel: all samples of record 0's first recorded output, then its second, …, then record 1's.
 *
 * Where a parameter of the beam or a place differs from record to record, each record is predicted by itself; the transfer functions (PREDICT
 * TRANSFER) are then those of the first record.
 *
 * Linear models are solved band-limited in the Laplace domain (exact for zero-phase band-limited sampling); laws,
 * drives and other nonlinear slots by the implicit step on an oversampled grid. See docs/model.md.
 */

struct predict_options {
    enum intersample intersample; /* 0: band limited */
    int oversample; /* steps a sample of laws; 0: the model's steps_per_sample, else the laws' usual number */
    int threads;    /* for nonlinear records; 0: one a processor */
    bool quiet;     /* no warnings (the same records were seen before) */
    bool
        pieces; /* long records of linear models piece by piece, see predict_pieces.h; nothing of PREDICT TRANSFER is there then */
    bool uniform_splines; /* equidistant knots, not on the region edges: the seed paper's space, for comparison */
    size_t fine_splines;  /* dimension of the fine spline space; 0: 160 */
    size_t modes;         /* modes of the reduced space; 0: enough for 4 × the band */
};

/* What --splines of the commands can be: N or N,uniform; into fine_splines and uniform_splines. BF_USAGE for anything else. */
enum bf_status splines_from_text(const char *text, struct predict_options *out, struct bf_error *err);

/* Time derivatives of the deflection that an output shows: 0, 1, 2. */
int output_order(enum output_kind kind);

/* The largest number of steps a sample that these options make any law of the model take. */
int predict_steps(const struct model *model, const struct predict_options *options);

/* One output of one record. */
struct predict_channel {
    size_t record, output; /* indices into the record list and model->outputs */
    size_t row, n;         /* its rows in the stacked vectors */
    double dt_s;
    const double *measured; /* [n], the record's column */
};

/*
 * y leaves the initial states out: the whole prediction is y + Σ amplitude · column. The Jacobian holds
 * d(y + Σ amplitude · column) at the amplitudes of the last predictor_set_nuisance() (0 before).
 *
 * A linear beam is linear in them. Where a law or a map acts on the motion (`bends`), columns are derivatives at these
 * amplitudes, y + Σ amplitude · column is exact there and linearised elsewhere: solve, set, run again until nothing moves.
 * A free decay at amplitudes of 0 is predicted without its laws, so that the first solution is the linear one.
 */
struct prediction {
    size_t n_rows;       /* of the current window */
    size_t n_parameters; /* of model_parameters(); fixed ones included (their columns are filled too) */
    size_t n_nuisance;   /* unknown initial states of records: of modes, of the channels' filters */
    double *y;           /* [n_rows] */
    double *jacobian;    /* [n_parameters][n_rows], d y/d parameter (physical, not logarithmic); NULL unless asked */
    double *nuisance;    /* [n_nuisance][n_rows], columns of the initial states (zero outside their record) */
    const size_t *first_state; /* [n_records + 1]; those of record r are first_state[r] … first_state[r + 1] − 1 */
    const double *amplitude;   /* [n_nuisance] at which this was predicted */
    bool bends;                /* the columns hold near these amplitudes only */
};

struct predictor;

enum bf_status predictor_new(const struct model *model, const struct record records[], size_t n_records,
                             const struct predict_options *options, struct predictor **out, struct bf_error *err);
void predictor_free(struct predictor *predictor);

/* Gives back what a run needed besides its rows; the next run makes it again. Nothing of PREDICT TRANSFER holds then. */
void predictor_rest(struct predictor *predictor);

size_t predictor_channels(const struct predictor *predictor, const struct predict_channel **out);
/* The rows of a record, which are one after the other: the first (0 where it has none), and how many. */
size_t predict_rows_of(const struct predict_channel channels[], size_t n_channels, size_t record, size_t *first);

/* Modes of the reduced space at the last base; static responses are not counted. */
size_t predictor_modes(const struct predictor *predictor);

/*
 * Restrict to the first t_end_s of every record (counted from its first sample, or from free_from_s for a free decay);
 * INFINITY: whole records. Changes rows. Short windows cost proportionally less.
 */
enum bf_status predictor_window(struct predictor *predictor, double t_end_s, struct bf_error *err);

/*
 * Rebuild the reduced space at these parameters. The prediction is then exact at them and in error of second order
 * in the distance from them; call after every larger move and at the end of a fit.
 */
enum bf_status predictor_rebase(struct predictor *predictor, const double parameters[], struct bf_error *err);

/*
 * want_jacobian: bool per parameter (NULL: none). Arrays in *out belong to the predictor and live until the next call.
 * BF_NUMERIC when the model cannot be evaluated there (negative mass, unstable step).
 */
enum bf_status predictor_run(struct predictor *predictor, const double parameters[], const bool want_jacobian[],
                             struct prediction *out, struct bf_error *err);

/*
 * The same without a Jacobian in memory: some record of the window is so long that it is predicted piece by piece (`pieces`), and the rows' derivatives are
 * handed on as they come. No such record has initial states.
 */
bool predictor_is_long(const struct predictor *predictor);

/* Rows row … row + n − 1 of the stacked vectors, all of one channel. */
struct predict_block {
    size_t channel, row, n;
    const double *y;             /* [n] */
    const double *const *column; /* [n_parameters], d y/d parameter [n]; NULL: not wanted */
};

/* Takes each row once; of each channel the last block comes first, as a recursion over all later samples wants it. */
struct predict_sink {
    enum bf_status (*take)(void *context, const struct predict_block *block, struct bf_error *err);
    void *context;
};

/* predictor_run() of a predictor that is long; out->jacobian is NULL. */
enum bf_status predictor_run_blocks(struct predictor *predictor, const double parameters[], const bool want_jacobian[],
                                    const struct predict_sink *sink, struct prediction *out, struct bf_error *err);

/* A long record whose inputs are read, and whose outputs are handed on, piece by piece, so that memory does not grow with it. */
struct predict_stream {
    /* x[n] of a column of the record, samples `first` … first + n − 1. */
    void (*read)(void *context, const char *column, size_t first, size_t n, double x[]);
    /* Outputs of the model, y[n_outputs][n], of the samples from `first` on; in their order, each once. */
    enum bf_status (*take)(void *context, size_t first, size_t n, const double *const y[], struct bf_error *err);
    void *context;
};
/*
 * head: the record without its samples, whose columns name its inputs. The rows are those of a predictor at the model's values. *done false: the record is not long or the
 * model not linear, see predictor_is_long(), and nothing was taken. Memory: that of a piece.
 */
enum bf_status predict_streamed(const struct model *model, const struct record *head,
                                const struct predict_options *options, const struct predict_stream *stream, bool *done,
                                struct bf_error *err);

/* amplitude[n_nuisance]: the initial states as last solved; kept until changed. */
void predictor_set_nuisance(struct predictor *predictor, const double amplitude[]);

/* What initial states are to come near to: rows of the current window. */
struct predict_target {
    const double *weight; /* [n_rows] 1/noise, 0: the row does not count */
    const double *z;      /* [n_rows]; NULL: what was measured */
    const double *start;  /* [n_nuisance]; NULL: the amplitudes as they are */
    size_t *runs;         /* counts predictions; may be NULL */
};

/*
 * Sets the initial states nearest to the target at these parameters, but for the last linear step, where the prediction is not linear in them
 * (`bends`); where it is, or there are none, nothing is done. Each record by itself; a step that makes it worse is halved. BF_NUMERIC where no
 * state within reach has a prediction. Cost: two to five predictions near the solution.
 */
enum bf_status predictor_settle(struct predictor *predictor, const double parameters[],
                                const struct predict_target *target, struct bf_error *err);

/* predictor_settle(), predictor_run() without a Jacobian, and the last step: out->y is the whole prediction from the nearest states. */
enum bf_status predictor_run_solved(struct predictor *predictor, const double parameters[],
                                    const struct predict_target *target, struct prediction *out, struct bf_error *err);

/* Independent copy for another thread (shares nothing mutable). */
enum bf_status predictor_clone(const struct predictor *from, struct predictor **out, struct bf_error *err);

/* PREDICT PLACES — where effects act, as the prediction understands a model; for stages that deploy one. */

/* Does effect e filter, bend or add to this output; does it act on this input or shift it? */
bool effect_on_output(const struct model *model, size_t e, size_t output);
bool effect_on_input(const struct model *model, size_t e, size_t input);

/* Where a point channel was in this record, as the record (`# NAME.at_m: 0.12`) or the model says; false: where it always is. */
bool record_place(const struct model *model, const struct record *record, const char *channel, double *at_m);
bool record_has_places(const struct model *model, const struct record *record);
/* Some effect's parameter is another in each record (`per_record`), so that records have no poles in common. */
bool model_differs_by_record(const struct model *model);

/* Acts as a transfer function: all that a frequency response can show. No law, no drive, no bent map, no signal of its own. */
bool effect_is_linear(const struct beam_effect *effect);
bool effect_map_is_linear(const struct beam_effect *effect); /* of an effect with a map */

/*
 * KERNEL — transfer functions H(s) = s^ν Σ_k α_k β_k/(s − p_k) on a line s = σ + iω of the Laplace plane.
 *
 * A record of n samples is a signal on [0, n·dt); with σ > 0 its transform decays over the zero-padded length, so the
 * discrete transform does not wrap a ringing response around: forward with e^(−σt), multiply by H, back, times e^(σt).
 * Between samples the input is band limited (exact), or held to order zero or one (then 1/(s − p) is replaced by the
 * exact discrete response of the held input).
 */

struct response_grid {
    size_t n;           /* samples of a record */
    size_t n_tail;      /* input samples after the record that an input may be continued by, see response_tail() */
    size_t n_fft;       /* ≥ 2n and ≥ n + 2 n_tail */
    size_t m;           /* n_fft/2 + 1 points */
    double dt_s, sigma; /* sigma: 1/s */
    enum intersample intersample;
    bool
        periodic; /* the record is one period of a steady state: n_fft = n, no tail, the line is iω and what a window adds */
    double
        fade_rate; /* of a piece of a record, a sample: σ dt of the whole record, on whose line its inputs are faded; 0: on its own */
    double complex *s; /* [m] */
    double complex *z; /* [m] e^(s dt), for held inputs; else NULL */
    double *weight;    /* [n + n_tail] e^(−σ t) */
};

/* n ≥ 2. Free with response_grid_free(). */
enum bf_status response_grid_new(size_t n, double dt_s, enum intersample intersample, struct response_grid *out,
                                 struct bf_error *err);
/*
 * One period of a steady state: the responses wrap around, as they should. window_rate: 1/s, of an exponential window that acted on pulse
 * and answer alike (H is then taken at iω + rate), 0 without. The line at 0 Hz, where a free beam has no response, is taken at a thousandth of the first line's.
 */
enum bf_status response_grid_periodic(size_t n, double dt_s, double window_rate, struct response_grid *out,
                                      struct bf_error *err);
void response_grid_free(struct response_grid *grid);
/* σ dt of a grid of a record of n samples. */
double response_grid_rate(size_t n, enum intersample intersample);

/* U[m] of x[count] · e^(−σt), zero-padded; count ≤ n + n_tail. */
enum bf_status response_transform(const struct response_grid *grid, const double x[], size_t count, double complex U[],
                                  struct bf_error *err);

/*
 * x[n + n_tail]: an input of `available` ≥ n samples, continued past the record's last one so that it does not end in a
 * step: a step would ring backwards into the record, because between samples the input is band limited. The samples after
 * a window are taken as they are; after the record's end an autoregressive model (Burg) continues it; both fade out.
 */
void response_tail(const struct response_grid *grid, const double u[], size_t available, double x[]);

/*
 * before[n_tail]: what an input of a record that did not begin at rest was one, two, … samples before its first one, continued and faded out
 * likewise: an input that begins in a step would ring into the record.
 */
void response_lead(const struct response_grid *grid, const double u[], size_t available, double before[]);
/* As response_transform(), with what was before; NULL: nothing. */
enum bf_status response_transform_led(const struct response_grid *grid, const double x[], size_t count,
                                      const double before[], double complex U[], struct bf_error *err);

/* y[n] from Y[m]: inverse transform times e^(σt). */
enum bf_status response_back(const struct response_grid *grid, const double complex Y[], double y[],
                             struct bf_error *err);

/*
 * PREDICT TRANSFER — transfer functions of a predictor's linear model on the Laplace line of a record, for stages that
 * look behind the outputs: what a functional of the deflection did, what a force at a functional does to a channel.
 *
 * Everything holds at the parameters of the last predictor_run(), which must have succeeded; theta is that vector.
 * A functional is g[dimension]: w = gᵀx in the reduced space, and a force at it is g f.
 */

/* One record on its Laplace line. Pointers are the predictor's. */
struct transfer_record {
    const struct response_grid *grid;
    size_t grid_index;                /* records with equal numbers share a grid */
    size_t first_channel, n_channels; /* in the order of predictor_channels() */
    const struct record *record;
};

/* Lowest undamped modes at the parameters of the run, M-orthonormal. */
struct transfer_modes {
    size_t n;                /* modes */
    size_t dimension;        /* of the reduced space */
    const double *omega_rad; /* [n] */
    const double *shape;     /* [n][dimension]: mode k is shape + k·dimension */
    double *damping;         /* [n] diagonal of the modal damping matrix, 1/s; free with free() */
};

/*
 * Poles that oscillate, one of each pair (Im > 0), and their derivatives by a parameter that the run wanted (NULL: they do not depend on it). With values per
 * record: of the first record's beam. *poles[n].
 */
size_t transfer_poles(const struct predictor *p, const double complex **poles);
const double complex *transfer_pole_derivative(const struct predictor *predictor, size_t parameter);
/* The same poles by size, without the motions of a free beam as a whole: (*order)[n], indices into them, to be freed. Their own order changes from run to run. */
size_t transfer_poles_by_size(const struct predictor *predictor, size_t **order);
/* The interval between samples is so many times what the records say: they show the poles times that, and residues likewise. *by[n_parameters]: its derivatives. At the last run. */
double transfer_clock(const struct predictor *predictor, const double **by);
/*
 * Residue of one of these poles in the path from an input to an output, gains included, filters of the sensor and direct paths not: the path is Σ R/(s − p) + R̄/(s − p̄) + what is
 * smooth in s. At the last run, whose parameters theta are; d[n_parameters] (NULL: not wanted): its derivatives by what that run wanted, else 0. One beam for all records.
 */
double complex transfer_residue(const struct predictor *predictor, const double theta[], size_t output, size_t input,
                                size_t pole, double complex d[]);

const struct model *transfer_model(const struct predictor *predictor);
const struct reduced *transfer_reduced(const struct predictor *predictor);
bool transfer_nonlinear(const struct predictor *predictor); /* some effect of the model has a law */
size_t transfer_parameters(const struct predictor *predictor, const struct parameter_ref **refs);
size_t transfer_records(const struct predictor *predictor);
struct transfer_record transfer_record(const struct predictor *predictor, size_t record);

/* The functional of an output, [dimension], and its order of time derivative; borrowed. */
const double *transfer_output_functional(const struct predictor *predictor, size_t output, int *order);

/* Modes below highest_rad, at least one, at most `most`. */
struct transfer_modes transfer_modes(const struct predictor *predictor, double highest_rad, size_t most);

/*
 * out[n · oversample] += the order-th time derivative of w = gᵀx that is left of a record's initial state, at the amplitudes of the last
 * predictor_set_nuisance(), on a grid of that many points a sample. Nothing where the record begins at rest.
 */
void transfer_state_motion(const struct predictor *predictor, const double theta[], size_t record, const double g[],
                           int order, int oversample, double out[]);

/* The unknowns of a record's initial state: the first of *n in struct prediction; two for each mode, then those of filters. */
size_t transfer_states(const struct predictor *predictor, size_t record, size_t *n);

/*
 * c and the pole p of a mode in an initial state: with amplitude a it is 2 Re(a c e^(pt)) of the undamped mode of that rank. The two shapes
 * are taken for the same, as they are where damping is light. 0 for a mode that is not in any state.
 */
double complex transfer_state_shape(const struct predictor *predictor, const struct transfer_modes *modes, size_t mode,
                                    double complex *pole);

/* Nothing drove this record that was recorded: a free decay. */
bool transfer_undriven(const struct predictor *predictor, size_t record);

/* W[m] of w = gᵀx under the recorded inputs; zero for a free decay. */
void transfer_motion(const struct predictor *predictor, const double theta[], size_t record, const double g[],
                     double complex W[]);

/* gain · F of a channel (Ks, the sensor's filters, the recorder's where it is stated), [m]. */
enum bf_status transfer_chain(const struct predictor *predictor, const double theta[], size_t channel,
                              double complex F[], struct bf_error *err);

/* One linear system predicts all records. */
bool transfer_of_all(const struct predictor *predictor);

/*
 * H[m]: a channel over one of the model's inputs, both as they are recorded, where one linear system predicts all records. False where there is no such path: the
 * record lacks the input, is a free decay or one period of a steady state.
 */
bool transfer_path(const struct predictor *predictor, const double theta[], size_t channel, size_t input,
                   double complex H[]);

/* H[m]: output before gain and filters over a force at g, with the output's time derivatives. */
void transfer_force(const struct predictor *predictor, size_t grid_index, size_t output, const double g[],
                    double complex H[]);

/*
 * The change of the dynamic stiffness by parameter i in the modes of transfer_modes(): dA = s² D[0] + s D[1] + D[2],
 * each [n × n]; false when the parameter does not act there, or acts through a memory term or a moving place.
 */
bool transfer_stiffness_change(const struct predictor *predictor, const struct transfer_modes *modes, size_t i,
                               double *D[3]);

/* Gain parameter of a channel's output (Ks) in theta, or SIZE_MAX. */
size_t transfer_gain_parameter(const struct predictor *predictor, size_t channel);

#endif
