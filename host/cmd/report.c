/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "commands.h"
#include "explanations.h"
#include "record_sets.h"
#include "show/show.h"

static const struct answer_field left_out_fields[] = {
    ANSWER_ROW(TEXT, "file", "a record"),
    ANSWER_ROW(TEXT, "channel", "of it, without curves"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(COUNT, "bytes", "of the page"),
    ANSWER_ROW(NUMBER, "megabytes", "the same", .unit = "MB", .digits = 2),
    ANSWER_ROW(COUNT, "pictures", "channels with curves on it"),
    ANSWER_ROW_OF(LIST, "left_out", "channels for which there was no room", left_out_fields),
    ANSWER_ROW(COUNT, "explanations", "whose curves the page compares"),
    ANSWER_ROW(COUNT, "models", "in the chain"),
    ANSWER_ROW(TEXT, "text", "how far the model is from the noise"),
    ANSWER_SAY("{file}: {megabytes}, curves of {pictures} {pictures#channel|channels}"),
    ANSWER_SAY("{text}"),
    ANSWER_ROW(NUMBER, "nrmse", "error over all channels of fitted records"),
    ANSWER_ROW(NUMBER, "noise_ratio", "the same in units of the noise"),
    ANSWER_ROW(NUMBER, "check_nrmse", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_noise_ratio", "of held-out records, in units of the noise"),
    {0},
};

static const char help[] =
    "Usage: beamfit report MODEL RECORD... [--check RECORD...] -o FILE.html [options]\n"
    "\n"
    "Writes the state of a model as one page for a browser: to explore, to send to a colleague, or to print for\n"
    "the lab book. The page is a single file with its curves inside; it loads nothing from anywhere.\n"
    "\n"
    "It says how many times the noise the model leaves; then measured, predicted and residual of each channel as\n"
    "curves to zoom into, over time and over frequency, of the model and of its ancestors, compared by a slider;\n"
    "the error of each channel, the beam, parameters with standard errors, effects, natural frequencies and\n"
    "damping, the records, and the chain of models of `beamfit history`. The model is taken as it is: nothing is\n"
    "fitted (as in compare). With --diagnose the explanations of `beamfit diagnose` are there to compare as well.\n";

static const struct option_row options[] = {
    {'o', 'o', "output", "FILE", NULL, "the page; written whole or not at all; - is standard output"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace FILE even when `report` has not made it or somebody has changed it"},
    RECORD_SETS_CHECK("records that were held out of the fit"),
    {'t', 0, "title", "TEXT", NULL, "heading of the page (default: the model's file)"},
    {'p', 0, "pictures", "N", NULL,
     "curves of at most N channels (default 12), the furthest from their noise first. The others are listed. 0: no "
     "curves"},
    {'d', 0, "diagnose", NULL, NULL,
     "diagnose first, and show the best explanations beside the model; takes as long as `diagnose`"},
    {'a', 0, "ancestor", "MODEL", NULL,
     "an ancestor of the model for the chain; may be given again. Those in the model's directory are found "
     "by themselves"},
    OPTION_INTERSAMPLE('i'),
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "The environment variable SOURCE_DATE_EPOCH sets the date on the page.\n"
    "\n"
    "Example:\n"
    "  beamfit report fitted.yaml tap1.csv tap2.csv --check tap3.csv --title 'Beam B1, run 4' -o report.html\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad model or record, or FILE not writable; 4 the model cannot be evaluated,\n"
    "or Ctrl-C.\n";

enum { USUAL_CHANNELS = 12, MOST_CHANNELS = 1000, FEWEST_MODES = 3, MOST_MODES = 10 };

struct arguments {
    struct record_sets sets;
    struct record_list ancestors; /* names only */
    const char *output, *title;
    long channels;
    bool diagnose;
    struct predict_options predict;
};

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 't':
        a->title = optarg;
        return BF_OK;
    case 'a':
        record_list_add(&a->ancestors, optarg);
        return BF_OK;
    case 'p':
        return options_count("--pictures", optarg, 0, MOST_CHANNELS, &a->channels, err);
    case 'i':
        return intersample_from_text(optarg, &a->predict.intersample, err);
    case 'd':
        a->diagnose = true;
        return BF_OK;
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
        return bf_fail(err, BF_USAGE,
                       "give a model and at least one record: beamfit report MODEL RECORD... -o FILE.html");
    if (a->output == NULL)
        return bf_fail(err, BF_USAGE, "say where to write the page: -o FILE.html");
    if (options_one_answer(a->output, err) != BF_OK)
        return BF_USAGE;
    for (size_t i = 0; i < a->ancestors.n_names; i++)
        outputs_note_input(a->ancestors.names[i]); /* which are read after the place for the page was looked at */
    return BF_OK;
}

/* What the command owns while it runs. */
struct work {
    struct model model;
    struct comparison comparison;
    struct modes modes;
    struct history history;
    struct diagnosis diagnosis;
    struct explanations explanations;
    size_t bytes, n_pictures;
};

static void work_free(struct work *w)
{
    explanations_free(&w->explanations);
    diagnose_free(&w->diagnosis);
    history_free(&w->history);
    modes_free(&w->modes);
    compare_free(&w->comparison);
    model_free(&w->model);
}

/* Modes up to the highest Nyquist frequency of the records, within reason. */
static size_t modes_to_show(const struct comparison *all)
{
    return all->n_modes < FEWEST_MODES ? FEWEST_MODES : all->n_modes > MOST_MODES ? MOST_MODES : all->n_modes;
}

/* The model, its ancestors before it, and what a diagnosis found. */
static enum bf_status explain(const struct arguments *a, struct work *w, struct bf_error *err)
{
    const struct record_list *all = &a->sets.fitted; /* the held-out ones are its last */
    const size_t n_held_out = a->sets.held_out.n_names;
    const struct diagnose_options how = {.predict = a->predict};
    enum bf_status status = BF_OK;
    explanations_begin(&w->explanations, all->records, all->n, n_held_out, &a->predict);
    explanations_add_ancestors(&w->explanations, &w->history);
    if (a->diagnose)
        status = diagnose_run(&w->model, all->records, all->n - n_held_out, all->records + all->n - n_held_out,
                              n_held_out, &how, &w->diagnosis, err);
    if (status == BF_OK && w->diagnosis.interrupted)
        status = bf_fail(err, BF_NUMERIC, "interrupted; no report was written");
    if (status == BF_OK)
        status = explanations_add(&w->explanations, text_base_name(a->sets.model), &w->model, err);
    if (status == BF_OK && a->diagnose)
        explanations_add_diagnosis(&w->explanations, &w->diagnosis);
    return status;
}

static enum bf_status compute(const struct arguments *a, struct work *w, struct bf_error *err)
{
    const struct record_list *all = &a->sets.fitted; /* the held-out ones are its last */
    enum bf_status status =
        compare_run(&w->model, all->records, all->n, a->sets.held_out.n_names, &a->predict, &w->comparison, err);
    if (status == BF_OK)
        status = modes_compute(&w->model, modes_to_show(&w->comparison), 0.0, 2, &w->modes, err);
    if (status == BF_OK)
        status = history_of(a->sets.model, a->ancestors.names, a->ancestors.n_names, &w->history, err);
    if (status == BF_OK)
        status = explain(a, w, err);
    return status;
}

/* The page in memory, so that its size is known, and then at once to its place. */
static enum bf_status write_page(const struct arguments *a, const struct report *report, struct work *w,
                                 struct bf_error *err)
{
    char *text = NULL;
    FILE *f = open_memstream(&text, &w->bytes);
    if (f == NULL)
        return bf_fail(err, BF_NUMERIC, "no memory for the page (%s)", strerror(errno));
    enum bf_status status = BF_OK;
    report_write(report, f);
    const bool whole = ferror(f) == 0;
    if (fclose(f) != 0 || !whole)
        status = bf_fail(err, BF_NUMERIC, "no memory for the page; choose fewer pictures (--pictures N)");
    struct atomic_file out;
    if (status == BF_OK && strcmp(a->output, "-") == 0) {
        (void)fwrite(text, 1, w->bytes, stdout);
    } else if (status == BF_OK && (status = atomic_open(a->output, &out, err)) == BF_OK) {
        (void)fwrite(text, 1, w->bytes, out.f);
        outputs_mark(&out, "<!-- ", " -->\n");
        w->bytes = (size_t)ftell(out.f);
        status = atomic_commit(&out, err);
    }
    free(text);
    return status;
}

static void put_left_out(struct json *root, const struct arguments *a, const struct comparison *all)
{
    bool *drawn = bf_alloc(all->n_channels, sizeof *drawn);
    (void)curves_choose(all, (size_t)a->channels, drawn);
    struct json *list = json_put(root, "left_out", json_new_array());
    for (size_t i = 0; i < all->n_channels; i++) {
        if (drawn[i])
            continue;
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "file", all->records[all->channels[i].record].path);
        json_put_text(one, "channel", all->channels[i].name);
    }
    free(drawn);
}

static size_t count_pictures(const struct arguments *a, const struct comparison *all)
{
    bool *drawn = bf_alloc(all->n_channels, sizeof *drawn);
    const size_t n = curves_choose(all, (size_t)a->channels, drawn);
    free(drawn);
    return n;
}

/* The command that says what is missing, with the same records. */
static void put_diagnose(struct json *root, const struct arguments *a)
{
    const struct record_list *all = &a->sets.fitted; /* the held-out ones are its last */
    const size_t n = all->n_names, n_held_out = a->sets.held_out.n_names;
    const char **words = bf_alloc(n + 5, sizeof *words);
    size_t k = 0;
    words[k++] = "beamfit", words[k++] = "diagnose", words[k++] = a->sets.model;
    for (size_t i = 0; i < n; i++) {
        if (i == n - n_held_out)
            words[k++] = "--check";
        words[k++] = all->names[i];
    }
    answer_next_words(root, words); /* bf_alloc() has put NULL behind them */
    free(words);
}

static enum bf_status answer(const struct arguments *a, const struct report *report, const struct work *w,
                             struct bf_error *err)
{
    char verdict[REPORT_TEXT];
    report_verdict(report, verdict);
    if (strcmp(a->output, "-") == 0)
        return BF_OK;
    struct json *root = json_new_object();
    json_put_text(root, "file", a->output);
    json_put_number(root, "bytes", (double)w->bytes);
    json_put_number(root, "megabytes", 1e-6 * (double)w->bytes);
    json_put_number(root, "pictures", (double)w->n_pictures);
    put_left_out(root, a, &w->comparison);
    json_put_number(root, "explanations", (double)w->explanations.n);
    json_put_number(root, "models", (double)w->history.n);
    json_put_text(root, "text", verdict);
    json_put_number(root, "nrmse", w->comparison.nrmse);
    json_put_number(root, "noise_ratio", w->comparison.noise_ratio);
    json_put_number(root, "check_nrmse", w->comparison.check_nrmse);
    json_put_number(root, "check_noise_ratio", w->comparison.check_noise_ratio);
    if (a->diagnose)
        diagnose_put_next(root, &w->diagnosis, NULL, &(struct channel_factors){0});
    else if (report_leaves_more(report))
        put_diagnose(root, a);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.channels = USUAL_CHANNELS};
    struct record_list *const all = &a.sets.fitted; /* and then the held-out ones */
    struct work w = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    for (size_t i = 0; i < a.sets.held_out.n_names; i++)
        record_list_add(all, a.sets.held_out.names[i]);
    if (status == BF_OK)
        status = model_read(a.sets.model, &w.model, err);
    if (status == BF_OK)
        status = record_list_read(all, &w.model, err);
    if (status == BF_OK)
        record_lists_clean(&w.model, all, NULL);
    if (status == BF_OK)
        status = atomic_check(a.output, err);
    progress_catch_interrupts();
    if (status == BF_OK)
        status = compute(&a, &w, err);
    if (status == BF_OK)
        w.n_pictures = count_pictures(&a, &w.comparison);
    const struct report report = {.title = a.title,
                                  .model = &w.model,
                                  .comparison = &w.comparison,
                                  .modes = &w.modes,
                                  .history = &w.history,
                                  .curves = explanations_curves(&w.explanations, (size_t)a.channels),
                                  .diagnosis = a.diagnose ? &w.diagnosis : NULL};
    if (status == BF_OK)
        status = write_page(&a, &report, &w, err);
    if (status == BF_OK)
        status = answer(&a, &report, &w, err);
    work_free(&w);
    record_list_free(&a.ancestors);
    record_sets_free(&a.sets);
    return status;
}

const struct command command_report = {
    .place = 110,
    .name = "report",
    .summary = "one page with tables and curves, to explore, send or print",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
