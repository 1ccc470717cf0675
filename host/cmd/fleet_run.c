/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fleet_run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "show/show.h"

static double now_s(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

enum bf_status fleet_take_option(int code, struct fleet_arguments *a, struct bf_error *err)
{
    static const char *const starts[] = {"given", "near", "search"}; /* order of enum fit_start */
    enum { MOST = 256 };
    size_t chosen = 0;
    long count = 0;
    enum bf_status status = BF_OK;
    switch (code) {
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'd':
        a->settings.diagnose = true;
        return BF_OK;
    case 's':
        status = options_choice("--start", optarg, starts, 3, &chosen, err);
        a->settings.fit.start = (enum fit_start)chosen;
        return status;
    case 'n':
        a->settings.fit.never_search = true;
        return BF_OK;
    case 'i':
        return intersample_from_text(optarg, &a->settings.fit.predict.intersample, err);
    case 'N':
        return splines_from_text(optarg, &a->settings.fit.predict, err);
    case 'p':
        status = options_count("--processes", optarg, 1, MOST, &count, err);
        a->processes = (size_t)count;
        return status;
    case 'l':
        return options_positive("--limit", optarg, INFINITY, &a->limit_s, err);
    default:
        return BF_USAGE;
    }
}

enum bf_status fleet_check_arguments(int argc, char **argv, struct fleet_arguments *a, struct bf_error *err)
{
    if (argc - optind != 1)
        return bf_fail(err, BF_USAGE, "give one manifest: beamfit fleet MANIFEST -o RESULTS");
    if (a->output == NULL)
        return bf_fail(err, BF_USAGE, "say where the results go: -o RESULTS");
    a->manifest = argv[optind];
    a->settings.fit.quiet = true;
    a->settings.fit.predict.threads = 1; /* units are what runs side by side */
    return BF_OK;
}

enum bf_status fleet_run_open(struct fleet_run *run, bool writes, struct bf_error *err)
{
    enum bf_status status = fleet_manifest_read(run->arguments.manifest, &run->manifest, err);
    run->since_s = now_s();
    run->was_there = bf_alloc(run->manifest.n, sizeof *run->was_there);
    if (status == BF_OK && writes) {
        status = fleet_results_open(run->arguments.output, &run->manifest, &run->results, err);
        run->progress = progress_begin("units");
    }
    return status;
}

bool fleet_run_next(struct fleet_run *run, struct fleet_job *job)
{
    if (run->next == run->manifest.n || run->err.status != BF_OK || progress_interrupted())
        return false;
    job->unit = run->next++;
    fleet_results_identity(run->results, run->manifest.units[job->unit].name, job->identity);
    run->was_there[job->unit] = job->identity[0] != '\0';
    return true;
}

void fleet_run_work(void *context, const struct fleet_job *job, struct fleet_report *report)
{
    const struct fleet_run *run = context;
    fleet_unit_work(&run->manifest.units[job->unit], &run->arguments.settings, job, report);
}

/* "done", "failed", "killed": what the rows say became of the unit. */
static const char *status_of(const struct fleet_rows *rows, struct fleet_value values[FLEET_COLUMNS])
{
    enum fleet_table table;
    size_t at = 0;
    while (fleet_rows_next(rows->bytes, rows->n, &at, &table, values))
        if (table == FLEET_UNITS)
            return values[1].text;
    return "failed";
}

double fleet_run_left_s(const struct fleet_run *run)
{
    if (run->fitted == 0)
        return nan("");
    return (now_s() - run->since_s - run->before_s) / (double)run->fitted * (double)(run->manifest.n - run->answered);
}

/* A process that was ended says nothing of its unit: what is known of it stays, and the same command tries it again. */
static void keep(struct fleet_run *run, size_t unit, const struct fleet_rows *rows)
{
    struct fleet_value values[FLEET_COLUMNS];
    const char *name = run->manifest.units[unit].name, *status = status_of(rows, values);
    run->fitted++;
    run->failed += strcmp(status, "done") != 0;
    if (strcmp(status, "killed") == 0 && run->was_there[unit]) {
        bf_warn("%s: %s; what was known of it is kept, the same command tries it again", name, values[2].text);
        return;
    }
    run->refitted += run->was_there[unit];
    (void)fleet_results_store(run->results, name, rows, &run->err);
}

void fleet_run_take(void *context, size_t unit, const struct fleet_rows *rows)
{
    struct fleet_run *run = context;
    if (progress_interrupted() || run->err.status != BF_OK)
        return;
    run->waiting++;
    if (rows->n == 0) {
        run->unchanged++;
        run->before_s = run->fitted == 0 ? now_s() - run->since_s : run->before_s;
    } else {
        keep(run, unit, rows);
    }
}

/* Seconds from one transaction to the next: it costs a disk up to 0.03 s, whatever is in it. */
static const double patience_s = 0.2;

void fleet_run_settle(struct fleet_run *run, bool now)
{
    char note[80];
    struct bf_error err;
    if (run->waiting == 0 || (!now && now_s() - run->written_s < patience_s))
        return;
    const size_t waited = run->waiting;
    run->waiting = 0;
    if (fleet_results_commit(run->results, &err) != BF_OK) {
        run->err = run->err.status == BF_OK ? err : run->err;
        return;
    }
    run->answered += waited;
    run->written_s = now_s();
    (void)snprintf(note, sizeof note, "%zu of %zu, %zu failed", run->answered, run->manifest.n, run->failed);
    progress_update(run->progress, (double)run->answered / (double)run->manifest.n, note);
}

/* ---- The answer ---- */

static bool put_failure(void *context, const struct fleet_value values[], size_t n)
{
    struct json *one = json_push(context, json_new_object());
    if (n == 2) {
        json_put_text(one, "unit", values[0].text);
        json_put_text(one, "reason", values[1].text);
    }
    return true;
}

static const char failures[] = "SELECT unit, reason FROM units NATURAL JOIN manifest WHERE status <> 'done' "
                               "ORDER BY place";

enum bf_status fleet_run_answer(struct fleet_run *run, struct bf_error *err)
{
    fleet_run_settle(run, true);
    progress_end(run->progress);
    run->progress = NULL;
    if (run->err.status != BF_OK) {
        *err = run->err;
        return err->status;
    }
    if (progress_interrupted())
        return bf_fail(err, BF_NUMERIC, "interrupted: %zu of %zu units are in %s; the same command goes on there",
                       run->answered, run->manifest.n, run->arguments.output);
    struct json *root = json_new_object();
    json_put_text(root, "results", run->arguments.output);
    json_put_number(root, "units", (double)run->manifest.n);
    json_put_number(root, "fitted", (double)run->fitted);
    json_put_bool(root, "diagnose", run->arguments.settings.diagnose);
    json_put_number(root, "again", (double)run->refitted);
    json_put_number(root, "unchanged", (double)run->unchanged);
    json_put_number(root, "seconds", now_s() - run->since_s);
    struct json *list = json_put(root, "failed", json_new_array());
    if (fleet_results_ask(run->results, failures, NULL, put_failure, list, err) != BF_OK) {
        json_discard(root);
        return err->status;
    }
    answer_next(root, "beamfit", "fleet", "report", run->arguments.output, "-o", "fleet.html", NULL);
    return answer_print_and_free(root, fleet_fields, err);
}

void fleet_run_close(struct fleet_run *run)
{
    if (run->progress != NULL)
        progress_end(run->progress);
    fleet_results_close(run->results);
    fleet_manifest_free(&run->manifest);
    free(run->was_there);
}
