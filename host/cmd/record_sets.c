/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "record_sets.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "noise/noise.h"

void record_list_add(struct record_list *list, const char *name)
{
    list->names = bf_grow(list->names, list->n_names + 1, sizeof *list->names);
    list->names[list->n_names++] = name;
}

static enum bf_status find_state(const struct model *model, struct record *record, struct bf_error *err)
{
    bool found;
    const enum bf_status status = initial_state_find(model, record, &found, err);
    if (status == BF_OK && found)
        bf_warn("%s: the record begins in motion, so that its initial state is estimated; "
                "'# initial_state: free' in it says the same, 'rest' forbids it",
                record->path);
    return status;
}

/* Those over time first, in their order: the others are fitted beside them. */
static void order(struct record_list *list)
{
    struct record *records = bf_alloc(list->n, sizeof *records);
    const char **names = bf_alloc(list->n, sizeof *names);
    size_t n = 0;
    for (int sampled = 1; sampled >= 0; sampled--)
        for (size_t i = 0; i < list->n; i++)
            if ((list->records[i].kind == RECORD_SAMPLES) == (sampled == 1)) {
                names[n] = list->names[i];
                records[n++] = list->records[i];
            }
    free(list->records), free(list->names);
    list->records = records, list->names = names;
}

size_t record_list_sampled(const struct record_list *list)
{
    size_t n = 0;
    while (n < list->n && list->records[n].kind == RECORD_SAMPLES)
        n++;
    return n;
}

static enum bf_status read_whole(void *context, const char *path, struct record *out, struct bf_error *err)
{
    (void)context;
    return record_read(path, out, err);
}

enum bf_status record_list_read(struct record_list *list, const struct model *model, struct bf_error *err)
{
    const struct record_reader whole = {.read = read_whole};
    return record_list_read_by(list, model, &whole, err);
}

enum bf_status record_list_read_by(struct record_list *list, const struct model *model,
                                   const struct record_reader *reader, struct bf_error *err)
{
    list->records = bf_alloc(list->n_names, sizeof *list->records);
    for (; list->n < list->n_names; list->n++)
        if (reader->read(reader->context, list->names[list->n], &list->records[list->n], err) != BF_OK)
            return err->status;
    order(list);
    for (size_t i = 0; i < record_list_sampled(list); i++)
        if (find_state(model, &list->records[i], err) != BF_OK)
            return err->status;
    return BF_OK;
}

/* Of an input's peak: less noise is not worth a line. */
static const double worth_telling = 1e-4;

/* One line for the input in all records. */
static void tell_cleaned(const struct clean_input_list *list, const char *input)
{
    double noise = 0.0, kept = 0.0;
    size_t n = 0;
    for (size_t i = 0; i < list->n; i++)
        if (strcmp(list->all[i].channel, input) == 0) {
            noise = fmax(noise, list->all[i].noise);
            kept += list->all[i].kept;
            n++;
        }
    if (noise < worth_telling)
        return;
    bf_warn("%s: noise of %s%.2g %% of its peak (%zu record%s). Where nothing stands out of it the input is taken as "
            "zero, so that %.0f %% of the noise does not drive the model; '# input_noise: keep' in a record forbids it",
            input, n > 1 ? "up to " : "", 100.0 * noise, n, n > 1 ? "s" : "", 100.0 * (1.0 - kept / (double)n));
}

static void clean_inputs(const struct model *model, struct record *const records[], size_t n)
{
    struct clean_input_list found;
    struct bf_error err;
    if (inputs_clean(model, records, n, &found, &err) != BF_OK)
        bf_warn("noise of measured inputs was not looked for: %s", err.text);
    for (size_t i = 0; i < model->n_inputs; i++)
        tell_cleaned(&found, model->inputs[i].name);
    inputs_clean_free(&found);
}

static void take_baselines(const struct model *model, struct record *const records[], size_t n)
{
    struct baseline_list found;
    struct bf_error err;
    if (baselines_take_off(model, records, n, &found, &err) != BF_OK)
        bf_warn("zero shifts of accelerometers were not looked for: %s", err.text);
    for (size_t i = 0; i < found.n; i++)
        bf_warn("%s: %s has left its zero: a baseline of %.3g m/s² at the first input and %.3g at the end, %.2g %% of "
                "the channel's rms, and other records have another. No motion of a held beam is so slow; it is taken "
                "off, and '# baseline: keep' in the record forbids it",
                found.all[i].record->path, found.all[i].channel, found.all[i].first, found.all[i].last,
                100.0 * found.all[i].share);
    baselines_free(&found);
}

static void cut_starts(const struct model *model, struct record *const records[], size_t n)
{
    struct decay_start_list found;
    struct bf_error err;
    if (decay_starts_cut(model, records, n, &found, &err) != BF_OK)
        bf_warn("beginnings of free decays were not looked at: %s", err.text);
    for (size_t i = 0; i < found.n; i++) {
        const struct decay_start *start = &found.all[i];
        char samples[40] = "first sample";
        if (start->n > 1)
            (void)snprintf(samples, sizeof samples, "first %zu samples", start->n);
        bf_warn("%s: the %s of %s do%s not follow from those after %s, by up to %.2g times what the others are off by: "
                "the blow, or the answer of the recorder's filter, is not over. The record is taken from then on; "
                "'# free_from_s: T' in it says from when, and forbids it",
                start->record->path, samples, start->channel, start->n > 1 ? "" : "es", start->n > 1 ? "them" : "it",
                start->times);
    }
    decay_starts_free(&found);
}

/* Said where the model bends: all else does not feel the recorder's filter. */
static void assume_filters(const struct model *model, struct record *const records[], size_t n)
{
    size_t assumed = 0, last = 0;
    for (size_t i = 0; i < n; i++)
        if (record_assume_filter(records[i]))
            last = i, assumed++;
    if (assumed > 0 && model_bends(model))
        bf_warn(
            "%s%s no anti-alias filter of the recorder, and what is not linear in the model feels one: %s is taken. "
            "'# anti-alias filter: Butterworth order N at F Hz' in a record says which, 'none' that there is none",
            records[last]->path, assumed > 1 ? " and others state" : " states",
            record_meta(records[last], RECORD_FILTER));
}

void record_lists_clean(const struct model *model, struct record_list *fitted, struct record_list *held_out)
{
    struct record_list *const lists[2] = {fitted, held_out};
    struct record **records = bf_alloc(fitted->n + (held_out ? held_out->n : 0) + 1, sizeof *records);
    size_t n = 0;
    for (size_t i = 0; i < 2; i++)
        for (size_t r = 0; lists[i] != NULL && r < record_list_sampled(lists[i]); r++)
            records[n++] = &lists[i]->records[r];
    clean_inputs(model, records, n);
    take_baselines(model, records, n);
    cut_starts(model, records, n);
    assume_filters(model, records, n);
    free(records);
}

void record_list_free(struct record_list *list)
{
    for (size_t i = 0; i < list->n; i++)
        record_free(&list->records[i]);
    free(list->records), free(list->names);
    *list = (struct record_list){0};
}

static void add_name(struct record_sets *sets, const char *name)
{
    if (sets->checking)
        record_list_add(&sets->held_out, name);
    else if (sets->model == NULL)
        sets->model = name;
    else
        record_list_add(&sets->fitted, name);
}

int record_sets_next(struct record_sets *sets, int argc, char **argv, const struct option_row rows[],
                     struct bf_error *err)
{
    int code;
    while ((code = options_next_or_word(argc, argv, rows, err)) == OPTION_WORD || code == RECORD_SETS_CHECK_CODE) {
        sets->checking = sets->checking || code == RECORD_SETS_CHECK_CODE;
        add_name(sets, optarg);
    }
    for (; code == -1 && optind < argc; optind++) /* behind "--" */
        add_name(sets, argv[optind]);
    sets->checking = false;
    return code;
}

/* The same numbers in the same columns, whatever the files are called and say of themselves. */
static bool same_content(const struct record *a, const struct record *b)
{
    bool same = a->n == b->n && a->n_columns == b->n_columns;
    for (size_t i = 0; same && i < a->n_columns; i++) {
        const double *x = record_column(b, a->columns[i].name);
        same = x != NULL && memcmp(x, a->columns[i].x, a->n * sizeof *x) == 0;
    }
    return same;
}

static enum bf_status check_held_out(const struct record_sets *sets, struct bf_error *err)
{
    for (size_t i = 0; i < sets->held_out.n; i++)
        for (size_t j = 0; j < sets->fitted.n; j++)
            if (same_content(&sets->held_out.records[i], &sets->fitted.records[j]))
                return bf_fail(
                    err, BF_USAGE,
                    "%s: is held out, and has the content of %s, which is fitted; hold out another record, or "
                    "leave this one out of the fit",
                    sets->held_out.names[i], sets->fitted.names[j]);
    return BF_OK;
}

enum bf_status record_sets_read(struct record_sets *sets, const struct model *model, struct bf_error *err)
{
    if (record_list_read(&sets->fitted, model, err) != BF_OK || record_list_read(&sets->held_out, model, err) != BF_OK)
        return err->status;
    record_lists_clean(model, &sets->fitted, &sets->held_out);
    return check_held_out(sets, err);
}

void record_sets_free(struct record_sets *sets)
{
    record_list_free(&sets->fitted);
    record_list_free(&sets->held_out);
}

void record_sets_join(const struct record_sets *sets, struct record_join *out)
{
    const struct record_list *lists[2] = {&sets->fitted, &sets->held_out};
    const size_t n_sampled[2] = {record_list_sampled(lists[0]), record_list_sampled(lists[1])};
    size_t n = 0;
    *out = (struct record_join){.n_sampled = n_sampled[0] + n_sampled[1],
                                .n_sampled_held_out = n_sampled[1],
                                .n_lines = lists[0]->n + lists[1]->n - n_sampled[0] - n_sampled[1],
                                .n_lines_held_out = lists[1]->n - n_sampled[1]};
    out->records = bf_alloc(lists[0]->n + lists[1]->n + 1, sizeof *out->records);
    for (int lines = 0; lines < 2; lines++)
        for (int i = 0; i < 2; i++)
            for (size_t r = lines ? n_sampled[i] : 0; r < (lines ? lists[i]->n : n_sampled[i]); r++)
                out->records[n++] = lists[i]->records[r];
}
