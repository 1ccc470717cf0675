/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "compare/compare.h"
#include "explain/explain.h"
#include "factors_or_warn.h"
#include "findings_of.h"
#include "ground/ground.h"
#include "record_sets.h"
#include "repeats_or_warn.h"
#include "show/show.h"

static const char help[] =
    "Usage: beamfit diagnose MODEL RECORD... [--check RECORD...] [options]\n"
    "\n"
    "Says whether physics is missing from a model, where it shows, which effect of the catalogue it is, how sure\n"
    "that is, how much of the misfit it explains, and what remains. The model is fitted, then effects are added,\n"
    "one by one and in sets, and everything is fitted again. What stands out of the others is named with its\n"
    "probability. Wrong signs and units are named and put right.\n";

static const struct option_row options[] = {
    RECORD_SETS_CHECK(
        "records that are held out: predicted, never fitted (all names up to the next option). With them the "
        "answer is far safer: give excitations unlike those fitted. Without them and with two or more records "
        "each record is left out in turn and predicted by a fit to the others."),
    {'w', 0, "without", "ID,ID...", NULL, "effects that are not considered"},
    {'e', 0, "effects", "N", "1|2|3", "effects in one explanation, at most (1 to 3, default 3)"},
    {'o', 'o', "output", "NEW", NULL,
     "writes the model with the named effects at the values found; the fitted model when none is named"},
    {'p', 0, "plot", "DIR", NULL,
     "pictures: decay (amplitude in time, frequency and damping against it), misfit before and after, ranking, the "
     "missing force"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace outputs that are not its own"},
    {'a', 0, "everything", NULL, NULL, "fit every candidate, short-listed or not (slow; for comparison)"},
    OPTION_INTERSAMPLE('i'),
    {'s', 0, "splines", "N[,uniform]", NULL, "elements of the spline space, 5 to 1000 (default 160)"},
    {'n', 0, "oversample", "N", NULL,
     "steps a sample of nonlinear effects, 1 to 64 (default: the model's steps_per_sample, else 8 for "
     "forces at a point and 4 over the span, and more where the best laws need them)"},
    {'t', 0, "threads", "N", NULL, "default: one a processor"},
    {OPTION_ALL, 'A', "all", NULL, NULL, "text with every candidate, not the best twelve"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Verdicts: complete (nothing is missing that the records could show), missing (one explanation stands out),\n"
    "ambiguous (the cause is probably among the listed ones), unknown (something is missing and no effect stands\n"
    "out). Ctrl-C ends the search: what is known so far is reported, nothing is named (\"interrupted\": true).\n"
    "\n"
    "Example:\n"
    "  beamfit diagnose fitted.yaml hit1.csv chirp1.csv --check hit2.csv --plot pictures\n"
    "\n"
    "Exit status: 0 done, whatever the verdict, or interrupted; 2 usage; 3 bad model or record; 4 the model\n"
    "cannot be evaluated.\n";

struct arguments {
    struct record_sets sets;
    char *without_text;
    const char **without; /* n_without of the options */
    const char *plot, *output;
    struct diagnose_options options;
};

static enum bf_status take_without(struct arguments *a, const char *text, struct bf_error *err)
{
    free(a->without_text);
    a->without_text = bf_strdup(text);
    a->options.n_without = 0;
    char *rest = NULL;
    for (char *id = strtok_r(a->without_text, ",", &rest); id != NULL; id = strtok_r(NULL, ",", &rest)) {
        if (effect_find(id, err) == NULL)
            return BF_USAGE;
        a->without = bf_grow(a->without, a->options.n_without + 1, sizeof *a->without);
        a->without[a->options.n_without++] = id;
    }
    a->options.without = a->without;
    return BF_OK;
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    enum { MOST_THREADS = 256, MOST_STEPS = 64 };
    long count = 0;
    enum bf_status status = BF_OK;
    switch (code) {
    case 'w':
        return take_without(a, optarg, err);
    case 'e':
        status = options_count("--effects", optarg, 1, DIAGNOSE_EFFECTS, &count, err);
        a->options.most_effects = (size_t)count;
        return status;
    case 't':
        status = options_count("--threads", optarg, 1, MOST_THREADS, &count, err);
        a->options.threads = (int)count;
        return status;
    case 'n':
        status = options_count("--oversample", optarg, 1, MOST_STEPS, &count, err);
        a->options.predict.oversample = (int)count;
        return status;
    case 's':
        return splines_from_text(optarg, &a->options.predict, err);
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'p':
        a->plot = optarg;
        return BF_OK;
    case 'a':
        a->options.everything = true;
        return BF_OK;
    case 'i':
        return intersample_from_text(optarg, &a->options.predict.intersample, err);
    default:
        return BF_USAGE;
    }
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = record_sets_next(&a->sets, argc, argv, options, err)) != -1)
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    if (a->sets.fitted.n_names < 1)
        return bf_fail(err, BF_USAGE, "give a model and at least one record: beamfit diagnose MODEL RECORD...");
    return BF_OK;
}

static enum bf_status write_found(const struct arguments *a, const struct diagnosis *diagnosis, struct bf_error *err)
{
    struct model found;
    enum bf_status status = diagnose_found(diagnosis, &found, err);
    if (!status)
        status = model_write(a->output, &found, err);
    model_free(&found);
    return status;
}

/* What is ordinary about held-out records that disagree with what was found; nothing where it cannot be computed. */
static void find_disagreements(const struct arguments *a, const struct diagnosis *diagnosis, struct disagreements *out)
{
    const struct record_list *held_out = &a->sets.held_out;
    struct model found;
    struct bf_error ignored;
    *out = (struct disagreements){0};
    if (held_out->n == 0 || diagnosis->interrupted || diagnose_found(diagnosis, &found, &ignored) != BF_OK)
        return;
    (void)disagreements_find(&found, held_out->records, held_out->n, &a->options.predict, found.fit.nrmse, out,
                             &ignored);
    model_free(&found);
}

static struct repeatability find_repeats(const struct model *model, const struct diagnosis *diagnosis)
{
    double *rms = bf_alloc(diagnosis->n_records * model->n_outputs + 1, sizeof *rms);
    struct misfit_channel *channels = hypothesis_channels(diagnosis, &diagnosis->baseline);
    for (size_t c = 0; c < diagnosis->n_channels; c++)
        repeats_noise(model, channels[c].record, channels[c].channel, channels[c].noise->rms, rms);
    const struct repeatability out = repeats_or_warn(model, diagnosis->records, diagnosis->n_records, rms);
    free(channels), free(rms);
    return out;
}

static enum bf_status print(const struct arguments *a, const struct model *model, const struct diagnosis *diagnosis,
                            const struct channel_factors *factors, struct bf_error *err)
{
    struct disagreements held_out;
    struct record_findings *findings = findings_of(model, a->sets.fitted.records, a->sets.fitted.n);
    struct repeatability repeats = find_repeats(model, diagnosis);
    find_disagreements(a, diagnosis, &held_out);
    struct json *root = diagnose_json(diagnosis, a->output, factors),
                *notes = json_put(root, "notes", json_new_array());
    for (size_t i = 0; i < held_out.n; i++)
        json_push_text(notes, held_out.notes[i]);
    channel_factors_json(root, model, factors);
    record_findings_json(root, a->sets.fitted.records, findings, a->sets.fitted.n);
    repeatability_json(root, model, a->sets.fitted.records, &repeats);
    const enum bf_status status = answer_print_and_free(root, diagnose_fields, err);
    for (size_t i = 0; i < held_out.n; i++)
        bf_warn("%s", held_out.notes[i]);
    disagreements_free(&held_out);
    findings_free(findings, a->sets.fitted.n);
    repeatability_free(&repeats);
    return status;
}

/* BF_BAD_FILE: nothing drives any of the records, so that every model explains them. */
static enum bf_status say_silent_records(const struct model *model, const struct record_list *fitted,
                                         struct bf_error *err)
{
    static const char why[] =
        "every input is zero throughout, so the model predicts silence: is it the right column, or a "
        "free decay (beamfit import --free-decay)?";
    size_t silent = 0;
    for (size_t r = 0; r < fitted->n; r++)
        silent += !record_is_driven(model, &fitted->records[r]);
    if (silent == fitted->n)
        return bf_fail(err, BF_BAD_FILE, "%s: %s", fitted->names[0], why);
    for (size_t r = 0; r < fitted->n; r++)
        if (!record_is_driven(model, &fitted->records[r]))
            bf_warn("%s: %s", fitted->names[r], why);
    return BF_OK;
}

static enum bf_status run_with(const struct arguments *a, const struct model *model, struct diagnosis *out,
                               struct bf_error *err)
{
    const struct record_list *fitted = &a->sets.fitted, *held_out = &a->sets.held_out;
    return diagnose_run(model, fitted->records, fitted->n, held_out->records, held_out->n, &a->options, out, err);
}

/*
 * A clamp that gives, or a mass, may turn what leads into what lags, so that another sign or size of a channel is the better of two wrong models: much remains
 * with it, and no effect explains that.
 */
static bool factors_are_doubtful(const struct channel_factors *factors, const struct diagnosis *diagnosis)
{
    for (size_t i = 0; i < factors->n; i++)
        if (factors->all[i].kind != FACTOR_CHANNEL)
            return false;
    return factors->n > 0 && diagnosis->verdict == VERDICT_UNKNOWN && !diagnosis->interrupted &&
           diagnose_is_far(&diagnosis->baseline);
}

static double left_at_best(const struct diagnosis *diagnosis)
{
    return diagnosis->n_hypotheses > 0 ? diagnosis->hypotheses[0].fitted.nrmse : diagnosis->baseline.fitted.nrmse;
}

/* The diagnosis of the model as it was given, where that finds a cause and explains more; then the factors were not what was wrong. One that fails changes nothing. */
static void reconsider_factors(const struct arguments *a, const struct model *given, struct diagnosis *diagnosis,
                               struct channel_factors *factors)
{
    static const double clearly = 0.8; /* times what is left with them */
    struct diagnosis as_given;
    struct bf_error ignored;
    const bool known = run_with(a, given, &as_given, &ignored) == BF_OK && as_given.verdict != VERDICT_UNKNOWN;
    const double with = left_at_best(diagnosis), without = left_at_best(&as_given);
    if (!known || !(without < clearly * with)) {
        diagnose_free(&as_given);
        return;
    }
    bf_warn(
        "with another sign or size of a channel the model as given is nearer to the records; but with an effect that "
        "it lacks, the channels as they are leave %.3g %% of the signal, those %.3g %%: they stay as they are",
        100.0 * without, 100.0 * with);
    channel_factors_free(factors);
    diagnose_free(diagnosis);
    *diagnosis = as_given;
}

/* The diagnosis is of model and records with that put right. BF_BAD_FILE: there is no beam in the records. */
static enum bf_status take_factors(struct arguments *a, const struct channel_factors *factors, struct model *model,
                                   struct bf_error *err)
{
    for (size_t i = 0; i < factors->n; i++)
        if (factors->all[i].kind == FACTOR_NO_TIME)
            return bf_fail(err, BF_BAD_FILE, "%s: %s", a->sets.fitted.names[0], factors->all[i].text);
    channel_factors_apply_to_records(factors, model, a->sets.fitted.records, a->sets.fitted.n);
    channel_factors_apply_to_records(factors, model, a->sets.held_out.records, a->sets.held_out.n);
    channel_factors_apply(factors, model);
    return BF_OK;
}

/* Not where what is named takes next to all: no effect imitates a sensor at another place, which leaves every frequency where it was, and a hit beside its mark is an effect itself. */
static bool places_are_wanted(const struct channel_factors *factors, const struct diagnosis *diagnosis)
{
    static const double nearly_all = 0.99; /* of the misfit's power */
    const struct hypothesis *named = diagnosis->verdict == VERDICT_MISSING ? &diagnosis->hypotheses[0] : NULL;
    const bool told = named != NULL && named->explained >= nearly_all && !(named->held_out_explained < nearly_all);
    return factors->n == 0 && !diagnosis->interrupted && diagnosis->verdict != VERDICT_COMPLETE && !told;
}

/* Looks for channels at another place, five fits each; what is put right is diagnosed again. */
static enum bf_status look_for_places(struct arguments *a, struct model *model, struct diagnosis *diagnosis,
                                      struct channel_factors *factors, struct bf_error *err)
{
    const struct record_list *fitted = &a->sets.fitted;
    channel_factors_free(factors);
    a->options.free_model = NULL;
    factors_or_warn(model, fitted->records, fitted->n, &a->options.predict, a->options.fitted, true, factors);
    if (factors->n == 0)
        return BF_OK;
    diagnose_free(diagnosis);
    a->options.fitted = NULL;
    const enum bf_status status = take_factors(a, factors, model, err);
    return status ? status : run_with(a, model, diagnosis, err);
}

/* model: given with the factors put right. */
static enum bf_status answer(struct arguments *a, const struct model *given, struct model *model,
                             struct diagnosis *diagnosis, struct channel_factors *factors, struct bf_error *err)
{
    enum bf_status status = say_silent_records(model, &a->sets.fitted, err);
    if (!status)
        status = run_with(a, model, diagnosis, err);
    if (!status && places_are_wanted(factors, diagnosis))
        status = look_for_places(a, model, diagnosis, factors, err);
    if (!status && factors_are_doubtful(factors, diagnosis))
        reconsider_factors(a, given, diagnosis, factors);
    if (status)
        return status;
    if (a->output && !diagnosis->interrupted)
        status = write_found(a, diagnosis, err);
    if (!status)
        status = print(a, diagnosis->model, diagnosis, factors, err);
    if (!status && a->plot)
        status = diagnose_plot(diagnosis, &a->options.predict, a->plot, err);
    return status;
}

/*
 * What the fit of the model as given leaves tells whether signs and units are to be asked for; where they are not, the diagnosis begins with
 * that fit. A fit that fails is the diagnosis's to tell.
 */
static enum bf_status check_factors(struct arguments *a, struct model *model, struct fit_result *fit,
                                    struct channel_factors *factors, struct bf_error *err)
{
    const struct record_list *fitted = &a->sets.fitted;
    const struct fit_options how = {.never_search = true, .quiet = true, .predict = a->options.predict};
    struct bf_error ignored;
    const bool known = fit_run(model, fitted->records, fitted->n, &how, fit, &ignored) == BF_OK;
    factors_or_warn(model, fitted->records, fitted->n, &a->options.predict, known ? fit : NULL, false, factors);
    a->options.fitted = known && factors->n == 0 ? fit : NULL;
    a->options.free_model = factors->n == 0 && factors->free_model.modes > 0 ? &factors->free_model : NULL;
    return take_factors(a, factors, model, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct model given = {0}, model = {0};
    struct diagnosis diagnosis = {0};
    struct channel_factors factors = {0};
    struct fit_result fit = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    if (!status)
        status = model_read(a.sets.model, &model, err);
    if (!status)
        status = model_copy(&model, &given, err);
    if (!status)
        status = record_sets_read(&a.sets, &model, err);
    if (!status)
        status = atomic_check_file(a.output, err);
    if (!status)
        status = diagnose_plot_prepare(a.plot, err);
    progress_catch_interrupts();
    if (!status)
        status = check_factors(&a, &model, &fit, &factors, err);
    if (!status)
        status = answer(&a, &given, &model, &diagnosis, &factors, err);
    diagnose_free(&diagnosis);
    fit_free(&fit);
    channel_factors_free(&factors);
    model_free(&model), model_free(&given);
    record_sets_free(&a.sets);
    free(a.without), free(a.without_text);
    return status;
}

const struct command command_diagnose = {
    .place = 60,
    .name = "diagnose",
    .summary = "what physics the model lacks, where it shows, how sure that is",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = diagnose_fields,
    .run = run,
};
