/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Is it the computation that is wrong, not the physics? The baseline is predicted once more at its optimum, in a finer space
 * and, where it steps through time, with a finer step; linear unknowns (states of free decays, unknown levels) are solved again.
 */
#include "diagnose_work.h"

#include <math.h>
#include <stdlib.h>

#include "estimate/fit_problem.h"
#include "estimate/refit_law.h"

/*
 * Of the noise, rms on one channel. An error of this size raises a misfit of 1.00 times the noise to 1.04, just below
 * where a model stops being complete: anything smaller cannot be mistaken for physics.
 */
static const double fine_change = 0.3;
/* A misfit this many times the error of the computation is still physics: 1 % of its power is the computation's. */
static const double far_above = 10.0;
enum { USUAL_SPLINES = 160, USUAL_OVERSAMPLE = 8 };

struct finer {
    const char **names;
    struct parameter_ref *refs;
    struct predictor *predictor;
    struct fit_problem problem;
    double *x;
};

static void finer_free(struct finer *f)
{
    fit_problem_free(&f->problem);
    predictor_free(f->predictor);
    free(f->names), free(f->refs), free(f->x);
}

static enum bf_status finer_new(const struct diagnose_work *w, struct finer *f, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    const struct model *model = &d->baseline.model;
    struct predict_options options = w->options->predict;
    *f = (struct finer){.names = record_base_names(d->records, d->n_records)};
    const size_t n = model_parameters(model, f->names, d->n_records, &f->refs);
    options.quiet = true;
    options.threads = w->threads;
    enum bf_status status = predictor_new(model, d->records, d->n_records, &options, &f->predictor, err);
    if (status)
        return status;
    options.modes = 2 * predictor_modes(f->predictor);
    options.fine_splines = 2 * (options.fine_splines > 0 ? options.fine_splines : USUAL_SPLINES);
    options.oversample = 2 * (options.oversample > 0 ? options.oversample : USUAL_OVERSAMPLE);
    predictor_free(f->predictor);
    f->predictor = NULL;
    status = predictor_new(model, d->records, d->n_records, &options, &f->predictor, err);
    if (!status)
        status = fit_problem_new(&f->problem, model, f->predictor, d->records, d->n_records, f->names, f->refs, n,
                                 w->sigma, err);
    if (!status)
        f->x = bf_alloc(f->problem.n_unknowns, sizeof *f->x);
    return status;
}

/* rms over the rows in use of the change of one channel, in units of its noise. */
static double change_of(const struct misfit_channel *channel, const double fitted[], double sigma)
{
    double square = 0.0;
    for (size_t k = 0; k < channel->n; k++) {
        const double change = fitted[k] - (channel->measured[k] - channel->residual[k]);
        square += change * change;
    }
    return channel->n > 0 ? sqrt(square / (double)channel->n) / sigma : 0.0;
}

static void compare(const struct diagnose_work *w, const struct fit_problem *p, struct numerics *numerics)
{
    struct misfit_channel *channels = hypothesis_channels(w->d, &w->d->baseline);
    numerics->change = 0.0;
    for (size_t c = 0; c < p->n_channels; c++) {
        const double change = change_of(&channels[c], p->fitted + p->channels[c].row, w->sigma[c]);
        if (change > numerics->change) {
            numerics->change = change;
            numerics->channel = c;
        }
    }
    numerics->fine = numerics->change <= fine_change;
    free(channels);
}

enum bf_status diagnose_numerics(struct diagnose_work *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct finer f;
    double square;
    d->numerics = (struct numerics){.change = NAN, .steps = law_in_model(&d->baseline.model)};
    enum bf_status status = finer_new(w, &f, err);
    if (!status) {
        fit_problem_to_x(&f.problem, d->baseline.fit.value, f.x);
        status = fit_problem_stage(&f.problem, 0.0, 0.0, f.x, err);
    }
    if (!status)
        status = fit_problem_evaluate(&f.problem, f.x, false, &square, err);
    if (!status)
        compare(w, &f.problem, &d->numerics);
    d->evaluations += f.problem.runs;
    finer_free(&f);
    return status == BF_NUMERIC ? BF_OK : status; /* no value in the finer space: it remains unknown, and not fine */
}

bool diagnose_computed(const struct diagnosis *d)
{
    const double misfit = sqrt(fmax(d->baseline.fitted.noise_ratio * d->baseline.fitted.noise_ratio - 1.0, 0.0));
    return d->numerics.fine || misfit > far_above * d->numerics.change;
}
