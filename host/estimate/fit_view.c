/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The problem of a fit as the optimiser sees it: ½‖r‖², gradient and JᵀJ, with the rows of priors. */
#include <math.h>
#include "maths/maths.h"
#include "fit_problem.h"
#include "ground/ground.h"

static double prior_square(const struct fit_problem *p, const double x[])
{
    double sum = 0.0;
    for (size_t i = 0; i < p->n_unknowns; i++)
        if (p->unknowns[i].prior > 0.0)
            sum += pow((x[i] - p->unknowns[i].prior_x) / p->unknowns[i].prior, 2.0);
    return 0.5 * sum * p->prior_scale;
}

/* Times the noise's ½‖r‖²: more is an error of form. Facts in a channel: amplitude and phase of the modes in its band, some ten. */
static const double noise_accounts = 2.0, facts_a_channel = 20.0;

/* ½‖r‖² of noise alone. */
static double noise_square(const struct fit_problem *p)
{
    return 0.5 * (p->noise_rows + (double)lines_used(p->lines));
}

/* Of each channel, and as many of each group of lines, if it has them. */
static double facts(const struct fit_problem *p)
{
    double sum = facts_a_channel * (double)p->n_signals;
    for (size_t g = 0; p->lines != NULL && g < p->lines->n_groups; g++)
        sum += fmin(facts_a_channel, (double)p->lines->groups[g].n);
    return sum;
}

double fit_problem_form_scale(const struct fit_problem *p)
{
    const double form = p->half_square - noise_accounts * noise_square(p);
    return fmax(1.0, form / (0.5 * facts(p)));
}

double fit_problem_spread(const struct fit_problem *p)
{
    return fmax(fit_problem_form_scale(p), fit_problem_mean_square(p));
}

void fit_problem_end_within(const struct fit_problem *p, double nats, struct optimise_options *options)
{
    options->relative = nats / (double)p->n_rows;
    options->form = nats / (0.5 * facts(p));
    options->noise = noise_accounts * noise_square(p);
}

void fit_problem_weigh_priors(struct fit_problem *p, const double x[])
{
    struct bf_error ignored;
    double square;
    bool any = false;
    for (size_t i = 0; i < p->n_unknowns; i++)
        any = any || p->unknowns[i].prior > 0.0;
    p->prior_scale = 1.0;
    if (!any || fit_problem_evaluate(p, x, false, &square, &ignored) != BF_OK)
        return;
    p->prior_scale = fit_problem_form_scale(p);
}

/* In the stage of whole records, its rows weighed as they would be now, with a value at x. */
static bool is_whole(const struct fit_problem *p, const double x[])
{
    bool same = p->shares == NULL && !(p->decay_ps > 0.0) && !(p->floor > 0.0);
    for (size_t r = 0; r < p->n_records && same; r++)
        same = p->weighed_s[r] >= p->horizon_s[r] && p->weighed_s[r] <= p->horizon_s[r];
    return same && fit_problem_holds(p, x) && fit_problem_moved(p, x) < fit_problem_unmoved;
}

enum bf_status fit_problem_whole(struct fit_problem *p, const double x[], struct bf_error *err)
{
    if (is_whole(p, x))
        return BF_OK;
    const enum bf_status status = fit_problem_stage(p, 0.0, 0.0, x, err);
    if (!status)
        fit_problem_weigh_priors(p, x);
    return status;
}

static enum bf_status view_value(void *context, const double x[], double *half_square, struct bf_error *err)
{
    struct fit_problem *p = context;
    const enum bf_status status = fit_problem_evaluate(p, x, false, half_square, err);
    *half_square += prior_square(p, x);
    return status;
}

static enum bf_status view_derivative(void *context, const double x[], double *half_square, double gradient[],
                                      double gram[], struct bf_error *err)
{
    struct fit_problem *p = context;
    const size_t n = p->n_unknowns;
    enum bf_status status = BF_OK;
    if (fit_problem_moved(p, x) > p->rebase_limit)
        status = fit_problem_rebase(p, x, err);
    if (!status)
        status = fit_problem_evaluate(p, x, true, half_square, err);
    if (status)
        return status;
    *half_square += prior_square(p, x);
    dense_gram(p->n_jacobian, n, p->jacobian, gram);
    dense_gemv(true, p->n_jacobian, n, 1.0, p->jacobian, p->beside, 0.0, gradient);
    for (size_t i = 0; i < n; i++) {
        const struct unknown *u = &p->unknowns[i];
        if (!(u->prior > 0.0))
            continue;
        const double precision = p->prior_scale / (u->prior * u->prior);
        gradient[i] += precision * (x[i] - u->prior_x);
        gram[i + i * n] += precision;
    }
    for (size_t i = 0; i < n; i++) {
        gradient[i] = p->held[i] ? 0.0 : gradient[i];
        for (size_t j = 0; j < n && p->held[i]; j++)
            gram[i + j * n] = gram[j + i * n] = 0.0;
    }
    return BF_OK;
}

bool fit_problem_interrupted(const struct fit_problem *p)
{
    return p->stop || progress_interrupted() || (p->interrupted && p->interrupted(p->context)) ||
           (p->most_runs > 0 && p->runs >= p->most_runs);
}

void fit_problem_do_not_count(struct fit_problem *p, size_t before)
{
    if (p->most_runs > 0)
        p->most_runs += p->runs - before;
}

static bool view_interrupted(void *context)
{
    return fit_problem_interrupted(context);
}

struct least_squares fit_problem_view(struct fit_problem *p)
{
    return (struct least_squares){.n = p->n_unknowns,
                                  .lower = p->lower,
                                  .upper = p->upper,
                                  .context = p,
                                  .value = view_value,
                                  .derivative = view_derivative,
                                  .interrupted = view_interrupted};
}

double fit_problem_mean_square(const struct fit_problem *p)
{
    return p->n_used ? 2.0 * p->half_square / (double)p->n_used : 0.0;
}
