/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "attainable_or_warn.h"
#include "commands.h"
#include "compare/compare.h"
#include "factors_or_warn.h"
#include "findings_of.h"
#include "record_sets.h"
#include "show/show.h"

static const char help[] =
    "Usage: beamfit compare MODEL RECORD... [--check RECORD...] [options]\n"
    "\n"
    "Predicts the records with the model as it is and holds the prediction against what was measured. Nothing is\n"
    "fitted, except what no model can know: the initial state of a free decay, and a level of excitation that the\n"
    "record or the model calls unknown.\n"
    "\n"
    "Per record and channel: the error (norm of the misfit over norm of the signal), the noise of the channel as the\n"
    "record itself shows it, the error in units of that noise (1: nothing is left to explain), whether the residual "
    "is\n"
    "white, whether it follows an input, and where the misfit is: by band and mode, in time, by size of the motion.\n"
    "'Attainable' is what the best linear model with as many modes leaves on the same records (docs/compare.md).\n"
    "Above all that: a channel that points the other way, is in g, or off by 10 or 1000, and the line of the model\n"
    "file that says so.\n";

static const struct option_row options[] = {
    RECORD_SETS_CHECK("records that were held out of the fit; they get a total of their own"),
    {'p', 0, "plot", "DIR", NULL,
     "pictures, PNG and PDF, with gnuplot's script and data beside them: the four panels (measured, model, "
     "spectra of both, a short interval) and a page on the residual"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace pictures even when `compare` has not made them or somebody has changed them"},
    {'m', 0, "max-nrmse", "X", NULL,
     "a question: is the error (root mean square over all channels, held-out ones too) at most X? X is a "
     "fraction, 0.05 = 5 %; the exit status is the answer"},
    OPTION_INTERSAMPLE('i'),
    {'A', 0, "all", NULL, NULL, "all columns: noise, whiteness of the residual and what it has of the inputs, too"},
    OPTIONS_ANSWER('j'),
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit compare fitted.yaml tap1.csv tap2.csv --check tap3.csv --plot pictures\n"
    "\n"
    "Exit status: 0 done (and the error is within --max-nrmse); 1 the error is larger than --max-nrmse; 2 usage; 3\n"
    "bad model or record, or DIR not writable; 4 the model cannot be evaluated.\n";

struct arguments {
    struct record_sets sets;
    const char *directory; /* of --plot; NULL: none */
    double most;           /* of --max-nrmse; NAN: not asked */
    bool json, all;
    struct predict_options predict;
};

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case 'p':
        a->directory = optarg;
        return BF_OK;
    case 'A':
        a->all = true;
        return BF_OK;
    case 'j':
        a->json = true;
        return BF_OK;
    case 'm':
        if (options_number("--max-nrmse", optarg, &a->most, err) != BF_OK)
            return err->status;
        if (a->most < 0.0)
            return bf_fail(err, BF_USAGE, "--max-nrmse %s: give a fraction that is not negative (0.05 is 5 %%)",
                           optarg);
        return BF_OK;
    case 'i':
        return intersample_from_text(optarg, &a->predict.intersample, err);
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
    if (a->sets.model == NULL || a->sets.fitted.n_names + a->sets.held_out.n_names == 0)
        return bf_fail(err, BF_USAGE, "give a model and at least one record: beamfit compare MODEL RECORD...");
    return BF_OK;
}

/* Root mean square over every channel, held out or not. */
static double whole_error(const struct comparison *all)
{
    double sum = 0.0;
    for (size_t i = 0; i < all->n_channels; i++)
        sum += all->channels[i].nrmse * all->channels[i].nrmse;
    return all->n_channels > 0 ? sqrt(sum / (double)all->n_channels) : 0.0;
}

static enum bf_status print(const struct arguments *a, const struct comparison *all,
                            const struct channel_factors *factors, const struct record_findings findings[],
                            struct bf_error *err)
{
    for (size_t i = 0; i < all->n_channels && factors->n == 0; i++) /* else what they ask is answered */
        if (all->channels[i].warning[0] != '\0')
            bf_warn("%s: %s", all->records[all->channels[i].record].path, all->channels[i].warning);
    if (a->json) {
        struct json *root = compare_json(all);
        channel_factors_json(root, all->model, factors);
        record_findings_json(root, all->records, findings, all->n_records);
        return answer_print_and_free(root, compare_fields, err);
    }
    record_findings_print(stdout, all->records, findings, all->n_records);
    channel_factors_print(stdout, factors);
    compare_print(stdout, all, a->all);
    return BF_OK;
}

static enum bf_status answer(const struct arguments *a, const struct comparison *all,
                             const struct channel_factors *factors, struct bf_error *err)
{
    struct record_findings *findings = findings_of(all->model, all->records, all->n_records);
    const enum bf_status status = print(a, all, factors, findings, err);
    findings_free(findings, all->n_records);
    if (status != BF_OK)
        return status;
    if (a->directory != NULL && compare_plot(all, a->directory, err) != BF_OK)
        return err->status;
    if (a->directory != NULL && !a->json && plot_can_draw(NULL))
        (void)fprintf(stdout, "\nPictures: %s\n", a->directory);
    const double error = whole_error(all);
    if (error > a->most)
        return bf_fail(err, BF_NO, "the error is %.4g, more than --max-nrmse %.4g", error, a->most);
    return BF_OK;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.most = nan("")};
    struct record_list *const all = &a.sets.fitted; /* and then the held-out ones */
    struct model model = {0};
    struct comparison comparison = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    const size_t n_held_out = a.sets.held_out.n_names;
    for (size_t i = 0; i < n_held_out; i++)
        record_list_add(all, a.sets.held_out.names[i]);
    if (status == BF_OK)
        status = model_read(a.sets.model, &model, err);
    if (status == BF_OK)
        status = record_list_read(all, &model, err);
    if (status == BF_OK && a.directory != NULL)
        (void)plot_can_draw(a.directory);
    if (status == BF_OK)
        status = compare_run(&model, all->records, all->n, n_held_out, &a.predict, &comparison, err);
    if (status == BF_OK) {
        struct channel_factors factors;
        attainable_or_warn(&model, all->records, all->n - n_held_out, &comparison.attainable);
        factors_or_warn(&model, all->records, all->n, &a.predict, &factors);
        status = answer(&a, &comparison, &factors, err);
        channel_factors_free(&factors);
    }
    compare_free(&comparison);
    record_sets_free(&a.sets);
    model_free(&model);
    return status;
}

const struct command command_compare = {
    .place = 50,
    .name = "compare",
    .summary = "measured against model: errors, noise, where the misfit is, pictures",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = compare_fields,
    .run = run,
};
