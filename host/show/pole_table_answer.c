/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "show.h"

#include <math.h>

const struct answer_field pole_table_fields[] = {
    ANSWER_CELL("mode", "[{mode}]"),
    ANSWER_ROW(NUMBER, "frequency_Hz", "measured", .text = "measured"),
    ANSWER_ROW(NUMBER, "sd_Hz", "its standard error, as the list says", .digits = 2, .text = "± sd"),
    ANSWER_ROW(NUMBER, "damping_ratio", "measured"),
    ANSWER_ROW(NUMBER, "damping_sd", "its standard error, as the list says"),
    ANSWER_ROW(COUNT, "mode", "of the model, 1 the lowest; null: it has none there", .flags = ANSWER_NULL),
    ANSWER_ROW(NUMBER, "model_Hz", "of that mode", .text = "model"),
    ANSWER_ROW(NUMBER, "ratio", "measured over the model's", .digits = -4, .text = "× model"),
    ANSWER_CELL("damping", "[{damping_ratio}]"),
    ANSWER_ROW(NUMBER, "model_damping_ratio", "of that mode", .text = "model's damping"),
    ANSWER_ROW(NUMBER, "mac", "modal assurance criterion of the measured shape and that mode's, 1 alike", .digits = -3,
               .text = "MAC"),
    {0},
};

const struct answer_field record_poles_fields[] = {
    ANSWER_ROW_OF(LIST, "measured", "lowest first", pole_table_fields, .flags = ANSWER_TABLE,
                  .text = "\nPoles of the fitted records, and the modes that they belong to"),
    ANSWER_ROW(NUMBER, "common_factor", "by which all frequencies are off"),
    ANSWER_ROW(NUMBER, "spread", "of the factors, relative"),
    ANSWER_ROW(TEXT, "text", "what that says"),
    ANSWER_ROW(COUNT, "places", "pairs of a sensor's and an input's place by which shapes are compared"),
    ANSWER_SAY("[{text}]"),
    ANSWER_SAY("[{places?}MAC: of the motion at {places} pairs of a sensor's and an input's place.]"),
    {0},
};

void pole_table_json(struct json *root, const struct pole_table *table)
{
    struct json *list = json_put(root, "measured", json_new_array());
    for (size_t i = 0; i < table->n; i++) {
        const struct pole_pair *pair = &table->pairs[i];
        struct json *one = json_push(list, json_new_object());
        json_put_number(one, "frequency_Hz", pair->measured.frequency_Hz);
        json_put_number(one, "sd_Hz", pair->measured.sd_Hz > 0.0 ? pair->measured.sd_Hz : nan(""));
        json_put_number(one, "damping_ratio", pair->measured.damping_ratio);
        json_put_number(one, "damping_sd", pair->measured.damping_sd > 0.0 ? pair->measured.damping_sd : nan(""));
        json_put_number(one, "mode", pair->mode > 0 ? (double)pair->mode : nan(""));
        json_put_number(one, "model_Hz", pair->model_Hz);
        json_put_number(one, "ratio", pair->ratio);
        json_put_number(one, "model_damping_ratio", pair->model_damping);
        json_put_number(one, "mac", pair->mac);
    }
    json_put_number(root, "common_factor", table->factor);
    json_put_number(root, "spread", table->spread);
    json_put_text(root, "text", table->text);
}

void record_poles_json(struct json *root, const struct pole_table *table)
{
    if (table->n == 0) {
        json_put_number(root, "poles", nan("")); /* null */
        return;
    }
    struct json *object = json_put(root, "poles", json_new_object());
    pole_table_json(object, table);
    json_put_number(object, "places", table->places >= 2 ? (double)table->places : 0.0);
}
