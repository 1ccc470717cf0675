/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "attainable_or_warn.h"
#include "commands.h"
#include "compare/compare.h"
#include "factors_or_warn.h"
#include "findings_of.h"
#include "free_or_warn.h"
#include "long_records.h"
#include "record_sets.h"
#include "repeats_or_warn.h"
#include "show/show.h"

static const char help[] =
    "Usage: beamfit compare MODEL RECORD... [--check RECORD...] [options]\n"
    "\n"
    "Predicts the records with the model as it is and holds the prediction against what was measured. Nothing is\n"
    "fitted, except what no model can know: the initial state of a free decay, and a level of excitation that the\n"
    "record or the model calls unknown.\n"
    "\n"
    "Per record and channel: the error (norm of the misfit over norm of the signal), the noise of the channel as\n"
    "the record itself shows it, the error in units of that noise (1: nothing is left to explain), whether the\n"
    "residual is white, whether it follows an input, and where the misfit is: by band and mode, in time, by size\n"
    "of the motion. 'Attainable' is what the best linear model with as many modes leaves on the same records\n"
    "(docs/compare.md). Of a list of measured frequencies: each beside the mode that it belongs to; of a spectrum\n"
    "without phase: the misfit of its lines (docs/records.md). Above all that: a channel that points the other\n"
    "way, is in g, or off by 10 or 1000, and the line of the model file that says so. A long recording (524288\n"
    "samples and more) takes no more memory than its first half million samples, unless --plot wants all of it.\n";

static const struct option_row options[] = {
    RECORD_SETS_CHECK("records that were held out of the fit; they get a total of their own"),
    {'p', 0, "plot", "DIR", NULL,
     "pictures, PNG and PDF, with gnuplot's script and data beside them: decays (amplitude in time, frequency and "
     "damping against it), a stabilisation diagram of free linear models, the poles of the records beside the "
     "model's, with shapes where several places tell them, the four panels (measured, model, "
     "spectra of both, a short interval) and a page on the residual"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace pictures even when `compare` has not made them or somebody has changed them"},
    {'m', 0, "max-nrmse", "X", NULL,
     "a question: is the error (root mean square over all channels, held-out ones too) at most X? X is a "
     "fraction, 0.05 = 5 %; the exit status is the answer"},
    OPTION_INTERSAMPLE('i'),
    {OPTION_ALL, 'A', "all", NULL, NULL,
     "all columns: noise, whiteness of the residual and what it has of the inputs, too"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit compare fitted.yaml tap1.csv tap2.csv --check tap3.csv --plot pictures\n"
    "\n"
    "Exit status: 0 done (and the error is within --max-nrmse); 1 the error is larger than --max-nrmse; 2 usage;\n"
    "3 bad model or record, or DIR not writable; 4 the model cannot be evaluated.\n";

struct arguments {
    struct record_sets sets;
    const char *directory; /* of --plot; NULL: none */
    double most;           /* of --max-nrmse; NAN: not asked */
    struct predict_options predict;
};

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case 'p':
        a->directory = optarg;
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
static double whole_error(const struct comparison *all, const struct line_comparison *lines)
{
    const size_t n = all->n_channels + lines->n_channels;
    double sum = 0.0;
    for (size_t i = 0; i < all->n_channels; i++)
        sum += all->channels[i].nrmse * all->channels[i].nrmse;
    for (size_t i = 0; i < lines->n_channels; i++)
        sum += lines->channels[i].nrmse * lines->channels[i].nrmse;
    return n > 0 ? sqrt(sum / (double)n) : 0.0;
}

static enum bf_status print(const struct comparison *all, const struct line_comparison *lines,
                            const struct channel_factors *factors, const struct record_findings findings[],
                            const struct repeatability *repeats, const struct free_motion *motion, struct bf_error *err)
{
    for (size_t i = 0; i < all->n_channels && factors->n == 0; i++) /* else what they ask is answered */
        if (all->channels[i].warning[0] != '\0')
            bf_warn("%s: %s", all->records[all->channels[i].record].path, all->channels[i].warning);
    struct json *root = compare_json(all, lines);
    channel_factors_json(root, all->model, factors);
    record_findings_json(root, all->records, findings, all->n_records);
    repeatability_json(root, all->model, all->records, repeats);
    if (motion->wanted) {
        amplitude_json(root, all->records, &motion->decays);
        stabilisation_json(root, &motion->poles);
        record_poles_json(root, &motion->table);
    }
    return answer_print_and_free(root, compare_fields, err);
}

static enum bf_status draw(const char *directory, const struct comparison *all, const struct line_comparison *lines,
                           const struct free_motion *motion, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    if (motion->wanted)
        status = compare_plot_amplitude(all, &motion->decays, directory, err);
    if (status == BF_OK && motion->wanted)
        status = compare_plot_stabilisation(all, &motion->poles, directory, err);
    if (status == BF_OK && motion->table.n_pairs > 0)
        status = pole_table_plot(&motion->table, COMPARE_POLES, directory, err);
    if (status == BF_OK)
        status = compare_plot(all, directory, err);
    if (status == BF_OK)
        status = compare_lines_plot(lines, directory, err);
    if (status == BF_OK && options_format() == OPTIONS_TEXT && plot_can_draw(NULL))
        (void)fprintf(stdout, "\nPictures: %s\n", directory);
    return status;
}

static struct repeatability find_repeats(const struct comparison *all)
{
    double *rms = bf_alloc(all->n_records * all->model->n_outputs + 1, sizeof *rms);
    for (size_t c = 0; c < all->n_channels; c++)
        repeats_noise(all->model, all->channels[c].record, all->channels[c].name, all->channels[c].noise.rms, rms);
    const struct repeatability out = repeats_or_warn(all->model, all->records, all->n_records, rms);
    free(rms);
    return out;
}

static enum bf_status answer(const struct arguments *a, const struct comparison *all,
                             const struct line_comparison *lines, const struct channel_factors *factors,
                             struct bf_error *err)
{
    struct free_motion motion = free_or_warn(all, a->directory != NULL || options_format() != OPTIONS_TEXT);
    struct record_findings *findings = findings_of(all->model, all->records, all->n_records);
    struct repeatability repeats = find_repeats(all);
    enum bf_status status = print(all, lines, factors, findings, &repeats, &motion, err);
    repeatability_free(&repeats);
    findings_free(findings, all->n_records);
    if (status == BF_OK && a->directory != NULL)
        status = draw(a->directory, all, lines, &motion, err);
    free_motion_free(&motion);
    if (status != BF_OK)
        return status;
    const double error = whole_error(all, lines);
    if (error > a->most)
        return bf_fail(err, BF_NO, "the error is %.4g, more than --max-nrmse %.4g", error, a->most);
    return BF_OK;
}

static enum bf_status compare_all(const struct arguments *a, const struct model *model, const struct record_join *all,
                                  const struct long_records *long_records, struct bf_error *err)
{
    struct comparison comparison = {
        .model = model, .nrmse = nan(""), .noise_ratio = nan(""), .check_nrmse = nan(""), .check_noise_ratio = nan("")};
    struct line_comparison lines = {0};
    struct channel_factors factors = {0};
    const size_t n = all->n_sampled;
    enum bf_status status = BF_OK;
    if (n > 0)
        status = compare_run(model, all->records, n, all->n_sampled_held_out, &a->predict, &comparison, err);
    if (status == BF_OK)
        status = compare_lines(model, all->records + n, all->n_lines, all->n_lines_held_out, &a->predict, &lines, err);
    if (status == BF_OK) {
        const size_t n_fitted = n - all->n_sampled_held_out;
        if (n > 0)
            attainable_or_warn(model, all->records, n_fitted, all->records + n_fitted, all->n_sampled_held_out,
                               &comparison.attainable);
        factors_or_warn(model, all->records, n, &a->predict, NULL, true, &factors);
        long_records_take(long_records, &comparison);
        compare_add_lines(&lines, &comparison);
        status = answer(a, &comparison, &lines, &factors, err);
    }
    channel_factors_free(&factors);
    compare_lines_free(&lines);
    compare_free(&comparison);
    return status;
}

/* With pictures all samples are in memory. */
static enum bf_status read_records(struct arguments *a, const struct model *model, struct long_records *long_records,
                                   struct bf_error *err)
{
    const struct record_reader reader = {.read = long_records_read, .context = long_records};
    struct record_list *const lists[2] = {&a->sets.fitted, &a->sets.held_out};
    enum bf_status status = BF_OK;
    long_records->model = model, long_records->options = &a->predict;
    for (int i = 0; i < 2 && status == BF_OK; i++)
        status = a->directory != NULL ? record_list_read(lists[i], model, err)
                                      : record_list_read_by(lists[i], model, &reader, err);
    if (status == BF_OK && long_records->n == 0) /* a head cannot lose what the sums over its record have */
        record_lists_clean(model, &a->sets.fitted, &a->sets.held_out);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.most = nan("")};
    struct model model = {0};
    struct record_join all = {0};
    struct long_records long_records = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    if (status == BF_OK)
        status = model_read(a.sets.model, &model, err);
    if (status == BF_OK)
        status = read_records(&a, &model, &long_records, err);
    if (status == BF_OK) {
        record_sets_join(&a.sets, &all);
        status = compare_plot_prepare(&model, all.records, a.sets.fitted.n + a.sets.held_out.n, a.directory, err);
    }
    if (status == BF_OK)
        status = compare_all(&a, &model, &all, &long_records, err);
    free(all.records);
    long_records_free(&long_records);
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
