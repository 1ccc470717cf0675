/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fleet_fit.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "fleet_options.h"
#include "noise/noise.h"
#include "show/show.h"

/* Records that share a reduced space, transfer functions and the memory of a Jacobian. Another number changes the last digits of a fit. */
enum { SHARE_RECORDS_MOST = 8 };

/* ---- Words of the command ---- */

static enum bf_status take_word(struct fleet_fit *fit, const char *word, struct bf_error *err)
{
    if (word[0] == '@' && fit->files.n > 0)
        return fleet_list_read(word + 1, &fit->files, err);
    fit->files.names = bf_grow(fit->files.names, fit->files.n + 1, sizeof *fit->files.names);
    fit->files.names[fit->files.n++] = bf_strdup(word);
    return BF_OK;
}

enum bf_status fleet_fit_parse(int argc, char **argv, struct fleet_fit *fit, struct bf_error *err)
{
    struct fleet_arguments *a = &fit->arguments;
    int code;
    while ((code = options_next(argc, argv, fleet_options, err)) != -1) {
        if (strchr("osinNp", code) == NULL && err->status == BF_OK)
            return bf_fail(err, BF_USAGE,
                           "`fleet fit` takes -o, --start, --no-search, --intersample, --splines, --processes, --json");
        if (fleet_take_option(code, a, err) != BF_OK)
            return BF_USAGE;
    }
    for (; optind < argc; optind++)
        if (take_word(fit, argv[optind], err) != BF_OK)
            return err->status;
    if (fit->files.n < 2)
        return bf_fail(
            err, BF_USAGE,
            "give a model and records, or @LIST, a file that names them: fleet fit MODEL RECORD... -o FITTED");
    if (a->output == NULL)
        return bf_fail(err, BF_USAGE, "say where to write the fitted model: -o FITTED");
    if (a->settings.fit.start == FIT_SEARCH)
        return bf_fail(err, BF_USAGE,
                       "`fleet fit` does not search; `beamfit fit --start search` with some of the "
                       "records finds a start");
    a->settings.fit.never_search = true;
    a->settings.fit.predict.threads = 1; /* shares are what runs side by side */
    return options_one_answer(a->output, err);
}

/* ---- Shares ---- */

struct queue {
    struct fleet_fit *fit;
    const struct fit_message *question; /* NULL: they are to be opened */
    struct fit_message *answers;
    atomic_size_t next;
};

/* As `fit` does, without a line for each of very many records. */
static void clean(const struct model *model, struct record_list *list)
{
    struct bf_error ignored;
    const size_t n = record_list_sampled(list);
    struct record **records = bf_alloc(n + 1, sizeof *records);
    struct clean_input_list found;
    for (size_t r = 0; r < n; r++) {
        records[r] = &list->records[r];
        (void)record_assume_filter(records[r]);
    }
    (void)inputs_clean(model, records, n, &found, &ignored);
    inputs_clean_free(&found);
    free(records);
}

static void open_share(struct fleet_fit *fit, size_t s)
{
    struct fleet_share *share = &fit->shares[s];
    const size_t first = 1 + s * SHARE_RECORDS_MOST;
    for (size_t i = first; i < fit->files.n && i < first + SHARE_RECORDS_MOST; i++)
        record_list_add(&share->list, fit->files.names[i]);
    if (record_list_read(&share->list, &fit->model, &share->err) != BF_OK)
        return;
    clean(&fit->model, &share->list);
    (void)fit_share_new(&fit->model, share->list.records, share->list.n, &fit->arguments.settings.fit, &share->share,
                        &share->err);
}

static void *work(void *context)
{
    struct queue *queue = context;
    struct fleet_fit *fit = queue->fit;
    for (;;) {
        const size_t s = fit->rank + fit->n_ranks * atomic_fetch_add(&queue->next, 1);
        if (s >= fit->n_shares)
            return NULL;
        if (queue->question == NULL)
            open_share(fit, s);
        else
            fit_share_answer(fit->shares[s].share, queue->question, &queue->answers[s]);
    }
}

static void run_queue(struct fleet_fit *fit, const struct fit_message *question, struct fit_message answers[])
{
    struct queue queue = {.fit = fit, .question = question, .answers = answers};
    workers_run((int)fit->arguments.processes, fit->n_shares, work, &queue);
}

enum bf_status fleet_fit_open(struct fleet_fit *fit, size_t rank, size_t n_ranks, struct bf_error *err)
{
    fit->rank = rank, fit->n_ranks = n_ranks;
    fit->n_shares = (fit->files.n - 1 + SHARE_RECORDS_MOST - 1) / SHARE_RECORDS_MOST;
    fit->shares = bf_alloc(fit->n_shares, sizeof *fit->shares);
    if (model_read(fit->files.names[0], &fit->model, err) != BF_OK)
        return err->status;
    run_queue(fit, NULL, NULL);
    for (size_t s = 0; s < fit->n_shares; s++)
        if (fit->shares[s].err.status != BF_OK) {
            *err = fit->shares[s].err;
            return err->status;
        }
    return BF_OK;
}

void fleet_fit_answer(struct fleet_fit *fit, const struct fit_message *question, struct fit_message answers[])
{
    run_queue(fit, question, answers);
}

void fleet_fit_free(struct fleet_fit *fit)
{
    for (size_t s = 0; s < fit->n_shares && fit->shares != NULL; s++) {
        fit_share_free(fit->shares[s].share);
        record_list_free(&fit->shares[s].list);
    }
    free(fit->shares);
    fleet_files_free(&fit->files);
    model_free(&fit->model);
}

/* ---- The fit ---- */

static enum bf_status answer(const struct fleet_fit *fit, const struct fit_result *result,
                             const struct record records[], struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "fitted_model", fit->arguments.output);
    (void)json_put(root, "fit", fit_shared_json(result, records));
    if (strcmp(fit->arguments.output, "-") != 0)
        return answer_print_and_free(root, fleet_fields, err);
    answer_print_text(stderr, root, fleet_fields); /* the model is on standard output */
    json_discard(root);
    return BF_OK;
}

static enum bf_status fit_shares_and_write(struct fleet_fit *fit, const struct fit_shares *shares,
                                           struct fit_result *result, struct bf_error *err)
{
    const struct fit_check none = {.n = 0};
    struct fit_options options = fit->arguments.settings.fit;
    options.shares = shares;
    enum bf_status status = fit_run(&fit->model, shares->records, shares->n_records, &options, result, err);
    if (status != BF_OK)
        return status;
    const bool learned = result->interrupted || fit_learned(result);
    fit_into_model(result, shares->records, &none, &fit->model);
    status = learned ? model_write(fit->arguments.output, &fit->model, err) : BF_OK;
    if (status == BF_OK)
        status = answer(fit, result, shares->records, err);
    if (status != BF_OK || learned)
        return status;
    return bf_fail(err, BF_NO,
                   "nothing was fitted: the records determine none of the free parameters; %s is not written",
                   fit->arguments.output);
}

enum bf_status fleet_fit_run(struct fleet_fit *fit,
                             enum bf_status (*ask)(void *context, const struct fit_message *question,
                                                   struct fit_message answers[], struct bf_error *err),
                             void *context, struct bf_error *err)
{
    struct fit_shares shares = {.n = fit->n_shares, .ask = ask, .context = context};
    struct fit_result result = {.n_parameters = 0};
    enum bf_status status = atomic_check(fit->arguments.output, err);
    if (status == BF_OK)
        status = fit_shares_open(&shares, &fit->model, err);
    if (status == BF_OK)
        status = fit_shares_and_write(fit, &shares, &result, err);
    fit_free(&result);
    fit_shares_close(&shares);
    return status;
}

static enum bf_status ask_here(void *context, const struct fit_message *question, struct fit_message answers[],
                               struct bf_error *err)
{
    (void)err;
    fleet_fit_answer(context, question, answers);
    return BF_OK;
}

enum bf_status fleet_fit(int argc, char **argv, struct bf_error *err)
{
    struct fleet_fit fit = {.n_shares = 0};
    enum bf_status status = fleet_fit_parse(argc, argv, &fit, err);
    if (status == BF_OK)
        status = fleet_fit_open(&fit, 0, 1, err);
    if (status == BF_OK) {
        progress_catch_interrupts();
        status = fleet_fit_run(&fit, ask_here, &fit, err);
    }
    fleet_fit_free(&fit);
    return status;
}
