/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The chain of models as an answer. */
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
    ANSWER_ROW(COUNT, "depth", "of its descent"),
    ANSWER_CELL("model", "{depth>}{file}"),
    ANSWER_ROW(TEXT, "sha256", "of it"),
    ANSWER_ROW(TEXT, "parent", "the file it was made from; null: none is given", .flags = ANSWER_NULL),
    ANSWER_ROW(TEXTS, "effects", "ids"),
    ANSWER_ROW(TEXTS, "gained", "against the parent"),
    ANSWER_ROW(TEXTS, "lost", "against the parent"),
    ANSWER_ROW(BOOL, "fitted", "its file states a fit"),
    ANSWER_ROW(NUMBER, "nrmse", "error of the fit; null: none", .digits = 4, .text = "nrmse"),
    ANSWER_ROW(NUMBER, "noise_ratio", "in units of the noise", .digits = -3, .text = "/ noise"),
    ANSWER_ROW(NUMBER, "check_nrmse", "of held-out records", .digits = 4, .text = "held-out"),
    ANSWER_ROW(NUMBER, "check_noise_ratio", "of held-out records", .digits = -3, .text = "/ noise"),
    ANSWER_ROW(BOOL, "converged", "the fit did"),
    ANSWER_ROW(TEXT, "step", "what it gained and lost", .text = "step"),
    {0},
};

const struct answer_field history_fields[] = {
    ANSWER_ROW_OF(LIST, "models", "oldest first", entry_fields, .flags = ANSWER_TABLE, .text = ""),
    ANSWER_SAY("nrmse: residual rms over signal rms, of the fitted and of the held-out records; / noise: over the "
               "noise's rms."),
    {0},
};

static void put_entry(struct json *object, const struct history *h, int i)
{
    const struct history_entry *e = &h->entries[i];
    const struct model *parent = history_parent(h, i);
    const struct fit_info *fit = &e->model.fit;
    char step[HISTORY_STEP];
    json_put_text(object, "file", e->file);
    json_put_number(object, "depth", e->depth);
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
    history_step(h, i, step, sizeof step);
    json_put_text(object, "step", step);
}

struct json *history_json(const struct history *h)
{
    struct json *root = json_new_object(), *models = json_put(root, "models", json_new_array());
    for (int i = 0; i < h->n; i++)
        put_entry(json_push(models, json_new_object()), h, h->order[i]);
    return root;
}
