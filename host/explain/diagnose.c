/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnose_relatives.h"
#include "diagnose_shortlist.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "ground/ground.h"

/* Refits of single effects, at most. */
static const size_t most_singles[] = {[KIND_LINEAR] = 6, [KIND_NONLINEAR_CHAIN] = 3, [KIND_LAW] = 4};
/* Parts of the progress bar. */
static const double part_baseline = 0.15, part_singles = 0.45, part_places = 0.05;

static void set_progress(struct diagnose_state *w, double done, const char *note)
{
    w->done = done;
    if (w->bar)
        progress_stage(w->bar, done, note);
}

static enum bf_status test_linearity(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    return linearity_test(d->model, d->records, d->n_records, NULL, &d->linearity, err);
}

/*
 * What would be named explains nearly all. What remains is asked for again from the model that has it (the answer says so), unless one more
 * effect promises to take most of it: pairs that take what the form of a true effect leaves cost more than all single effects together.
 */
static bool is_answered(struct diagnosis *d)
{
    diagnose_decide(d);
    return d->verdict == VERDICT_MISSING && d->hypotheses[0].explained >= search_limits.answer;
}

/* Where the misfit of a hypothesis is, mode by mode. */
static enum bf_status localise(const struct diagnosis *d, const struct hypothesis *h, struct localisation *out,
                               struct bf_error *err)
{
    struct misfit_channel *channels = hypothesis_channels(d, h);
    const enum bf_status status = localise_misfit(channels, d->n_channels, d->mode_Hz, d->n_modes, out, err);
    free(channels);
    return status;
}

/* What the first look has left is of the baseline that there was. */
static void forget_look(struct diagnose_state *w)
{
    shortlist_free(w->looked);
    w->looked = NULL;
}

/* Goes on with the rig free where the trial shows that it is to be. */
static enum bf_status free_rig(struct diagnose_state *w, enum rig_trial trial, bool *freed, struct bf_error *err)
{
    enum bf_status status = diagnose_free_rig(w, trial, freed, err);
    if (status || !*freed)
        return status;
    forget_look(w);
    localise_free(&w->d->where);
    return localise(w->d, &w->d->baseline, &w->d->where, err);
}

/* Far from the noise; and no linear model takes records of a nonlinear beam there, nor a rig that is free. */
static bool linear_may_do(const struct diagnosis *d)
{
    return diagnose_is_far(&d->baseline) && !diagnose_linear_is_out(d);
}

/* A ruler and a gauge are off by so much that a signal changes by some per cent: what leaves more of it is not the rig alone. */
static bool rig_may_do(const struct diagnosis *d)
{
    static const double by_a_rig = 0.3; /* of the signal */
    return linear_may_do(d) && d->baseline.fitted.nrmse <= by_a_rig;
}

/* Far from the noise the likeliest effects come first: what one of them explains asks for little more. */
static enum bf_status first_look(struct diagnose_state *w, struct bf_error *err)
{
    const bool wanted = linear_may_do(w->d) && !w->options->everything && !progress_interrupted();
    return wanted ? diagnose_first_look(w, err) : BF_OK;
}

static enum bf_status singles(struct diagnose_state *w, struct bf_error *err)
{
    enum bf_status status = diagnose_extend(w, &w->d->baseline, most_singles, part_singles, err);
    if (!status && !progress_interrupted())
        status = diagnose_steps(w, err);
    if (!status && !progress_interrupted())
        diagnose_special_cases(w);
    return status;
}

/* The first look has found something that takes most of the misfit. */
static bool has_leader(const struct diagnosis *d)
{
    return linear_may_do(d) && d->n_hypotheses > 0 && d->hypotheses[0].explained >= search_limits.half;
}

/* What leads leaves what the rig's own errors do, perhaps: it is fitted with the rig free before any other effect is looked at. */
static enum bf_status free_rig_first(struct diagnose_state *w, bool *freed, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *freed = false;
    if (rig_may_do(w->d) && !diagnose_explained(w->d, 1))
        status = free_rig(w, RIG_ALONE, freed, err);
    if (!status && !*freed && has_leader(w->d) && !diagnose_explained(w->d, 1))
        status = free_rig(w, diagnose_has_answer(w->d, 1) ? RIG_AND_BEST : RIG_AND_LEADER, freed, err);
    return status;
}

/* The best leaves no more than the noise of the fitted records: nothing more can be found in them, whatever it leaves of held-out ones. */
static bool fits_all(const struct diagnosis *d)
{
    return d->n_hypotheses > 0 && diagnose_errors_are_noise(&d->hypotheses[0].fitted, false) &&
           !(hypothesis_excess(&d->hypotheses[0].fitted) > 0.0);
}

/*
 * Single effects, and the rig. Unless one of the likeliest effects explains the records with the rig that the file has, it is asked whether
 * the rig alone does, or with what leads; and when no single effect explains them, whether the best of them do with it.
 */
static enum bf_status singles_and_rig(struct diagnose_state *w, bool *done, struct bf_error *err)
{
    bool freed = false, freed_later = false;
    enum bf_status status = first_look(w, err);
    *done = false;
    if (!status)
        status = free_rig_first(w, &freed, err);
    *done = freed && diagnose_is_complete(w->d);
    if (!status && !*done)
        status = singles(w, err);
    /* a rig that is free has nothing to take then; with a law finding that out takes long */
    const bool law_fits = fits_all(w->d) && hypothesis_has_law(&w->d->hypotheses[0]);
    if (!status && !freed && !diagnose_explained(w->d, 1) && !law_fits)
        status = free_rig(w, RIG_AND_BEST, &freed_later, err);
    if (!status && freed_later && !diagnose_explained(w->d, 1) && !diagnose_has_answer(w->d, 1))
        status = first_look(w, err);
    *done = *done || (freed_later && diagnose_is_complete(w->d));
    forget_look(w);
    return status;
}

/* With the rig free little is left by one effect: what a rig's other errors leave is no second effect. */
static bool rig_leaves_little(const struct diagnosis *d)
{
    return d->free_rig && d->n_hypotheses > 0 && d->hypotheses[0].explained >= 1.0 - search_limits.hundredth;
}

/*
 * Fits the baseline again from the best explanation, so that a local minimum of the baseline is not taken for missing physics. Where that finds a
 * minimum that is far lower, single effects are refitted from it, because a refit that began at the old one may have stayed there.
 */
static enum bf_status restart(struct diagnose_state *w, struct bf_error *err)
{
    const double before = hypothesis_excess(&w->d->baseline.fitted);
    bool lower;
    enum bf_status status = diagnose_restart(w, &lower, err);
    if (status || !lower)
        return status;
    localise_free(&w->d->where);
    status = localise(w->d, &w->d->baseline, &w->d->where, err);
    diagnose_rank(w->d, w->n_tried);
    const bool again = hypothesis_excess(&w->d->baseline.fitted) <= search_limits.half * before;
    if (!status && again && !diagnose_is_complete(w->d) && !progress_interrupted()) {
        status = singles(w, err);
        diagnose_drop_repeats(w->d);
    }
    diagnose_decide(w->d);
    return status;
}

/* The best leaves the noise of the fitted records, and what it leaves of the held-out ones a free linear model leaves, too: no second effect takes that. */
static bool nothing_is_left(const struct diagnosis *d)
{
    return d->n_hypotheses > 0 && diagnose_errors_are_noise(&d->hypotheses[0].fitted, false) &&
           diagnose_no_linear_outdoes(d);
}

/* A weak misfit tells a second effect only where the first takes half of it, and no third. */
static bool is_too_weak(const struct diagnosis *d, size_t n_effects)
{
    return !diagnose_is_far(&d->baseline) && (n_effects > 1 || d->hypotheses[0].explained < search_limits.half);
}

static enum bf_status search(struct diagnose_state *w, struct bf_error *err)
{
    const size_t most = w->options->most_effects > 0 ? w->options->most_effects : DIAGNOSE_EFFECTS;
    bool done;
    set_progress(w, part_baseline, "short list");
    enum bf_status status = singles_and_rig(w, &done, err);
    if (!status && !done && !progress_interrupted() && w->d->n_hypotheses > 0 && !diagnose_explained(w->d, 1))
        status = restart(w, err);
    for (size_t n = 1; n < most && !status && !done && !progress_interrupted(); n++) {
        w->answered = is_answered(w->d);
        if (w->d->n_hypotheses == 0 || !diagnose_more_wanted(w->d) || !diagnose_last_one_helped(w->d, n) ||
            rig_leaves_little(w->d) || nothing_is_left(w->d) || fits_all(w->d) || is_too_weak(w->d, n) ||
            (n > 1 && diagnose_explained(w->d, n)))
            break; /* what two explain needs no third */
        const bool by_modes = n == 1 && linear_may_do(w->d) && !diagnose_modes_clear_beam(w);
        if (by_modes)
            status = diagnose_pairs_by_modes(w, err);
        if (!status && !(by_modes && diagnose_explained(w->d, 2)))
            status = diagnose_one_more(w, n, err);
        if (!status && !progress_interrupted())
            status = diagnose_steps(w, err);
    }
    diagnose_rank(w->d, w->n_tried); /* by score: what is_answered() has named stands before the best set */
    if (!status && !progress_interrupted())
        status = diagnose_without_one(w, err);
    if (!status && !progress_interrupted())
        status = diagnose_exchange(w, err);
    if (!status && !progress_interrupted() && !is_answered(w->d) && !rig_leaves_little(w->d))
        status = diagnose_resonator(w, err);
    if (!status && !progress_interrupted())
        diagnose_special_sets(w);
    diagnose_drop_repeats(w->d);
    return status ? status : diagnose_hold_rig(w, err);
}

/* What a free linear model leaves of the fitted records, and then of those held out; without it the diagnosis goes on. */
static void find_attainable(struct diagnose_state *w)
{
    struct diagnosis *d = w->d;
    const size_t n_outputs = d->model->n_outputs;
    double *noise = bf_alloc(d->n_records * n_outputs + 1, sizeof *noise);
    struct bf_error ignored;
    set_progress(w, part_baseline, "a free linear model");
    for (size_t c = 0; c < d->n_channels; c++)
        noise[d->baseline.fit.channels[c].record * n_outputs + d->baseline.fit.channels[c].output] = d->noise[c].rms;
    if (w->options->free_model != NULL)
        d->attainable = attainable_copy(w->options->free_model);
    else if (attainable_find(d->model, d->records, d->n_records, noise, &d->attainable, &ignored) != BF_OK)
        attainable_free(&d->attainable);
    (void)attainable_each(d->model, d->records, d->n_records, noise, &d->attainable, &ignored);
    (void)attainable_check(d->model, d->records, d->n_records, noise, d->checks, d->n_checks, &d->attainable, &ignored);
    free(noise);
}

/* The force that the baseline lacks, for a verdict `unknown`. */
static enum bf_status reconstruct(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    struct predictor *predictor;
    struct motion motion;
    enum bf_status status =
        predictor_new(&d->baseline.model, d->records, d->n_records, &w->options->predict, &predictor, err);
    if (status)
        return status;
    status = motion_new(predictor, d->baseline.fit.value, w->sigma, 0.0, &motion, err);
    if (!status) {
        status = reconstruct_run(&motion, &d->reconstruction, err);
        d->reconstructed = !status;
        motion_free(&motion);
    }
    predictor_free(predictor);
    return status == BF_USAGE ? BF_OK : status;
}

static void work_free(struct diagnose_state *w)
{
    for (size_t c = 0; w->check_noise && c < w->n_check_channels; c++)
        noise_free(&w->check_noise[c]);
    free(w->check_noise), free(w->whiteners), free(w->sigma), free(w->check_sigma);
    forget_look(w);
    diagnose_modes_free(w);
    diagnose_side_free(&w->other);
}

/* Checks what is about to be named: refits from other places, the baseline again, cross-validation. */
static enum bf_status confirm(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    enum bf_status status = BF_OK;
    if (d->n_named > 0 && d->hypotheses[0].n_effects > 1) {
        status = diagnose_members_from_given(w, err);
        d->interrupted = progress_interrupted();
        diagnose_decide(d);
    }
    if (!status && d->n_named > 0) {
        status = diagnose_other_places(w, part_places, err);
        d->interrupted = progress_interrupted();
        diagnose_decide(d);
    }
    if (!status && d->n_named > 0 && !d->interrupted) {
        status = diagnose_hold_supports(w, err);
        diagnose_decide(d);
    }
    if (!status && d->n_named > 0)
        status = restart(w, err);
    if (!status && !d->interrupted && diagnose_computed(d))
        diagnose_cross(w, fmax(1.0 - w->done, 0.0));
    return status;
}

/* What is known before any effect is tried. */
static enum bf_status look(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    set_progress(w, 0.0, "baseline");
    enum bf_status status = diagnose_noise(w, err);
    if (!status)
        status = diagnose_baseline(w, err);
    if (!status && !progress_interrupted())
        status = diagnose_resolve(w, err);
    if (!status)
        status = test_linearity(w, err);
    if (!status && !progress_interrupted()) {
        find_attainable(w);
        status = diagnose_baseline_by_modes(w, err);
    }
    if (!status)
        status = localise(d, &d->baseline, &d->where, err);
    d->interrupted = d->interrupted || progress_interrupted();
    return status;
}

/*
 * At the noise, as good as any linear model, linear as far as the records tell, and no signal is added: nothing to search for. Where the fitted records leave no misfit at all
 * no effect can be named either: diagnose_decide() names only what explains half of it.
 */
static bool nothing_to_find(const struct diagnosis *d)
{
    const bool no_misfit = !(hypothesis_misfit(&d->baseline.fitted) > 0.0);
    const bool as_good = diagnose_no_linear_misses(d) || diagnose_no_linear_predicts(d) ||
                         diagnose_floor_is_doubtful(d) || d->baseline.open_values;
    return diagnose_is_complete(d) && (no_misfit || (as_good && d->linearity.n_added == 0));
}

static enum bf_status stages(struct diagnose_state *w, struct bf_error *err)
{
    struct diagnosis *d = w->d;
    enum bf_status status = look(w, err);
    const bool searched = w->options->everything || !nothing_to_find(d);
    if (!status && !d->interrupted && diagnose_computed(d) && searched)
        status = search(w, err);
    d->interrupted = d->interrupted || progress_interrupted();
    if (status)
        return status;
    diagnose_decide(d);
    status = confirm(w, err);
    if (!status && d->verdict == VERDICT_UNKNOWN && !d->interrupted && diagnose_computed(d))
        status = reconstruct(w, err);
    if (!status && !d->interrupted && diagnose_computed(d))
        status = diagnose_by_record(w, err);
    if (!status && d->n_hypotheses > 0)
        status = localise(d, &d->hypotheses[0], &d->remains, err);
    if (!status)
        d->text = diagnose_words(d);
    return status;
}

enum bf_status diagnose_run(const struct model *model, const struct record records[], size_t n_records,
                            const struct record checks[], size_t n_checks, const struct diagnose_options *options,
                            struct diagnosis *out, struct bf_error *err)
{
    static const struct diagnose_options defaults;
    struct timespec begin, end;
    *out = (struct diagnosis){
        .model = model, .records = records, .n_records = n_records, .checks = checks, .n_checks = n_checks};
    out->check_kind = n_checks > 0 ? CHECK_RECORDS : CHECK_NONE;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    struct diagnose_options own = options ? *options : defaults;
    struct diagnose_state w = {.d = out, .options = &own, .predict = &own.predict};
    w.threads = workers_wanted(w.options->threads);
    w.bar = w.options->quiet ? NULL : progress_begin("diagnose");
    const enum bf_status status = stages(&w, err);
    if (w.bar)
        progress_end(w.bar);
    work_free(&w);
    clock_gettime(CLOCK_MONOTONIC, &end);
    out->seconds = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    return status;
}

void diagnose_free(struct diagnosis *d)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        hypothesis_free(&d->hypotheses[i]);
    hypothesis_free(&d->baseline);
    for (size_t i = 0; i < d->n_by_record; i++)
        hypothesis_free(&d->by_record[i]);
    for (size_t c = 0; d->noise && c < d->n_channels; c++)
        noise_free(&d->noise[c]);
    linearity_free(&d->linearity);
    localise_free(&d->where), localise_free(&d->remains);
    attainable_free(&d->attainable);
    model_free(&d->rig);
    if (d->reconstructed)
        reconstruct_free(&d->reconstruction);
    free(d->hypotheses), free(d->noise), free(d->facts), free(d->text);
    *d = (struct diagnosis){0};
}
