/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "record_sets.h"

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

enum bf_status record_list_read(struct record_list *list, const struct model *model, struct bf_error *err)
{
    list->records = bf_alloc(list->n_names, sizeof *list->records);
    for (; list->n < list->n_names; list->n++)
        if (record_read(list->names[list->n], &list->records[list->n], err) != BF_OK)
            return err->status;
    for (size_t i = 0; i < list->n; i++)
        if (find_state(model, &list->records[i], err) != BF_OK)
            return err->status;
    return BF_OK;
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
    return check_held_out(sets, err);
}

void record_sets_free(struct record_sets *sets)
{
    record_list_free(&sets->fitted);
    record_list_free(&sets->held_out);
}
