/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "commands.h"
#include "import_help.h"
#include "import_write.h"
#include "record/import/import.h"
#include "ground/ground.h"

struct arguments {
    const char *input, *second; /* second NULL: one is imported */
    struct import_job job;
    struct import_reading reading;
    struct import_choice choice;
    struct import_pick *picks;
    struct import_scale *scales;
    char **texts; /* parts of options, owned */
    size_t n_texts;
    char *command;
    bool list;
};

/* The text before the last `mark`, and after it (NULL: none); the parts belong to the arguments. */
static void split_option(struct arguments *a, const char *text, char mark, const char **left, const char **right)
{
    char *copy = bf_strdup(text), *at = strrchr(copy, mark);
    a->texts = bf_grow(a->texts, a->n_texts + 1, sizeof *a->texts);
    a->texts[a->n_texts++] = copy;
    *left = copy;
    *right = NULL;
    if (at == NULL)
        return;
    *at = '\0';
    *right = at + 1;
}

static enum bf_status channel_option(struct arguments *a, struct bf_error *err)
{
    struct import_pick pick;
    split_option(a, optarg, '=', &pick.from, &pick.to);
    if (pick.from[0] == '\0' || (pick.to != NULL && pick.to[0] == '\0'))
        return bf_fail(err, BF_USAGE, "--channel %s: give FROM=TO, a channel of the file and a name for its column",
                       optarg);
    a->picks = bf_grow(a->picks, a->choice.n_picks + 1, sizeof *a->picks);
    a->picks[a->choice.n_picks++] = pick;
    a->choice.picks = a->picks;
    return BF_OK;
}

static enum bf_status scale_option(struct arguments *a, struct bf_error *err)
{
    struct import_scale scale = {0};
    const char *value, *factor;
    split_option(a, optarg, '=', &scale.name, &value);
    if (value == NULL)
        return bf_fail(err, BF_USAGE, "--scale %s: give NAME=FACTOR or NAME=FACTOR:UNIT", optarg);
    split_option(a, value, ':', &factor, &scale.unit);
    if (import_scale_read(factor, &scale, err) != BF_OK)
        return err->status;
    a->scales = bf_grow(a->scales, a->choice.n_scales + 1, sizeof *a->scales);
    a->scales[a->choice.n_scales++] = scale;
    a->choice.scales = a->scales;
    return BF_OK;
}

static enum bf_status trigger_option(struct arguments *a, struct bf_error *err)
{
    split_option(a, optarg, '=', &a->job.trigger[0], &a->job.trigger[1]);
    if (a->job.trigger[0][0] != '\0' && a->job.trigger[1] != NULL && a->job.trigger[1][0] != '\0')
        return BF_OK;
    return bf_fail(err, BF_USAGE, "--trigger %s: give COLUMN1=COLUMN2, a column of each file in which the same edge is",
                   optarg);
}

static enum bf_status gate_option(struct arguments *a, struct bf_error *err)
{
    const char *span, *from, *to;
    split_option(a, optarg, '=', &a->job.gate, &span);
    if (span == NULL)
        return BF_OK;
    split_option(a, span, ':', &from, &to);
    if (to == NULL)
        return bf_fail(err, BF_USAGE, "--gate %s: give COLUMN, or COLUMN=FROM:TO in seconds", optarg);
    if (options_number("--gate", from, &a->job.gate_s[0], err) != BF_OK ||
        options_number("--gate", to, &a->job.gate_s[1], err) != BF_OK)
        return err->status;
    if (!(a->job.gate_s[0] < a->job.gate_s[1]))
        return bf_fail(err, BF_USAGE, "--gate %s: the hit would end before it begins", optarg);
    return BF_OK;
}

/* One character out of a set; "tab" means '\t'. */
static enum bf_status character_option(const char *name, const char *allowed, char *out, struct bf_error *err)
{
    char c = strcmp(optarg, "tab") == 0 || strcmp(optarg, "\\t") == 0 ? '\t' : optarg[0];
    if (c == '\0' || strchr(allowed, c) == NULL || (c != '\t' && optarg[1] != '\0'))
        return bf_fail(err, BF_USAGE, "%s '%s': give one of %s", name, optarg,
                       strchr(allowed, ';') != NULL ? "',' ';' ' ' or tab" : "'.' and ','");
    *out = c;
    return BF_OK;
}

static enum bf_status format_option(struct arguments *a, struct bf_error *err)
{
    char known[400];
    a->reading.format = import_format_by_name(optarg);
    if (a->reading.format != NULL)
        return BF_OK;
    import_format_list(sizeof known, known);
    return bf_fail(err, BF_USAGE, "--format '%.60s' is unknown; give %s", optarg, known);
}

/* What says over which times or frequencies the columns are. */
static enum bf_status axis_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case OPTION_TIME:
        a->choice.time = optarg;
        return BF_OK;
    case OPTION_TIME_UNIT:
        a->choice.time_unit = optarg;
        return BF_OK;
    case OPTION_RATE:
        return options_positive("--rate", optarg, HUGE_VAL, &a->choice.rate_Hz, err);
    case OPTION_FREQUENCY:
        a->choice.frequency = optarg;
        return BF_OK;
    case OPTION_AVERAGES:
        return options_positive("--averages", optarg, 1e9, &a->choice.averages, err);
    case OPTION_WINDOW:
        return options_positive("--exponential-window", optarg, HUGE_VAL, &a->choice.window_s, err);
    case OPTION_RESAMPLE:
        return options_positive("--resample", optarg, HUGE_VAL, &a->choice.resample_Hz, err);
    default:
        return bf_fail(err, BF_USAGE, "see 'beamfit import --help'");
    }
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    long digits;
    switch (code) {
    case OPTION_CHANNEL:
        return channel_option(a, err);
    case OPTION_SCALE:
        return scale_option(a, err);
    case OPTION_SEPARATOR:
        return character_option("--separator", ",; \t", &a->reading.separator, err);
    case OPTION_DECIMAL:
        return character_option("--decimal", ".,", &a->reading.point, err);
    case OPTION_FROM:
        return options_number("--from", optarg, &a->choice.from_s, err);
    case OPTION_TO:
        return options_number("--to", optarg, &a->choice.to_s, err);
    case OPTION_FREE_FROM:
        return options_number("--free-from", optarg, &a->choice.free_from_s, err);
    case OPTION_LIST:
        a->list = true;
        return BF_OK;
    case OPTION_FREE_DECAY:
        a->choice.free_decay = true;
        return BF_OK;
    case OPTION_UNKNOWN_LEVEL:
        a->choice.unknown_level = true;
        return BF_OK;
    case 'o':
        a->job.output = optarg;
        return BF_OK;
    case OPTION_TRIGGER:
        return trigger_option(a, err);
    case OPTION_GATE:
        return gate_option(a, err);
    case OPTION_DIGITS:
        if (options_count("--digits", optarg, 1, 17, &digits, err) == BF_OK)
            a->job.digits = (int)digits;
        return err->status;
    case OPTION_FORMAT:
        return format_option(a, err);
    default:
        return axis_option(a, code, err);
    }
}

/* The command line as it was, for the record's metadata. */
static char *command_line(int argc, char **argv)
{
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (f == NULL)
        return bf_strdup("beamfit import");
    fprintf(f, "beamfit %s", BEAMFIT_VERSION);
    for (int i = 0; i < argc; i++)
        fprintf(f, strpbrk(argv[i], " \t'\"#;*?$&|<>()") != NULL ? " '%s'" : " %s", argv[i]);
    fclose(f);
    return text;
}

static enum bf_status take_files(struct arguments *a, int n, char **names, struct bf_error *err)
{
    if (n < 1 || n > 2 || (n == 2 && a->list))
        return bf_fail(err, BF_USAGE, "give one file to import%s, not %d; see 'beamfit import --help'",
                       a->list ? "" : ", or two of one run", n);
    a->input = names[0];
    a->second = n == 2 ? names[1] : NULL;
    if (a->job.trigger[0] != NULL && n == 1)
        return bf_fail(err, BF_USAGE, "--trigger joins two files; give the second");
    if (a->choice.resample_Hz > 0 && a->choice.rate_Hz > 0)
        return bf_fail(err, BF_USAGE, "--resample and --rate exclude each other: one trusts the times, one does not");
    return BF_OK;
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    *a = (struct arguments){.choice = {.from_s = NAN, .to_s = NAN, .free_from_s = NAN}};
    a->command = command_line(argc, argv);
    a->choice.command = a->command;
    err->status = BF_OK;
    while ((code = options_next(argc, argv, import_options, err)) != -1)
        if (code == '?' || take_option(a, code, err) != BF_OK)
            return err->status;
    if (take_files(a, argc - optind, argv + optind, err) != BF_OK)
        return err->status;
    if (!a->list && a->job.output == NULL)
        return bf_fail(err, BF_USAGE, "give the record to write with -o OUT.csv, or look into the file with --list");
    if (!isnan(a->choice.free_from_s) && !a->choice.free_decay)
        return bf_fail(err, BF_USAGE, "--free-from needs --free-decay");
    if (a->choice.free_decay && a->choice.unknown_level)
        return bf_fail(err, BF_USAGE, "--free-decay and --unknown-level exclude each other");
    outputs_note_input(a->input);
    if (a->second != NULL)
        outputs_note_input(a->second);
    return a->list ? BF_OK : atomic_check_file(a->job.output, err);
}

static enum bf_status work(const struct arguments *a, struct bf_error *err)
{
    struct import_file files[2];
    if (import_read(a->input, &a->reading, &files[0], err) != BF_OK)
        return err->status;
    if (a->second != NULL && import_read(a->second, &a->reading, &files[1], err) != BF_OK) {
        import_free(&files[0]);
        return err->status;
    }
    const enum bf_status status = a->list ? import_print_list(&files[0], err)
                                          : import_write(files, a->second != NULL ? 2 : 1, &a->choice, &a->job, err);
    import_free(&files[0]);
    if (a->second != NULL)
        import_free(&files[1]);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a;
    enum bf_status status = parse(argc, argv, &a, err);
    if (status == BF_OK)
        status = work(&a, err);
    for (size_t i = 0; i < a.n_texts; i++)
        free(a.texts[i]);
    free(a.texts);
    free(a.picks);
    free(a.scales);
    free(a.command);
    return status;
}

const struct command command_import = {
    .place = 120,
    .name = "import",
    .summary = "turn a foreign recording (UFF, MAT, LVM, WAV, CSV) into a record",
    .help = import_about,
    .options = import_options,
    .closing = import_closing,
    .answer = import_fields,
    .run = run,
};
