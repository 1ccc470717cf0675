/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predict_work.h — what the predict_*.c files share; for nobody else. See predict.h. */
#ifndef BEAMFIT_PREDICT_WORK_H
#define BEAMFIT_PREDICT_WORK_H

#include <complex.h>
#include "response.h"
#include "law.h"
#include "kernel.h"
#include "beam/beam.h"

/* The recorder's anti-alias filter; order 0: not stated. */
struct recorder_filter {
    int order;
    double corner_samples; /* corner frequency × the stated sample interval */
    bool twice;            /* forward and backward */
};

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
    struct recorder_filter recorder;
    double complex *A;         /* [m] of that filter; NULL: not stated, or inputs are held */
    const double **input;      /* [n_inputs] column of the record or NULL */
    size_t *source;            /* [n_inputs] where the input acts in this record: index into predictor->inputs */
    double complex **recorded; /* [n_inputs][m] transforms of the inputs in this window, NULL where absent */
    double complex **driven;   /* [n_inputs][m] the same behind their drives; NULL where there is none */
    double complex **U;        /* [n_inputs] what reaches the beam: one of the two above, not owned */
    size_t n_changes;
    struct drive_change *changes;
    size_t first_nuisance; /* of a free decay */
    size_t first_channel, n_channels;
};

/* g depends on a parameter: dg. */
struct functional_change {
    size_t parameter;
    double *g; /* [n] */
};

/* α = gᵀφ of one functional and its derivative by every structural parameter. */
struct functional {
    double *g;               /* [n] */
    double complex *alpha;   /* [n_poles] */
    double complex *d_alpha; /* [n_parameters][n_poles], where the system or g depends on the parameter */
    size_t n_changes;
    struct functional_change *changes;
};

/* Shifts of places and of the clock at the parameters of the current run. */
struct geometry {
    double patch_shift_m;
    double clock;        /* the sample interval is this times what the records say */
    double *patch_by;    /* [n_parameters] d patch_shift_m */
    double *clock_by;    /* [n_parameters] d clock */
    bool patch_moves;    /* some effect shifts the patch */
    struct model fixed;  /* the model with its patch where the file has it */
    struct reduced base; /* when the patch moves: the space at the base; predictor->reduced follows the shift */
    double base_shift_m;
    double **block_by_shift; /* [n_blocks][n × n] derivative of every block by the patch's shift */
};

/* An input at its place in one record, or in all that do not shift it. */
struct source {
    size_t input, record; /* record SIZE_MAX: all */
};

struct predictor {
    struct model model; /* own copy: parameters of the base, its patch where the current run has it */
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
    size_t n_sources; /* the model's inputs; then one for each record's point force that is shifted in that record */
    struct source *sources;
    struct functional *inputs, *outputs; /* [n_sources], [n_outputs] */
    struct functional *base_load;        /* of a shaken clamp; NULL: none shakes */
    struct law *laws;                    /* [n_effects]: members zero for effects without a law */
    size_t n_coordinates;
    struct functional *coordinates; /* of all laws, in order of effects */
    bool *moves;                    /* [n_parameters] moves the place of a law */
    size_t n_rows, n_nuisance;
    double *y, *jacobian, *nuisance, *amplitude;
    double t_end_s;
    bool nonlinear; /* some effect has a law or a drive */
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

/* The system's derivative by this parameter is not zero and was asked for. */
static inline bool run_structural(const struct run *run, size_t parameter)
{
    return run_wants(run, parameter) && (run->p->system->derivative[parameter].Z != NULL || run->p->moves[parameter]);
}

static inline double *run_column(const struct run *run, size_t parameter, const struct predict_channel *channel)
{
    return run->out->jacobian + parameter * run->out->n_rows + channel->row;
}

void kernels_new(struct predictor *p); /* at the system as evaluated */
void kernels_free(struct predictor *p);
/* Writes parameters into p->model. */
void predictor_use(struct predictor *p, const double theta[]);

/* predict_functional.c */
struct functional *functionals_new(size_t count, size_t n);
void functionals_free(struct functional **list, size_t count);
/* dg by a parameter, [n], zero when it is new. */
double *functional_change(struct functional *f, size_t n, size_t parameter);
/* f, or the system it is taken of, depends on this parameter, and the run wants that derivative. */
bool functional_depends(const struct run *run, const struct functional *f, size_t parameter);
/* α = gᵀφ of each and its derivatives, at the system as last evaluated. */
void functionals_evaluate(const struct run *run, struct functional list[], size_t count);
int output_order(enum output_kind kind); /* time derivatives of the deflection: 0, 1, 2 */
double input_gain(const struct run *run, size_t input, size_t *parameter); /* KB and where it stands; 1 and SIZE_MAX */
double output_gain(const struct run *run, size_t output, size_t *parameter); /* Ks likewise */

/* predict_geometry.c: shifts of places and of the clock. */
void geometry_new(struct predictor *p);
void geometry_free(struct predictor *p);
/* The model with its patch where the file has it; to be freed. */
void geometry_original(const struct predictor *p, struct model *out);
/* The patch of p->model at its shift; called before the space of a base is made. */
enum bf_status geometry_place(struct predictor *p, const double theta[], struct bf_error *err);
/* The functionals in the space of a new base. */
enum bf_status geometry_rebase(struct predictor *p, struct bf_error *err);
/* Space, functionals, clock of every grid, and what their derivatives need, at the parameters of the run. */
enum bf_status geometry_evaluate(const struct run *run, struct bf_error *err);
/* Shift of an input in a record, and its derivative by a parameter. */
enum bf_status geometry_input_shift(const struct predictor *p, size_t record, size_t input, const double theta[],
                                    double *shift_m, struct bf_error *err);

/*
 * predict_recorder.c. What is not linear felt its input before the recorder's filter: undo it on a spectrum [m], as far as
 * that can be told, and apply it to what comes of it. Both do nothing where the record states no filter.
 */
struct recorder_filter recorder_filter_read(const struct record *record);
void recorder_plan(struct record_plan *plan, const struct response_grid *grid); /* fills A for a window */
void recorder_undo(const struct record_plan *plan, size_t m, double complex U[]);
void recorder_apply(const struct record_plan *plan, size_t m, double complex Y[]);
/* The same at one frequency; order > 0. */
double complex recorder_at(const struct recorder_filter *filter, double cycles_per_sample);
double complex recorder_inverse(double complex A);

/* predict_drive.c: what reaches the beam through amplifiers and patches; fills U and changes of every record. */
bool input_driven(const struct model *model, size_t input);
enum bf_status drives_evaluate(const struct run *run, struct bf_error *err);

/* Gain, drive or tone of an input of this record depends on the parameter: beside what the system does. */
bool source_depends(const struct run *run, size_t record, size_t parameter);

/* predict_base.c: the shaken clamp. Adds the motion relative to it, order-th time derivative, at t = k h_s. */
void base_response_add(const struct run *run, size_t record, const struct functional *f, int order, double h_s,
                       size_t n, double out[]);
bool base_derivative_add(const struct run *run, size_t record, const struct functional *f, int order, size_t parameter,
                         double h_s, size_t n, double out[]);
/* Adds its part to y and the Jacobian of every channel. */
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
/* predict_decay.c: columns of the initial modal states of free decays, and their derivative at the amplitudes. */
size_t decay_unknowns(const struct predictor *p, size_t record);
enum bf_status predict_decay(const struct run *run, size_t record, struct bf_error *err);
/* predict_law.c: the response to nonlinear forces, added to y and the Jacobian. */
enum bf_status laws_new(struct predictor *p, struct bf_error *err);
void laws_free(struct predictor *p);
enum bf_status predict_laws(const struct run *run, struct bf_error *err);

#endif
