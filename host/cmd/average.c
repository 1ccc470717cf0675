/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "ground/ground.h"
#include "record/record.h"
#include "show/show.h"

static const struct answer_field record_fields[] = {
    ANSWER_ROW(TEXT, "file", "of the hit", .text = "record"),
    ANSWER_ROW(NUMBER, "level", "largest force", .digits = 4, .text = "largest force"),
    {0},
};

static const struct answer_field response_fields[] = {
    ANSWER_ROW(TEXT, "name", "OUTPUT/INPUT", .text = "response"),
    ANSWER_ROW(NUMBER, "nrmse", "scatter of the hits about it, over the signal", .flags = ANSWER_PERCENT, .digits = 2,
               .text = "hits scatter by"),
    ANSWER_ROW(TEXT, "odd", "a record that stands out; empty: none", .text = "stands out"),
    ANSWER_ROW(NUMBER, "odd_nrmse", "its error under the response of the others", .flags = ANSWER_PERCENT, .digits = 3,
               .text = "from the others by"),
    ANSWER_ROW(NUMBER, "others_nrmse", "scatter of the others", .flags = ANSWER_PERCENT, .digits = 2,
               .text = "which scatter by"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(COUNT, "averages", "hits in it"),
    ANSWER_ROW(COUNT, "lines", "of each response, the first at 0 Hz"),
    ANSWER_ROW(NUMBER, "step_Hz", "distance of the lines"),
    ANSWER_ROW(NUMBER, "last_Hz", "frequency of the last line"),
    ANSWER_ROW(NUMBER, "window_s", "time constant of the exponential window; null: none was needed",
               .flags = ANSWER_NULL),
    ANSWER_SAY("{file}: {averages} hits, {lines} lines, 0 Hz to {last_Hz}[; exponential window of {window_s}, which is "
               "taken off again by what reads the file]"),
    ANSWER_ROW_OF(LIST, "records", "that were averaged", record_fields, .flags = ANSWER_TABLE, .text = ""),
    ANSWER_ROW_OF(LIST, "responses", "and how well the hits agree", response_fields, .flags = ANSWER_TABLE, .text = ""),
    {0},
};

static const char help[] =
    "Usage: beamfit average RECORD RECORD... -o OUT.csv [options]\n"
    "\n"
    "Makes one frequency response of repeated hits at one place: H1 of every answer over the force, with the\n"
    "coherence that the hits' scatter makes. `fit`, `compare`, `diagnose` and `report` take the file as a record,\n"
    "and what did not repeat from hit to hit is its noise, line by line. Hits may differ in strength and length.\n"
    "A hit that does not agree with the others is named.\n";

static const struct option_row options[] = {
    {'o', 'o', "output", "OUT", NULL, "the file to write"},
    {'i', 0, "input", "NAME", NULL, "the column that hits (default: the only one of force, …_N)"},
    {'t', 0, "to", "HZ", NULL,
     "the last line (default: where the hits have fallen 20 dB below their strongest line, from which on a hammer "
     "tells little)"},
    {'w', 0, "window", "S", NULL,
     "time constant of an exponential window on hits and answers (default: the one that leaves 1e-4 of the signal at "
     "the end, and none where the beam is at rest by then)"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace OUT even when `average` has not made it or somebody has changed it"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit average hit1.csv hit2.csv hit3.csv -o frf.csv\n"
    "  beamfit fit model.yaml frf.csv -o fitted.yaml\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad records, records that do not go together, or OUT not writable.\n";

struct arguments {
    const char *output, **names;
    size_t n;
    struct average_options how;
};

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case OPTION_WORD:
        a->names = bf_grow(a->names, a->n + 1, sizeof *a->names);
        a->names[a->n++] = optarg;
        return BF_OK;
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'i':
        a->how.input = optarg;
        return BF_OK;
    case 't':
        return options_number("--to", optarg, &a->how.to_Hz, err);
    case 'w':
        return options_number("--window", optarg, &a->how.window_s, err);
    default:
        return BF_USAGE;
    }
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next_or_word(argc, argv, options, err)) != -1)
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    if (a->n < 2 || a->output == NULL)
        return bf_fail(err, BF_USAGE, "give two hits or more: beamfit average RECORD RECORD... -o OUT.csv");
    if (a->how.to_Hz < 0.0 || a->how.window_s < 0.0)
        return bf_fail(err, BF_USAGE, "--to and --window are not negative");
    return options_one_answer(a->output, err);
}

static void put_responses(struct json *root, const struct record records[], const struct average *average)
{
    struct json *list = json_put(root, "responses", json_new_array());
    for (size_t o = 0; o < average->n_outputs; o++) {
        const struct repeats *r = &average->agree[o];
        struct json *one = json_push(list, json_new_object());
        char name[300];
        (void)snprintf(name, sizeof name, "%.120s/%.120s", average->outputs[o], average->input);
        json_put_text(one, "name", name);
        json_put_number(one, "nrmse", r->nrmse);
        json_put_text(one, "odd", r->stands_out ? record_base_name(&records[r->odd]) : "");
        json_put_number(one, "odd_nrmse", r->stands_out ? r->odd_nrmse : nan(""));
        json_put_number(one, "others_nrmse", r->stands_out ? r->others_nrmse : nan(""));
    }
}

static enum bf_status answer(const struct arguments *a, const struct record records[], const struct record *out,
                             const struct average *average, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "file", a->output);
    json_put_number(root, "averages", (double)a->n);
    json_put_number(root, "lines", (double)out->n);
    json_put_number(root, "step_Hz", out->dt_s);
    json_put_number(root, "last_Hz", average->to_Hz);
    json_put_number(root, "window_s", average->window_s > 0.0 ? average->window_s : nan(""));
    struct json *list = json_put(root, "records", json_new_array());
    for (size_t r = 0; r < a->n; r++) {
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "file", record_base_name(&records[r]));
        json_put_number(one, "level", average->level[r]);
    }
    put_responses(root, records, average);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status average_and_write(const struct arguments *a, const struct record records[], struct bf_error *err)
{
    struct record out;
    struct average average;
    enum bf_status status = record_average(records, a->n, &a->how, &out, &average, err);
    if (status != BF_OK)
        return status;
    status = record_write(a->output, &out, 0, err);
    if (status == BF_OK && strcmp(a->output, "-") != 0)
        status = answer(a, records, &out, &average, err);
    average_free(&average);
    record_free(&out);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    struct record *records = bf_alloc(a.n + 1, sizeof *records);
    size_t n = 0;
    while (status == BF_OK && n < a.n)
        if ((status = record_read(a.names[n], &records[n], err)) == BF_OK)
            n++;
    if (status == BF_OK)
        status = atomic_check(a.output, err);
    if (status == BF_OK)
        status = average_and_write(&a, records, err);
    for (size_t r = 0; r < n; r++)
        record_free(&records[r]);
    free(records), free(a.names);
    return status;
}

const struct command command_average = {
    .place = 122,
    .name = "average",
    .summary = "repeated hits as one frequency response with coherence",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
