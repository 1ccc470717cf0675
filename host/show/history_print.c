/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The chain of models as a table and as JSON. */
#include "show.h"
#include "compare/compare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

enum { HISTORY_STEP = 1024 };

static void push_id(void *context, const char *id, bool gained)
{
    (void)gained;
    json_push_text(context, id);
}

static const struct answer_field entry_fields[] = {
    ANSWER_ROW(TEXT, "file", "the model"),
    ANSWER_ROW(TEXT, "sha256", "of it"),
    {ANSWER_TEXT, "parent", "the file it was made from; null: none is given", NULL, ANSWER_NULL, NULL},
    ANSWER_ROW(TEXTS, "effects", "ids"),
    ANSWER_ROW(TEXTS, "gained", "against the parent"),
    ANSWER_ROW(TEXTS, "lost", "against the parent"),
    ANSWER_ROW(BOOL, "fitted", "its file states a fit"),
    ANSWER_ROW(NUMBER, "nrmse", "error of the fit; null: none"),
    ANSWER_ROW(NUMBER, "noise_ratio", "in units of the noise"),
    ANSWER_ROW(NUMBER, "check_nrmse", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_noise_ratio", "of held-out records"),
    ANSWER_ROW(BOOL, "converged", "the fit did"),
    {0},
};

const struct answer_field history_fields[] = {
    ANSWER_ROW_OF(LIST, "models", "oldest first", entry_fields),
    {0},
};

static void put_entry(struct json *object, const struct history *h, int i)
{
    const struct history_entry *e = &h->entries[i];
    const struct model *parent = history_parent(h, i);
    const struct fit_info *fit = &e->model.fit;
    json_put_text(object, "file", e->file);
    json_put_text(object, "sha256", e->model.sha256);
    if (parent)
        json_put_text(object, "parent", h->entries[e->parent].file);
    else
        json_put_number(object, "parent", (double)NAN);
    struct json *effects = json_put(object, "effects", json_new_array());
    for (size_t k = 0; k < e->model.n_effects; k++)
        json_push_text(effects, e->model.effects[k].effect->id);
    struct json *gained = json_put(object, "gained", json_new_array());
    struct json *lost = json_put(object, "lost", json_new_array());
    if (parent) {
        history_surplus(&e->model, parent, push_id, gained, true);
        history_surplus(parent, &e->model, push_id, lost, false);
    }
    json_put_bool(object, "fitted", fit->present);
    json_put_number(object, "nrmse", history_error(fit->nrmse));
    json_put_number(object, "noise_ratio", history_error(fit->noise_ratio));
    json_put_number(object, "check_nrmse", history_error(fit->check_nrmse));
    json_put_number(object, "check_noise_ratio", history_error(fit->check_noise_ratio));
    json_put_bool(object, "converged", fit->present && fit->converged);
}

struct json *history_json(const struct history *h)
{
    struct json *root = json_new_object(), *models = json_put(root, "models", json_new_array());
    for (int i = 0; i < h->n; i++)
        put_entry(json_push(models, json_new_object()), h, h->order[i]);
    return root;
}

static void print_number(FILE *out, double x, const char *format, int width)
{
    if (x > 0.0)
        (void)fprintf(out, format, width, x);
    else
        (void)fprintf(out, "%*s", width, "-");
}

static void print_entry(FILE *out, const struct history *h, int i, size_t width)
{
    const struct history_entry *e = &h->entries[i];
    const struct fit_info *fit = &e->model.fit;
    char step[HISTORY_STEP];
    (void)fprintf(out, "%*s", 2 * e->depth, "");
    text_print_padded(out, e->file, width - 2 * (size_t)e->depth);
    print_number(out, fit->nrmse, "%*.4g", 10);
    print_number(out, fit->noise_ratio, "%*.3f", 10);
    print_number(out, fit->check_nrmse, "%*.4g", 12);
    print_number(out, fit->check_noise_ratio, "%*.3f", 10);
    history_step(h, i, step, sizeof step);
    (void)fprintf(out, "  %s\n", step);
}

void history_print(FILE *out, const struct history *h)
{
    size_t width = strlen("model");
    for (int i = 0; i < h->n; i++) {
        size_t w = text_width(h->entries[i].file) + 2 * (size_t)h->entries[i].depth;
        width = w > width ? w : width;
    }
    text_print_padded(out, "model", width);
    (void)fprintf(out, "%10s%10s%12s%10s  step\n", "nrmse", "/ noise", "held-out", "/ noise");
    for (int i = 0; i < h->n; i++)
        print_entry(out, h, h->order[i], width);
    text_say(out, "", 0,
             "nrmse: residual rms over signal rms, of the fitted and of the held-out records; / noise: over the "
             "noise's rms.");
}
