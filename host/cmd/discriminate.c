/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "explain/explain.h"
#include "ground/ground.h"
#include "record_sets.h"
#include "show/show.h"

static const char help[] =
    "Usage: beamfit discriminate MODEL RIVAL RIVAL... [RECORD...] [-o DRIVE] [options]\n"
    "\n"
    "Says which next experiment tells rival effects apart best, when the records so far cannot. Each rival is\n"
    "added to MODEL and fitted to the RECORDs; then every experiment of a menu is predicted by all of them: hits\n"
    "and a release at several places, chirp and multisine on the patch, each at a quarter of, at and at four\n"
    "times the largest level of the records, with the sensors of MODEL alone and with one more (displacement,\n"
    "velocity or acceleration at a quarter, the middle and the end of the beam). An experiment is worth what is\n"
    "left of the difference of two rivals, in units of the noise, after the wrong one has been fitted again; of\n"
    "several pairs the worst counts.\n";

static const struct option_row options[] = {
    {.name = "RIVAL",
     .what = "an effect (tip_mass), on a channel as `diagnose` names it (sensor_lag@accel_mps2), several at once "
             "(tip_mass+sensor_lag@accel_mps2), or with a model that has them (tip_mass=fitted_tip_mass.yaml), "
             "whose values are the start of the refit"},
    {.name = "RECORD",
     .what = "the recordings so far; without any, effects have typical strengths (a warning says so)"},
    {'o', 'o', "output", "DRIVE", NULL,
     "write the drive signal of the best experiment: a record (CSV) with MODEL's inputs"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace DRIVE even when `discriminate` has not made it or somebody has changed it"},
    {'k', 0, "only", "KIND,KIND...", "hit|soft_hit|release|chirp|multisine",
     "of hit, soft_hit, release, chirp, multisine"},
    {'s', 0, "no-sensors", NULL, NULL, "no added sensor"},
    {'d', 0, "duration", "S", NULL, "length of an experiment, s (default: that of the first record, else 4)"},
    {'f', 0, "largest-force", "N", NULL, "largest force, N (default: of the records, else 5)"},
    {'v', 0, "voltage", "V", NULL, "largest drive, V (default: of the records, else 20)"},
    {'r', 0, "rows", "N", NULL, "rows of the table (default 12)"},
    OPTION_INTERSAMPLE('i'),
    {'t', 0, "threads", "N", NULL, "default: one a processor"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Evidence (separation) is the expected 2 log of the likelihood ratio: above 10 is decisive. It adds up over\n"
    "repeated experiments. The best one stays within the largest level so far, and asks for a sensor only where\n"
    "that gains half as much again; what four times the level would bring is listed as 'beyond the largest so\n"
    "far'.\n"
    "\n"
    "Example:\n"
    "  beamfit discriminate fitted.yaml square_root_damping hysteretic_damping hit1.csv chirp1.csv -o next.csv\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad model or record, or DRIVE not writable; 4 no experiment can be\n"
    "predicted.\n";

enum { ROWS = 12 };

struct rival_argument {
    char *name, *words; /* words: the name, cut at every '+' and '@' */
    struct discriminate_rival rival;
    struct model model;
};

struct arguments {
    const char *model, *output;
    size_t n_rivals;
    struct rival_argument rivals[DISCRIMINATE_RIVALS];
    struct record_list records;
    long rows;
    struct discriminate_options options;
};

static enum bf_status take_only(struct arguments *a, const char *text, struct bf_error *err)
{
    const char *names[DRIVE_KINDS];
    for (int k = 0; k < DRIVE_KINDS; k++) {
        names[k] = drive_kind_name((enum drive_kind)k);
        a->options.without[k] = true;
    }
    char *copy = bf_strdup(text), *rest = NULL;
    enum bf_status status = BF_OK;
    for (char *kind = strtok_r(copy, ",", &rest); kind != NULL && !status; kind = strtok_r(NULL, ",", &rest)) {
        size_t k = 0;
        status = options_choice("--only", kind, names, DRIVE_KINDS, &k, err);
        a->options.without[k] = status != BF_OK;
    }
    free(copy);
    return status;
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    long count = 0;
    enum bf_status status;
    switch (code) {
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'k':
        return take_only(a, optarg, err);
    case 's':
        a->options.no_sensors = true;
        return BF_OK;
    case 'd':
        return options_positive("--duration", optarg, 1e4, &a->options.duration_s, err);
    case 'f':
        return options_positive("--largest-force", optarg, 1e6, &a->options.force_N, err);
    case 'v':
        return options_positive("--voltage", optarg, 1e6, &a->options.moment_V, err);
    case 'r':
        return options_count("--rows", optarg, 1, 1000000, &a->rows, err);
    case 't':
        status = options_count("--threads", optarg, 1, 256, &count, err);
        a->options.threads = (int)count;
        return status;
    case 'i':
        return intersample_from_text(optarg, &a->options.predict.intersample, err);
    default:
        return BF_USAGE;
    }
}

/* "ID@CHANNEL+ID" into effects and channels; BF_USAGE with a proposal when an effect is unknown. */
static enum bf_status take_effects(struct rival_argument *r, struct bf_error *err)
{
    struct discriminate_rival *rival = &r->rival;
    char *rest = NULL;
    r->words = bf_strdup(r->name);
    for (char *id = strtok_r(r->words, "+", &rest); id != NULL; id = strtok_r(NULL, "+", &rest)) {
        char *at = strchr(id, '@');
        if (at != NULL)
            *at++ = '\0';
        if (at != NULL && *at == '\0')
            return bf_fail(err, BF_USAGE, "%.60s: give a channel after @, e.g. %.60s@accel_mps2", r->name, id);
        const struct beam_effect *effect = effect_find(id, err);
        if (effect == NULL)
            return BF_USAGE;
        if (rival->n_effects == DISCRIMINATE_EFFECTS)
            return bf_fail(err, BF_USAGE, "%.60s: at most %d effects in one rival", r->name, DISCRIMINATE_EFFECTS);
        rival->channels[rival->n_effects] = at;
        rival->effects[rival->n_effects++] = effect;
    }
    return rival->n_effects > 0 ? BF_OK : bf_fail(err, BF_USAGE, "'%.60s' names no effect", r->name);
}

static enum bf_status check_has(const struct rival_argument *r, const char *path, struct bf_error *err)
{
    for (size_t i = 0; i < r->rival.n_effects; i++) {
        const char *channel = r->rival.channels[i];
        bool found = false;
        for (size_t e = 0; e < r->model.n_effects; e++)
            found = found || (r->model.effects[e].effect == r->rival.effects[i] &&
                              (channel == NULL || strcmp(r->model.effects[e].channel, channel) == 0));
        if (!found)
            return bf_fail(err, BF_USAGE,
                           "%s: the model has no effect %s%s%s; `beamfit add` and `beamfit fit` make one", path,
                           r->rival.effects[i]->id, channel ? " on " : "", channel ? channel : "");
    }
    return BF_OK;
}

static enum bf_status take_rival(struct arguments *a, const char *word, struct bf_error *err)
{
    if (a->n_rivals == DISCRIMINATE_RIVALS)
        return bf_fail(err, BF_USAGE, "at most %d rivals can be compared", DISCRIMINATE_RIVALS);
    struct rival_argument *r = &a->rivals[a->n_rivals++];
    const char *equals = strchr(word, '=');
    r->name = bf_strdup(word);
    if (equals != NULL)
        r->name[equals - word] = '\0';
    r->rival.name = r->name;
    enum bf_status status = take_effects(r, err);
    if (status || equals == NULL)
        return status;
    status = model_read(equals + 1, &r->model, err);
    if (status)
        return status;
    r->rival.model = &r->model;
    return check_has(r, equals + 1, err);
}

/* Effects have neither dot nor slash in their names, files of records have one of them. */
static bool is_rival(const char *word)
{
    return word[strcspn(word, "/.=")] == '=' || strpbrk(word, "/.") == NULL;
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    a->rows = ROWS;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        const enum bf_status status = take_option(a, code, err);
        if (status)
            return status;
    }
    if (argc - optind < 1)
        return bf_fail(err, BF_USAGE,
                       "give a model and at least two rival effects: beamfit discriminate MODEL ID ID...");
    if (options_one_answer(a->output, err) != BF_OK)
        return BF_USAGE;
    a->model = argv[optind++];
    for (; optind < argc; optind++) {
        if (!is_rival(argv[optind])) {
            record_list_add(&a->records, argv[optind]);
            continue;
        }
        const enum bf_status status = take_rival(a, argv[optind], err);
        if (status)
            return status;
    }
    if (a->n_rivals < 2)
        return bf_fail(err, BF_USAGE,
                       "give at least two rival effects: beamfit discriminate MODEL ID ID... [RECORD...]; "
                       "`beamfit effects` lists them");
    return BF_OK;
}

static enum bf_status answer(const struct arguments *a, const struct model *model, struct bf_error *err)
{
    struct discriminate_rival rivals[DISCRIMINATE_RIVALS];
    struct discrimination d;
    for (size_t i = 0; i < a->n_rivals; i++)
        rivals[i] = a->rivals[i].rival;
    progress_catch_interrupts();
    enum bf_status status = atomic_check(a->output, err);
    if (!status)
        status = discriminate_run(model, rivals, a->n_rivals, a->records.records, a->records.n, &a->options, &d, err);
    if (!status && d.warning != NULL)
        bf_warn("%s", d.warning);
    if (!status && a->output != NULL)
        status = record_write(a->output, &d.signal, 0, err);
    if (!status && !(a->output != NULL && strcmp(a->output, "-") == 0))
        status = answer_print_and_free(discriminate_json(&d, a->output, (size_t)a->rows), discriminate_fields, err);
    discrimination_free(&d);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct model model = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    if (!status)
        status = model_read(a.model, &model, err);
    if (!status)
        status = record_list_read(&a.records, &model, err);
    if (!status)
        record_lists_clean(&model, &a.records, NULL);
    if (!status)
        status = answer(&a, &model, err);
    for (size_t i = 0; i < a.n_rivals; i++) {
        free(a.rivals[i].name), free(a.rivals[i].words);
        model_free(&a.rivals[i].model);
    }
    record_list_free(&a.records);
    model_free(&model);
    return status;
}

const struct command command_discriminate = {
    .place = 130,
    .name = "discriminate",
    .summary = "which next experiment tells rival effects apart, and its drive signal",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = discriminate_fields,
    .run = run,
};
