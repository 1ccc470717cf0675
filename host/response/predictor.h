/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predictor.h — the predictor, private to response/: what the predict_*.c files share. See predict.h. */
#ifndef BEAMFIT_PREDICTOR_H
#define BEAMFIT_PREDICTOR_H

#include <complex.h>
#include "functional.h"
#include "response.h"
#include "recorder.h"
#include "kernel.h"
#include "beam/beam.h"

struct clamp;
struct law;

/* What a drive's parameter changes in an input of a record. */
struct drive_change {
    size_t input, parameter;
    double complex *U; /* [m] */
};

/* A record bound to the model, in the current window. */
struct record_plan {
    const struct record *record;
    size_t start, n; /* rows are samples start … start + n − 1 */
    size_t grid;     /* index into predictor->grids */
    bool free_decay;
    bool periodic; /* one period of a steady state, never cut by a window */
    struct recorder_filter recorder;
    size_t n_rings; /* recorder_rings() */
    double complex ring[RECORDER_RINGS];
    double complex *A;         /* [m] of that filter; NULL: not stated, or inputs are held */
    const double **input;      /* [n_inputs] column of the record or NULL */
    size_t *source;            /* [n_inputs] where the input acts in this record: index into predictor->inputs */
    double complex **recorded; /* [n_inputs][m] transforms of the inputs in this window, NULL where absent */
    double complex **driven;   /* [n_inputs][m] the same behind their drives; NULL where there is none */
    double complex **U;        /* [n_inputs] what reaches the beam: one of the two above, not owned */
    size_t n_changes;
    struct drive_change *changes;
    bool free_state; /* the beam moved in a way nobody recorded before the record began */
    size_t first_channel, n_channels;
};

/* Moves of the beam's geometry, and of the clock, at the parameters of the current run. */
struct geometry {
    double by_m[MODEL_MOVES]; /* from `fixed` */
    double clock;             /* the sample interval is this times what the records say */
    double *move_by;          /* [n_parameters][MODEL_MOVES] d by_m */
    double *clock_by;         /* [n_parameters] d clock */
    bool moves;               /* some effect shifts the patch, or a length is a parameter */
    struct model fixed;       /* the model as the file has it */
    struct reduced base;      /* when it moves: the space at the base; predictor->reduced follows */
    double base_m[MODEL_MOVES];
    double **block_by[MODEL_MOVES]; /* [n_blocks][n × n] derivative of every block; NULL where none was wanted */
};

/* An input at its place in one record, or in all that do not shift it. */
struct source {
    size_t input, record; /* record SIZE_MAX: all */
};

/*
 * The modes of unknown initial states, by ascending frequency. An eigenvector has no sign of its own: each keeps the one in which
 * its outputs are nearest to those of the run before, so that an amplitude means the same from run to run.
 */
struct state_modes {
    size_t most, n;            /* any record needs at most; there are at the current run */
    size_t *pole;              /* [most] index into the system's poles */
    double *sign;              /* [most] ±1 */
    double complex *reference; /* [most][n_outputs] sign · α of the run before; zero before the first */
};

/* A predictor of one record among records that are not all of one beam, or that are long: predict_each.c. */
struct each_record {
    struct predictor *predictor;
    size_t n_refs;
    struct parameter_ref *refs;
    size_t *from; /* [n_refs] index into the common parameters */
    size_t row;   /* where its rows begin among the common ones */
    struct pieces
        *pieces; /* of a long record, which the predictor sees one after the other; NULL: it sees the whole record */
};

struct predictor {
    struct model model; /* own copy: parameters of the base, its geometry as the current run has it */
    const struct record *records;
    size_t n_records;
    struct predict_options options;
    struct parameter_ref *refs;
    struct parameter_map map;
    struct reduced reduced;
    struct system *system;
    struct record_plan *plans; /* [n_records] */
    size_t n_channels;
    struct predict_channel *channels;
    size_t n_grids;
    struct response_grid *grids;
    struct response_kernel **kernels; /* [n_grids] at the current parameters */
    /* [n_grids] of the forces of laws, which are smooth between samples even where the inputs are held */
    struct response_kernel **force_kernels;
    struct response_grid *force_grids; /* the same points, band limited */
    struct geometry geometry;
    struct state_modes states;
    size_t n_sources; /* the model's inputs; then one for each record's point force that is shifted in that record */
    struct source *sources;
    struct functional *inputs, *outputs; /* [n_sources], [n_outputs] */
    struct functional *base_load;        /* of a shaken clamp; NULL: none shakes */
    struct law *laws;                    /* [n_effects]: members zero for effects without a law */
    size_t n_coordinates;
    struct functional *coordinates; /* of all laws, in order of effects */
    bool *moves;                    /* [n_parameters] moves the place of a law */
    bool *structural;               /* [n_parameters] see run_structural() */
    size_t n_rows, n_nuisance;
    double *y, *jacobian, *nuisance, *amplitude;
    size_t *first_state;   /* [n_records + 1] of each record's columns of `nuisance` */
    bool states_are_clear; /* outside their records these columns are zero */
    double t_end_s;
    bool nonlinear;           /* some effect has a law or a drive */
    struct each_record *each; /* [n_records] where something differs from record to record; NULL: nothing does */
    bool in_pieces;           /* records in pieces, by the predictors in `each`: this one has no grids */
    bool *filled;             /* [n_parameters] then: columns of the Jacobian that may hold something */
    size_t whole;             /* samples of the record that the one record is a piece of; 0: it is no piece */
};

/* Parameters of the current run. */
struct run {
    struct predictor *p;
    const double *theta;
    const bool *want; /* NULL: no derivatives */
    struct prediction *out;
};

static inline bool run_wants(const struct run *run, size_t parameter)
{
    return run->want != NULL && run->want[parameter];
}

/*
 * The system's derivative by this parameter is not zero, or the parameter moves a place; and its derivative was asked for.
 * Known once the system has been evaluated.
 */
static inline bool run_structural(const struct run *run, size_t parameter)
{
    return run->want != NULL && run->p->structural[parameter];
}

/* For functionals_evaluate(). */
static inline const bool *run_structure(const struct run *run)
{
    return run->want != NULL ? run->p->structural : NULL;
}

static inline double *run_column(const struct run *run, size_t parameter, const struct predict_channel *channel)
{
    return run->out->jacobian + parameter * run->out->n_rows + channel->row;
}

static inline bool not_zero(double x)
{
    return x < 0.0 || x > 0.0;
}

/* out[n] += scale · x. */
static inline void add_scaled(size_t n, double scale, const double x[], double out[])
{
    for (size_t i = 0; i < n; i++)
        out[i] += scale * x[i];
}

/*
 * What the functions predictor_… of response.h do where all records are of one beam, or one record is alone (predictor.c, predict_run.c, predict_settle.c).
 * single_run_system: the system at theta and what reaches it, without a prediction; out and, with_jacobian, its Jacobian are cleared.
 */
enum bf_status single_new(const struct model *model, const struct record records[], size_t n_records,
                          const struct predict_options *options, struct predictor **out, struct bf_error *err);
void single_free(struct predictor *p);
enum bf_status single_rebase(struct predictor *p, const double theta[], struct bf_error *err);
enum bf_status single_window(struct predictor *p, double t_end_s, struct bf_error *err);
enum bf_status single_run(struct predictor *p, const double theta[], const bool want[], struct prediction *out,
                          struct bf_error *err);
enum bf_status single_run_system(struct predictor *p, const double theta[], bool with_jacobian, struct prediction *out,
                                 struct bf_error *err);
void single_set_nuisance(struct predictor *p, const double amplitude[]);
void single_rest(struct predictor *p);
/* Room for the columns of initial states and, with_jacobian, of derivatives, where it was given back. */
void single_room(struct predictor *p, bool with_jacobian);
enum bf_status single_settle(struct predictor *p, const double theta[], const struct predict_target *target,
                             struct bf_error *err);
/* The last linear step of every record's initial states, a[n_nuisance], and y with them in place. */
enum bf_status settle_last(struct predictor *p, const struct predict_target *target, struct prediction *y, double a[],
                           struct bf_error *err);

/*
 * predict_each_model.c. each_wanted: is any parameter of this model on these records of one record alone and moves the beam, or is any place? each_model: the
 * model of one record, in which nothing differs any more; to be freed also after a failure.
 */
bool each_wanted(const struct model *model, const struct record records[], size_t n_records);
enum bf_status each_model(const struct model *model, const struct record *record, struct model *out,
                          struct bf_error *err);

void kernels_new(struct predictor *p); /* at the system as evaluated */
void kernels_free(struct predictor *p);
/* predict_parameters.c: what a parameter vector says. predictor_use: writes it into p->model. */
void predictor_use(struct predictor *p, const double theta[]);
/* KB or Ks of a patch, else the channel's gain, and where it stands; SIZE_MAX: it is held. */
double input_gain(const struct run *run, size_t input, size_t *parameter);
double output_gain(const struct run *run, size_t output, size_t *parameter);
bool is_input_gain(const struct predictor *p, size_t parameter);
/* at_m of an input at theta. */
double input_place(const struct predictor *p, size_t input, const double theta[]);
/* What effect e shifts at theta; zero for an effect without geometry. */
enum bf_status read_geometry(const struct predictor *p, size_t record, size_t e, const double theta[],
                             struct beam_geometry *out, struct bf_error *err);
/* Term t of effect e at theta on this beam; false: there is none, or it does not act at a point. */
bool point_mass(const struct predictor *p, const struct model *model, size_t e, int t, const double theta[],
                struct beam_term *out);
/* Shift of an input in a record. */
enum bf_status geometry_input_shift(const struct predictor *p, size_t record, size_t input, const double theta[],
                                    double *shift_m, struct bf_error *err);

/* predict_moved.c: the model with its geometry as the file has it; to be freed. */
void geometry_original(const struct predictor *p, struct model *out);
/* The geometry of p->model at theta; called before the space of a base is made. */
enum bf_status geometry_place(struct predictor *p, const double theta[], struct bf_error *err);
/* Only where the geometry moves: the space of a new base. */
enum bf_status moved_rebase(struct predictor *p, struct bf_error *err);
void moved_space_free(struct geometry *geometry);
/* Model, space and functionals at the run's geometry; with derivatives where the run wants them. */
enum bf_status moved_evaluate(const struct run *run, struct bf_error *err);
/* The parameter moves the whole space. */
bool moves_space(const struct predictor *p, size_t parameter);

/* predict_geometry.c: shifts of places and of the clock. */
void geometry_new(struct predictor *p);
void geometry_free(struct predictor *p);
/* The functionals in the space of a new base. */
enum bf_status geometry_rebase(struct predictor *p, struct bf_error *err);
/* Space, functionals, clock of every grid, and what their derivatives need, at the parameters of the run. */
enum bf_status geometry_evaluate(const struct run *run, struct bf_error *err);

/* predict_drive.c: what reaches the beam through amplifiers and patches; fills U and changes of every record. */
enum bf_status drives_evaluate(const struct run *run, struct bf_error *err);

/* predict_base.c: the clamp of a record, false: it is at rest; and what it adds to y and the Jacobian of every channel. */
bool clamp_new(const struct run *run, size_t record, struct clamp *out);
void clamp_free(struct clamp *clamp);
enum bf_status predict_base(const struct run *run, struct bf_error *err);

/* predict_bind.c: plans[] and channels[] of all records; an effect that acts on no channel is an error. */
enum bf_status predictor_bind(struct predictor *p, struct bf_error *err);

/* Filters of a channel: F[m] on the grid (1 without filters); *any says whether there are filters. */
enum bf_status channel_filter(const struct run *run, size_t record, size_t output, const double complex s[], size_t m,
                              double complex F[], bool *any, struct bf_error *err);
/* dF/ds[m] of the same. */
enum bf_status channel_filter_slope(const struct run *run, size_t record, size_t output, const double complex s[],
                                    size_t m, double complex slope[], struct bf_error *err);
/* dF[m] by one parameter; false when F does not depend on it. */
bool channel_filter_derivative(const struct run *run, size_t record, size_t output, size_t parameter,
                               const double complex s[], size_t m, double complex dF[]);
/* Maps and signals, in the time domain, on y and on every wanted column of the Jacobian. */
enum bf_status channel_samples(const struct run *run, const struct predict_channel *channel, struct bf_error *err);

/*
 * predict_map.c: maps that bend a channel, before the recorder's filter. map_bends: does the slope of effect's map differ
 * between the samples v[n] (u[n] the patch input, or NULL)? Shifts and gains need no finer grid. map_bend: that map on the
 * channel's y and on every wanted column of the Jacobian; one transform of 4 n points up and one down for each.
 */
bool map_bends(const struct beam_effect *effect, const double parameters[], const double v[], const double u[],
               size_t n);
enum bf_status map_bend(const struct run *run, const struct predict_channel *channel, size_t e,
                        const double parameters[], const double u[], struct bf_error *err);

/* predict_linear.c: the response to the recorded inputs, all channels of all records. */
enum bf_status predict_linear(const struct run *run, struct bf_error *err);
/* predict_state.c: unknown initial states. states_count: once, at the first base; states_find: modes and signs of a run. */
void states_count(struct predictor *p);
void states_free(struct predictor *p);
void states_find(struct predictor *p);
/* The unknowns of a record: the modes' come first, two for each, then those of the channels' filters, then those of the motion as a whole. */
size_t state_unknowns(const struct predictor *p, size_t record);
/* Every record's columns become zero in its own rows; the others never hold anything. Before each run. */
void states_clear(struct predictor *p);
size_t state_modes_of(const struct predictor *p, size_t record);
/* Terms of a free beam's motion as a whole, in each channel. */
enum { WHOLE_TERMS = 3 };
/* Of the recorder's filter, n_rings on each channel. */
size_t recorder_unknowns(const struct predictor *p, size_t record);
size_t whole_unknowns(const struct predictor *p, size_t record);
/* The prediction is not linear in initial states: what the laws and maps do depends on them. */
bool states_bend(const struct predictor *p);
/* A free decay whose state is not known yet: no law can be stepped from it. */
bool state_at_rest(const struct predictor *p, size_t record);
/* What the recorder's filter took off mode i of the record, to be brought back; 1 where none is stated. */
double complex state_to_beam(const struct run *run, size_t record, double complex pole);
/* Effect e gives this output a filter with memory. */
bool filter_remembers(const struct predictor *p, size_t e, size_t output);
/* The whole prediction becomes that without Σ amplitude · column, which struct prediction leaves out. */
void states_take_out(const struct run *run);

/* predict_decay.c: columns of the initial states of a record, and their derivative at the amplitudes. */
enum bf_status predict_decay(const struct run *run, size_t record, struct bf_error *err);
/* predict_law.c: the response to nonlinear forces, added to y and the Jacobian. */
enum bf_status laws_new(struct predictor *p, struct bf_error *err);
void laws_free(struct predictor *p);
/* dg of every coordinate by a parameter gains scale · (its g in a moved space). */
void laws_add_moved(const struct run *run, const struct model *model, const struct reduced *reduced, size_t parameter,
                    double scale);
enum bf_status predict_laws(const struct run *run, struct bf_error *err);

#endif
