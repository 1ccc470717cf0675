/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "record_sets.h"

#include <stdlib.h>

void record_list_add(struct record_list *list, const char *name)
{
    list->names = bf_grow(list->names, list->n_names + 1, sizeof *list->names);
    list->names[list->n_names++] = name;
}

enum bf_status record_list_read(struct record_list *list, struct bf_error *err)
{
    list->records = bf_alloc(list->n_names, sizeof *list->records);
    for (; list->n < list->n_names; list->n++)
        if (record_read(list->names[list->n], &list->records[list->n], err) != BF_OK)
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

int record_sets_next(struct record_sets *sets, int argc, char **argv, const char *short_options,
                     const struct option *long_options, struct bf_error *err)
{
    enum { NAME = 1 }; /* getopt's code for a word that is no option */
    int code;
    while ((code = options_next(argc, argv, short_options, long_options, err)) == NAME || code == 'c') {
        if (code == NAME)
            add_name(sets, optarg);
        else
            sets->checking = true;
    }
    for (; code == -1 && optind < argc; optind++) /* behind "--" */
        add_name(sets, argv[optind]);
    sets->checking = false;
    return code;
}

enum bf_status record_sets_read(struct record_sets *sets, struct bf_error *err)
{
    return record_list_read(&sets->fitted, err) == BF_OK ? record_list_read(&sets->held_out, err) : err->status;
}

void record_sets_free(struct record_sets *sets)
{
    record_list_free(&sets->fitted);
    record_list_free(&sets->held_out);
}
