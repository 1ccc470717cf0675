/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "attainable_or_warn.h"
#include "commands.h"
#include "compare/compare.h"
#include "estimate/estimate.h"
#include "factors_or_warn.h"
#include "findings_of.h"
#include "record_sets.h"
#include "repeats_or_warn.h"
#include "show/show.h"

static const char help[] =
    "Usage: beamfit fit MODEL RECORD... -o FITTED [--check RECORD...] [options]\n"
    "\n"
    "Estimates the model's free parameters from recordings by weighted least squares, and says how well each is\n"
    "known and what the records cannot determine. The start values are those of MODEL; they may be far off\n"
    "(handbook values), because the search begins with short windows of the records and widens them. A channel\n"
    "that points the other way, is in g, or off by 10 or 1000 is named first, with the line of MODEL to write;\n"
    "the fit is of MODEL as it is. A RECORD may be a list of measured frequencies (columns freq_Hz, and sd_Hz,\n"
    "damping_ratio, damping_sd where they are known) or a spectrum without phase (docs/records.md), alone or\n"
    "beside others.\n";

static const struct option_row options[] = {
    {'o', 'o', "output", "FITTED", NULL, "the fitted model: MODEL with new values, standard errors and a 'fit:' block"},
    RECORD_SETS_CHECK("records that are held out: compared, never fitted (all names up to the next option)"),
    {'s', 0, "start", "HOW", "given|near|search",
     "given: the values of MODEL (default); near: MODEL is nearly right, refine only; search: always "
     "search for other minima too. With 'given' that search runs by itself when the residual stays above "
     "1.1 times the noise"},
    {'g', 0, "global", NULL, NULL, "the same as --start search"},
    {'n', 0, "no-search", NULL, NULL, "never search, even when the noise floor is missed"},
    OPTION_INTERSAMPLE('i'),
    {'N', 0, "splines", "N[,uniform]", NULL,
     "elements of the spline space, 5 to 1000 (default 160, with double knots on the edges of regions). "
     "',uniform' spaces the knots evenly, whatever the edges: dimension N + 1 when one end is clamped; the "
     "seed paper's space is 9,uniform. To see what a coarse space does to the estimates; it makes them "
     "wrong"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace FITTED even when it is MODEL, `fit` has not made it, or somebody has changed it"},
    {OPTION_ALL, 'A', "all", NULL, NULL, "all columns: intervals of 95 % and start values, too"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Ctrl-C ends the search: the best values so far are reported and written, with converged: false.\n"
    "\n"
    "Example:\n"
    "  beamfit fit model.yaml tap1.csv tap2.csv -o fitted.yaml --check tap3.csv\n"
    "\n"
    "Exit status: 0 done (see 'converged'); 1 nothing was fitted, because the records determine no free parameter\n"
    "(an input that is zero) or all ended at bounds: FITTED is not written; 2 usage; 3 bad model or record, or\n"
    "FITTED not writable; 4 the model cannot be evaluated at the start values.\n";

struct arguments {
    const char *output;
    struct record_sets sets;
    struct fit_options fit;
};

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    static const char *const starts[] = {"given", "near", "search"}; /* order of enum fit_start */
    size_t chosen = 0;
    enum bf_status status = BF_OK;
    switch (code) {
    case 'o':
        a->output = optarg;
        break;
    case 's':
        status = options_choice("--start", optarg, starts, 3, &chosen, err);
        a->fit.start = (enum fit_start)chosen;
        break;
    case 'g':
        a->fit.start = FIT_SEARCH;
        break;
    case 'n':
        a->fit.never_search = true;
        break;
    case 'i':
        status = intersample_from_text(optarg, &a->fit.predict.intersample, err);
        break;
    case 'N':
        status = splines_from_text(optarg, &a->fit.predict, err);
        break;
    default:
        status = BF_USAGE;
    }
    return status;
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = record_sets_next(&a->sets, argc, argv, options, err)) != -1)
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    if (a->sets.fitted.n_names < 1)
        return bf_fail(err, BF_USAGE, "give a model and at least one record: beamfit fit MODEL RECORD... -o FITTED");
    if (!a->output)
        return bf_fail(err, BF_USAGE, "say where to write the fitted model: -o FITTED");
    if (options_one_answer(a->output, err) != BF_OK)
        return BF_USAGE;
    return BF_OK;
}

/* What a command owns while it runs. */
struct work {
    struct model model;
    struct fit_result result;
    struct channel_factors factors;   /* of the model as given */
    struct record_findings *findings; /* [n_fitted] */
    size_t n_fitted;
    struct repeatability repeats;
    struct fit_channel_error *check;
    size_t n_check;
    struct own_values own; /* of the held-out records */
};

static void work_free(struct work *w)
{
    free(w->check);
    own_values_free(&w->own);
    channel_factors_free(&w->factors);
    findings_free(w->findings, w->n_fitted);
    repeatability_free(&w->repeats);
    fit_free(&w->result);
    model_free(&w->model);
}

static enum bf_status answer(const struct arguments *a, const struct work *w, const struct fit_check *check,
                             struct bf_error *err)
{
    struct json *root = fit_json(&w->result, a->sets.fitted.records, check);
    channel_factors_json(root, &w->model, &w->factors);
    record_findings_json(root, a->sets.fitted.records, w->findings, a->sets.fitted.n);
    repeatability_json(root, &w->model, a->sets.fitted.records, &w->repeats);
    if (fit_learned(&w->result) && w->factors.n == 0) { /* else what is said first of all comes first */
        answer_next(root, "beamfit", "compare", a->output, a->sets.fitted.names[0], NULL);
        answer_next(root, "beamfit", "diagnose", a->output, a->sets.fitted.names[0], NULL);
    }
    if (strcmp(a->output, "-") != 0)
        return answer_print_and_free(root, fit_fields, err);
    answer_print_text(stderr, root, fit_fields); /* the model is on standard output */
    json_discard(root);
    return BF_OK;
}

/* What is ordinary about a held-out record that disagrees goes with the notes; nothing is said where it cannot be computed. */
static void note_disagreements(const struct arguments *a, struct work *w)
{
    const struct record_list *held_out = &a->sets.held_out;
    struct disagreements found;
    struct bf_error ignored;
    if (!disagreements_possible(w->check, w->n_check, w->result.nrmse))
        return;
    (void)disagreements_find(w->own.model, held_out->records, record_list_sampled(held_out), &a->fit.predict,
                             w->result.nrmse, &found, &ignored);
    w->own.notes = bf_grow(w->own.notes, w->own.n_notes + found.n, sizeof *w->own.notes);
    for (size_t i = 0; i < found.n; i++)
        w->own.notes[w->own.n_notes++] = bf_strdup(found.notes[i]);
    disagreements_free(&found);
}

/*
 * Begins with the model as given, because a fit may end where modes have left the band; with the fitted one where that is at the noise, and
 * little is left to search.
 */
static void add_attainable(const struct arguments *a, const struct fit_check *check, struct work *w)
{
    const struct record_list *fitted = &a->sets.fitted, *held_out = &a->sets.held_out;
    const size_t n_sampled = record_list_sampled(fitted);
    const bool wanted = !w->result.interrupted && n_sampled == fitted->n;
    const bool at_noise = compare_is_noise(w->result.noise_ratio - w->result.noise_doubt);
    if (at_noise)
        fit_into_model(&w->result, fitted->records, check, &w->model);
    if (wanted)
        attainable_or_warn(&w->model, fitted->records, n_sampled, held_out->records, record_list_sampled(held_out),
                           &w->result.attainable);
    if (!at_noise)
        fit_into_model(&w->result, fitted->records, check, &w->model);
}

static struct repeatability find_repeats(const struct work *w, const struct record records[], size_t n_records)
{
    double *rms = bf_alloc(n_records * w->model.n_outputs + 1, sizeof *rms);
    for (size_t c = 0; c < w->result.n_channels; c++)
        if (w->result.channels[c].record < n_records)
            repeats_noise(&w->model, w->result.channels[c].record, w->result.channels[c].name,
                          w->result.channels[c].noise, rms);
    const struct repeatability out = repeats_or_warn(&w->model, records, n_records, rms);
    free(rms);
    return out;
}

static enum bf_status fit_and_answer(const struct arguments *a, struct work *w, struct bf_error *err)
{
    const struct record *fitted = a->sets.fitted.records, *held_out = a->sets.held_out.records;
    const size_t n_held_out = a->sets.held_out.n, n_sampled = record_list_sampled(&a->sets.fitted);
    struct fit_check check = {.records = held_out, .n = n_held_out};
    progress_catch_interrupts();
    w->n_fitted = a->sets.fitted.n;
    w->findings = findings_of(&w->model, fitted, w->n_fitted);
    enum bf_status status = fit_run(&w->model, fitted, a->sets.fitted.n, &a->fit, &w->result, err);
    if (status)
        return status;
    factors_or_warn(&w->model, fitted, n_sampled, &a->fit.predict, &w->result, true, &w->factors);
    w->repeats = find_repeats(w, fitted, n_sampled);
    add_attainable(a, &check, w);
    status = own_values_find(&w->model, held_out, n_held_out, &a->fit, &w->own, err);
    if (!status)
        status = fit_errors(w->own.model, held_out, n_held_out, &a->fit, &w->check, &w->n_check, err);
    if (status)
        return status;
    check.channels = w->check, check.n_channels = w->n_check;
    note_disagreements(a, w);
    check.notes = w->own.notes, check.n_notes = w->own.n_notes;
    fit_into_model(&w->result, fitted, &check, &w->model);
    const bool learned = w->result.interrupted || fit_learned(&w->result);
    status = learned ? model_write(a->output, &w->model, err) : BF_OK;
    if (!status)
        status = answer(a, w, &check, err);
    if (status || learned)
        return status;
    return bf_fail(err, BF_NO,
                   "nothing was fitted: the records determine none of the free parameters; %s is not written (see the "
                   "warnings)",
                   a->output);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct work w = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    if (!status)
        status = model_read(a.sets.model, &w.model, err);
    if (!status)
        status = record_sets_read(&a.sets, &w.model, err);
    if (!status)
        status = atomic_check(a.output, err);
    if (!status)
        status = fit_and_answer(&a, &w, err);
    work_free(&w);
    record_sets_free(&a.sets);
    return status;
}

const struct command command_fit = {
    .place = 40,
    .name = "fit",
    .summary = "estimate a model's parameters from recordings; values, standard errors, what cannot be identified",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fit_fields,
    .run = run,
};
