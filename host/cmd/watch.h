/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * watch.h — what `beamfit watch` keeps: the models so far, which records are used, the last diagnosis, and the job that runs.
 *
 * Jobs run on the main thread, one at a time, and call the stages as the commands do (watch_jobs.c); requests are answered on the server's thread
 * (watch_requests.c). What both touch is written by the main thread under `lock`, and read by the other under it.
 */
#ifndef BEAMFIT_WATCH_H
#define BEAMFIT_WATCH_H

#include <pthread.h>

#include "explanations.h"
#include "record_sets.h"
#include "serve/serve.h"

enum watch_use { WATCH_OFF, WATCH_FIT, WATCH_CHECK };
enum { WATCH_TEXT = 400, WATCH_SAID = 2000, WATCH_WARNINGS = 12 };

/* One model of the session and what it leaves. */
struct watch_step {
    char name[WATCH_TEXT];
    struct model model;
    double nrmse, noise_ratio, check_nrmse, check_noise_ratio;
};

/* What a request asked for; `argument` as the job needs it. */
struct watch_job {
    const char *name; /* "diagnose"; NULL: none */
    char argument[WATCH_TEXT];
};

struct watch {
    const char *folder; /* where models are saved */
    struct record *records;
    size_t n_records;
    struct predict_options predict;

    pthread_mutex_t lock;
    pthread_cond_t wake;
    struct watch_job waiting, running;
    bool stopping; /* the page asked for the end of the job */
    char what[WATCH_TEXT], note[WATCH_TEXT], error[WATCH_SAID], said[WATCH_SAID];
    double fraction;
    size_t n_warnings;
    char warnings[WATCH_WARNINGS][WATCH_TEXT];

    enum watch_use *use; /* [n_records] */
    size_t n_steps;
    struct watch_step **steps;   /* the last one is the model that is looked at */
    struct diagnosis *diagnosis; /* of that model and those records; NULL: none */
    struct explanations explanations;
    struct record *selected; /* fitted ones first, then held out; copies of structs, the columns belong to `records` */
    size_t n_fitted, n_held_out;
    char *page, *curves; /* texts */
    size_t n_page, n_curves;
    unsigned version; /* of the curves */
};

/* Runs the job and tells its outcome in w->error or w->said. */
void watch_run_job(struct watch *w, const struct watch_job *job);
/* The names that watch_run_job() knows. */
bool watch_knows_job(const char *name, const char **known);
void watch_free(struct watch *w);

/* The server's handler; context: a struct watch. */
serve_handler watch_answer;

#endif
