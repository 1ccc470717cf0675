/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "watch.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "commands.h"

static const struct answer_field fields[] = {
    ANSWER_SAY("{address}", .flags = ANSWER_VERBATIM),
    ANSWER_SAY("Open this in a browser on this machine. Ctrl-C ends it."),
    ANSWER_ROW(TEXT, "address", "to open in a browser on this machine"),
    {0},
};

static const char help[] =
    "Usage: beamfit watch MODEL RECORD... [--check RECORD...] [options]\n"
    "\n"
    "Shows the page of `beamfit report` live, in a browser on this machine: pick records, compare, fit, diagnose,\n"
    "click an explanation to add and refit it and watch the error fall, undo, save the model. Each button does\n"
    "what the command of its name does.\n"
    "\n"
    "The address that is printed holds a random token and works on this machine only; who has it can do what the\n"
    "page can. Nothing is written but the models that you save.\n";

static const struct option_row options[] = {
    RECORD_SETS_CHECK("records that are held out at first"),
    {'f', 0, "folder", "DIR", NULL,
     "where models are saved (default: the directory you are in); nothing else is written. A file that `watch` has "
     "not made is not replaced"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace files that are not its own"},
    {'p', 0, "port", "N", NULL, "port on 127.0.0.1 (default: any free one)"},
    OPTION_INTERSAMPLE('i'),
    OPTIONS_JSON,
    {0},
};

static const char closing[] =
    "Ctrl-C ends it.\n"
    "\n"
    "Example:\n"
    "  beamfit watch fitted.yaml tap1.csv tap2.csv --check tap3.csv\n"
    "\n"
    "Exit status: 0 ended by Ctrl-C; 2 usage, or the port is taken; 3 bad model or record, or DIR not writable; 4\n"
    "the model cannot be evaluated.\n";

struct arguments {
    struct record_sets sets;
    const char *folder;
    long port;
    struct predict_options predict;
};

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    enum { PORTS = 65535 };
    switch (code) {
    case 'f':
        a->folder = optarg;
        return BF_OK;
    case 'p':
        return options_count("--port", optarg, 1, PORTS, &a->port, err);
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
        return bf_fail(err, BF_USAGE, "give a model and at least one record: beamfit watch MODEL RECORD...");
    return BF_OK;
}

static enum bf_status check_folder(const char *folder, struct bf_error *err)
{
    struct stat info;
    if (stat(folder, &info) != 0 || !S_ISDIR(info.st_mode))
        return bf_fail_at(err, folder, 0, "is no directory; make it, or choose another with --folder");
    return BF_OK;
}

/* ---- What the work says ---- */

static void on_progress(void *context, const char *what, double fraction, const char *note)
{
    struct watch *w = context;
    pthread_mutex_lock(&w->lock);
    (void)snprintf(w->what, sizeof w->what, "%s", what);
    (void)snprintf(w->note, sizeof w->note, "%.390s", note);
    w->fraction = fraction;
    pthread_mutex_unlock(&w->lock);
}

static void on_warning(void *context, const char *text)
{
    struct watch *w = context;
    pthread_mutex_lock(&w->lock);
    if (w->n_warnings < WATCH_WARNINGS)
        (void)snprintf(w->warnings[w->n_warnings++], WATCH_TEXT, "%.390s", text);
    pthread_mutex_unlock(&w->lock);
}

/* ---- Begin, wait, end ---- */

/* Everything is in place before the first request. */
static enum bf_status begin(struct watch *w, struct arguments *a, struct bf_error *err)
{
    const struct record_list *all = &a->sets.fitted;
    const size_t n_fitted = all->n - a->sets.held_out.n_names;
    w->folder = a->folder;
    w->predict = a->predict;
    w->records = all->records;
    w->n_records = all->n;
    w->selected = bf_alloc(all->n, sizeof *w->selected);
    w->use = bf_alloc(all->n, sizeof *w->use);
    for (size_t i = 0; i < all->n; i++)
        w->use[i] = i < n_fitted ? WATCH_FIT : WATCH_CHECK;
    struct watch_step *first = bf_alloc(1, sizeof *first);
    (void)snprintf(first->name, sizeof first->name, "%.300s", text_base_name(a->sets.model));
    first->nrmse = first->noise_ratio = first->check_nrmse = first->check_noise_ratio = NAN;
    w->steps = bf_alloc(1, sizeof *w->steps);
    w->steps[0] = first;
    w->n_steps = 1;
    FILE *f = open_memstream(&w->page, &w->n_page);
    if (f == NULL)
        return bf_fail(err, BF_NUMERIC, "no memory for the page (%s)", strerror(errno));
    watch_page_write(f, text_base_name(a->sets.model));
    (void)fclose(f);
    const enum bf_status status = model_read(a->sets.model, &first->model, err);
    if (status == BF_OK)
        watch_run_job(w, &(const struct watch_job){.name = "compare"});
    return status != BF_OK ? status : w->error[0] != '\0' ? bf_fail(err, BF_NUMERIC, "%s", w->error) : BF_OK;
}

/* The next job; false: Ctrl-C. */
static bool next_job(struct watch *w, struct watch_job *job)
{
    enum { TENTH_NS = 100000000, SECOND_NS = 1000000000 };
    pthread_mutex_lock(&w->lock);
    while (w->waiting.name == NULL && !progress_interrupted()) {
        struct timespec until;
        (void)clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += TENTH_NS;
        until.tv_sec += until.tv_nsec / SECOND_NS;
        until.tv_nsec %= SECOND_NS;
        (void)pthread_cond_timedwait(&w->wake, &w->lock, &until);
    }
    const bool there = !progress_interrupted();
    *job = w->waiting;
    w->running = w->waiting;
    w->waiting.name = NULL;
    w->n_warnings = 0;
    pthread_mutex_unlock(&w->lock);
    return there;
}

static void end_job(struct watch *w)
{
    pthread_mutex_lock(&w->lock);
    w->running.name = NULL;
    w->what[0] = w->note[0] = '\0';
    if (w->stopping)
        progress_catch_interrupts(); /* it was the page, not Ctrl-C */
    w->stopping = false;
    pthread_mutex_unlock(&w->lock);
}

static enum bf_status print_address(const char *address, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "address", address);
    return answer_print_line_and_free(root, fields, err);
}

static enum bf_status serve(struct watch *w, const struct arguments *a, struct bf_error *err)
{
    struct server *server = NULL;
    struct watch_job job;
    char *policy = NULL;
    size_t n = 0;
    FILE *f = open_memstream(&policy, &n);
    if (f == NULL)
        return bf_fail(err, BF_NUMERIC, "no memory (%s)", strerror(errno));
    watch_page_policy(f);
    (void)fclose(f);
    enum bf_status status = server_start((unsigned)a->port, policy, watch_answer, w, &server, err);
    if (status == BF_OK) {
        progress_catch_interrupts();
        status = print_address(server_address(server), err);
        while (status == BF_OK && next_job(w, &job)) {
            watch_run_job(w, &job);
            end_job(w);
        }
    }
    server_stop(server);
    free(policy);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.folder = "."};
    struct record_list *const all = &a.sets.fitted; /* and then the held-out ones */
    struct watch w = {.lock = PTHREAD_MUTEX_INITIALIZER, .wake = PTHREAD_COND_INITIALIZER};
    struct model model = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    for (size_t i = 0; i < a.sets.held_out.n_names; i++)
        record_list_add(all, a.sets.held_out.names[i]);
    if (status == BF_OK)
        status = check_folder(a.folder, err);
    if (status == BF_OK)
        status = model_read(a.sets.model, &model, err);
    if (status == BF_OK)
        status = record_list_read(all, &model, err);
    if (status == BF_OK)
        record_lists_clean(&model, all, NULL);
    model_free(&model);
    progress_listen(on_progress, &w);
    bf_warn_listen(on_warning, &w);
    if (status == BF_OK)
        status = begin(&w, &a, err);
    if (status == BF_OK)
        status = serve(&w, &a, err);
    progress_listen(NULL, NULL);
    bf_warn_listen(answer_take_warning, NULL);
    watch_free(&w);
    record_sets_free(&a.sets);
    return status;
}

const struct command command_watch = {
    .place = 112,
    .name = "watch",
    .summary = "the page live in a browser: compare, diagnose, add by a click, undo, save",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
