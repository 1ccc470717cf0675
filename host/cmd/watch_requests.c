/* SPDX-License-Identifier: GPL-3.0-or-later */
/* watch_requests.c — requests of the page: what there is to see, and what is to be done. On the server's thread. */
#include <stdlib.h>
#include <string.h>

#include "watch.h"

enum { ACCEPTED = 202, BAD = 400, NOT_FOUND = 404, NO_METHOD = 405, BUSY = 409 };

static void put_records(struct json *root, const struct watch *w)
{
    static const char *const uses[] = {"off", "fit", "check"};
    struct json *list = json_put(root, "records", json_new_array());
    for (size_t i = 0; i < w->n_records; i++) {
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "file", text_base_name(w->records[i].path));
        json_put_text(one, "use", uses[w->use[i]]);
        json_put_number(one, "samples", (double)w->records[i].n);
        json_put_number(one, "seconds", (double)w->records[i].n * w->records[i].dt_s);
    }
}

static void put_steps(struct json *root, const struct watch *w)
{
    struct json *list = json_put(root, "steps", json_new_array());
    for (size_t i = 0; i < w->n_steps; i++) {
        const struct watch_step *step = w->steps[i];
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "name", step->name);
        json_put_number(one, "nrmse", step->nrmse);
        json_put_number(one, "noise_ratio", step->noise_ratio);
        json_put_number(one, "check_nrmse", step->check_nrmse);
        json_put_number(one, "check_noise_ratio", step->check_noise_ratio);
    }
}

static struct json *state_of(const struct watch *w)
{
    struct json *root = json_new_object();
    const struct watch_job *job = w->running.name != NULL ? &w->running : &w->waiting;
    json_put_number(root, "version", w->version);
    json_put_bool(root, "busy", job->name != NULL);
    json_put_text(root, "job", job->name != NULL ? job->name : "");
    json_put_text(root, "what", w->what);
    json_put_text(root, "note", w->note);
    json_put_number(root, "fraction", w->fraction);
    json_put_text(root, "error", w->error);
    json_put_text(root, "said", w->said);
    json_put_text(root, "folder", w->folder);
    put_records(root, w);
    put_steps(root, w);
    struct json *addable = json_put(root, "addable", json_new_array());
    for (size_t i = 0; i < w->explanations.n; i++)
        json_push_number(addable, w->explanations.hypothesis[i] >= 0 ? 1.0 : 0.0);
    struct json *warnings = json_put(root, "warnings", json_new_array());
    for (size_t i = 0; i < w->n_warnings; i++)
        json_push_text(warnings, w->warnings[i]);
    return root;
}

static void answer_json(struct json *tree, struct serve_answer *answer)
{
    struct bf_error ignored;
    FILE *f = open_memstream(&answer->text, &answer->n);
    if (f == NULL) {
        json_discard(tree);
        return;
    }
    (void)json_print_line_and_free(tree, f, &ignored);
    (void)fclose(f);
}

static void answer_text(const char *text, size_t n, struct serve_answer *answer)
{
    answer->text = bf_alloc(n + 1, 1);
    memcpy(answer->text, text, n);
    answer->n = n;
}

static void refuse(int status, const char *why, struct serve_answer *answer)
{
    struct json *tree = json_new_object();
    json_put_text(tree, "error", why);
    answer->status = status;
    answer_json(tree, answer);
}

static void get(struct watch *w, const struct serve_request *request, struct serve_answer *answer)
{
    if (request->name[0] == '\0') {
        answer->type = "text/html; charset=utf-8";
        answer_text(w->page, w->n_page, answer);
    } else if (strcmp(request->name, "state") == 0) {
        answer_json(state_of(w), answer);
    } else if (strcmp(request->name, "curves") == 0 && w->curves != NULL) {
        answer_text(w->curves, w->n_curves, answer);
    } else {
        refuse(NOT_FOUND, "there is nothing of that name", answer);
    }
}

static void post(struct watch *w, const struct serve_request *request, struct serve_answer *answer)
{
    struct watch_job job = {0};
    if (strcmp(request->name, "stop") == 0) {
        if (w->running.name != NULL) {
            w->stopping = true;
            progress_interrupt();
        }
    } else if (!watch_knows_job(request->name, &job.name)) {
        refuse(NOT_FOUND, "there is nothing of that name to do", answer);
        return;
    } else if (w->running.name != NULL || w->waiting.name != NULL) {
        refuse(BUSY, "something is being computed; wait, or stop it", answer);
        return;
    } else if (request->n > 0 &&
               !form_field(request->body, request->n, "argument", job.argument, sizeof job.argument)) {
        refuse(BAD, "the request has no argument that could be read", answer);
        return;
    } else {
        w->waiting = job;
        w->error[0] = w->said[0] = w->note[0] = '\0';
        w->fraction = 0.0;
        pthread_cond_signal(&w->wake);
    }
    answer->status = ACCEPTED;
    answer_json(state_of(w), answer);
}

void watch_answer(void *context, const struct serve_request *request, struct serve_answer *answer)
{
    struct watch *w = context;
    pthread_mutex_lock(&w->lock);
    if (request->post)
        post(w, request, answer);
    else
        get(w, request, answer);
    pthread_mutex_unlock(&w->lock);
}
