/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predict_work.h — what the predict_*.c files share; for nobody else. See predict.h. */
#ifndef BEAMFIT_PREDICT_WORK_H
#define BEAMFIT_PREDICT_WORK_H

#include <complex.h>
#include "law.h"
#include "predict.h"
#include "response.h"
#include "system.h"

/* A record bound to the model, in the current window. */
struct record_plan {
    const struct record *record;
    size_t start, n; /* rows are samples start … start + n − 1 */
    size_t grid;     /* index into predictor->grids */
    bool free_decay;
    const double **input;  /* [n_inputs] column of the record or NULL */
    double complex **U;    /* [n_inputs][m] transforms of the inputs in this window, NULL where absent */
    size_t first_nuisance; /* of a free decay */
    size_t first_channel, n_channels;
};

/* α = gᵀφ of one functional and its derivative by every structural parameter. */
struct functional {
    double *g;               /* [n] */
    double complex *alpha;   /* [n_poles] */
    double complex *d_alpha; /* [n_parameters][n_poles], where the system depends on the parameter */
};

struct predictor {
    struct model model; /* own copy: parameters of the base */
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
    struct response_kernel **kernels;    /* [n_grids] at the current parameters */
    struct functional *inputs, *outputs; /* [n_inputs], [n_outputs] */
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

/* α = gᵀφ of each and its derivatives, at the system as last evaluated. */
void functionals_evaluate(const struct run *run, struct functional list[], size_t count);
int output_order(enum output_kind kind); /* time derivatives of the deflection: 0, 1, 2 */
double input_gain(const struct run *run, size_t input, size_t *parameter); /* KB and where it stands; 1 and SIZE_MAX */
double output_gain(const struct run *run, size_t output, size_t *parameter); /* Ks likewise */

/* predict_bind.c: plans[] and channels[] of all records; an effect that acts on no channel is an error. */
enum bf_status predictor_bind(struct predictor *p, struct bf_error *err);

/* predict_channel.c: does effect e act on this output? */
bool effect_on_output(const struct model *model, size_t e, size_t output);
bool effect_on_input(const struct model *model, size_t e, size_t input);
/* Filters of a channel: F[m] on the grid (1 without filters); *any says whether there are filters. */
enum bf_status channel_filter(const struct run *run, size_t record, size_t output, const double complex s[], size_t m,
                              double complex F[], bool *any, struct bf_error *err);
/* dF[m] by one parameter; false when F does not depend on it. */
bool channel_filter_derivative(const struct run *run, size_t record, size_t output, size_t parameter,
                               const double complex s[], size_t m, double complex dF[]);
/* Maps and signals, in the time domain, on y and on every wanted column of the Jacobian. */
enum bf_status channel_samples(const struct run *run, const struct predict_channel *channel, struct bf_error *err);

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
