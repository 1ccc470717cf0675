/* SPDX-License-Identifier: GPL-3.0-or-later */
/* free_answer.c — decays and stable poles in an answer: what the records say without a model. */
#include "show.h"

#include <math.h>

const struct answer_field amplitude_fields[] = {
    ANSWER_ROW(TEXT, "file", "the record"),
    ANSWER_ROW(TEXT, "channel", "of it"),
    ANSWER_ROW(COUNT, "mode", "of the model, 1 the lowest"),
    ANSWER_ROW(NUMBER, "frequency_drift",
               "relative change of the frequency from the smallest to the largest amplitude"),
    ANSWER_ROW(NUMBER, "frequency_drift_sd", "its standard error"),
    ANSWER_ROW(NUMBER, "damping_drift", "change of the damping ratio from the smallest to the largest amplitude"),
    ANSWER_ROW(NUMBER, "damping_drift_sd", "its standard error"),
    ANSWER_ROW(NUMBER, "amplitude_sd", "standard error of each amplitude"),
    ANSWER_ROW(NUMBERS, "time_s", "middle of each window"),
    ANSWER_ROW(NUMBERS, "amplitude", "of the mode in the channel, in its unit"),
    ANSWER_ROW(NUMBERS, "frequency_Hz", "measured"),
    ANSWER_ROW(NUMBERS, "frequency_sd_Hz", "its standard error"),
    ANSWER_ROW(NUMBERS, "damping_ratio", "measured"),
    ANSWER_ROW(NUMBERS, "damping_sd", "its standard error"),
    ANSWER_ROW(NUMBERS, "model_amplitude", "of the prediction in the same window"),
    ANSWER_ROW(NUMBERS, "model_frequency_Hz", "of the prediction; null: it moves too little"),
    ANSWER_ROW(NUMBERS, "model_damping_ratio", "of the prediction; null: it moves too little"),
    {0},
};

const struct answer_field no_decay_fields[] = {
    ANSWER_ROW(TEXT, "file", "a record without a decay", .flags = ANSWER_BASE),
    ANSWER_ROW(TEXT, "text", "why"),
    ANSWER_SAY("No decay in {file}: {text}."),
    {0},
};

static const struct answer_field pole_fields[] = {
    ANSWER_ROW(NUMBER, "frequency_Hz", "median over the orders in which it is stable"),
    ANSWER_ROW(NUMBER, "damping_ratio", "the same"),
    ANSWER_ROW(COUNT, "orders", "in which it is stable"),
    {0},
};

const struct answer_field stabilisation_fields[] = {
    ANSWER_ROW(COUNT, "modes", "of the largest model"),
    ANSWER_ROW(NUMBER, "to_Hz", "end of the band"),
    ANSWER_ROW_OF(LIST, "poles", "that stay from order to order, lowest first", pole_fields),
    {0},
};

static void put(struct json *object, const char *name, const double x[], size_t n)
{
    struct json *array = json_put(object, name, json_new_array());
    for (size_t i = 0; i < n; i++)
        json_push_number(array, x[i]);
}

static void put_curve(struct json *one, const struct amplitude_curve *c)
{
    json_put_number(one, "mode", (double)c->mode);
    json_put_number(one, "frequency_drift", c->frequency_drift);
    json_put_number(one, "frequency_drift_sd", c->frequency_drift_sd);
    json_put_number(one, "damping_drift", c->damping_drift);
    json_put_number(one, "damping_drift_sd", c->damping_drift_sd);
    json_put_number(one, "amplitude_sd", c->amplitude_sd);
    put(one, "time_s", c->t_s, c->n);
    put(one, "amplitude", c->amplitude, c->n);
    put(one, "frequency_Hz", c->frequency_Hz, c->n);
    put(one, "frequency_sd_Hz", c->frequency_sd_Hz, c->n);
    put(one, "damping_ratio", c->damping_ratio, c->n);
    put(one, "damping_sd", c->damping_sd, c->n);
    put(one, "model_amplitude", c->model_amplitude, c->n);
    put(one, "model_frequency_Hz", c->model_frequency_Hz, c->n);
    put(one, "model_damping_ratio", c->model_damping_ratio, c->n);
}

void amplitude_json(struct json *root, const struct record records[], const struct amplitude_curves *curves)
{
    struct json *list = json_put(root, "decays", json_new_array());
    for (size_t i = 0; i < curves->n; i++) {
        const struct amplitude_curve *c = &curves->curves[i];
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "file", records[c->record].path != NULL ? records[c->record].path : "");
        json_put_text(one, "channel", c->channel);
        put_curve(one, c);
    }
    struct json *none = json_put(root, "no_decay", json_new_array());
    for (size_t r = 0; r < curves->n_records; r++) {
        const char *why = amplitude_no_decay(curves, r);
        if (why == NULL)
            continue;
        struct json *one = json_push(none, json_new_object());
        json_put_text(one, "file", records[r].path != NULL ? records[r].path : "");
        json_put_text(one, "text", why);
    }
    json_put_text(root, "drift", curves->text);
}

void stabilisation_json(struct json *root, const struct stabilisation *found)
{
    if (found->modes == 0) {
        json_put_number(root, "stabilisation", nan("")); /* null */
        return;
    }
    struct json *object = json_put(root, "stabilisation", json_new_object());
    json_put_number(object, "modes", (double)found->modes);
    json_put_number(object, "to_Hz", found->to_Hz);
    struct json *poles = json_put(object, "poles", json_new_array());
    for (size_t k = 0; k < found->n_found; k++) {
        struct json *pole = json_push(poles, json_new_object());
        json_put_number(pole, "frequency_Hz", found->found[k].frequency_Hz);
        json_put_number(pole, "damping_ratio", found->found[k].damping_ratio);
        json_put_number(pole, "orders", (double)found->found[k].orders);
    }
}
