/* SPDX-License-Identifier: GPL-3.0-or-later */
/* repeatability_answer.c — how well repeated hits agree. */
#include "show.h"

/* The bound of every model, in words. */
#define AGREE                                                                                                          \
    "{output}: {records} records of {input} agree with one response, whatever it is, to {nrmse}; no linear model "     \
    "of one beam leaves less there."

const struct answer_field repeatability_fields[] = {
    ANSWER_ROW(TEXT, "output", "of the model"),
    ANSWER_ROW(TEXT, "input", "that drives the records alone"),
    ANSWER_ROW(COUNT, "records", "of them"),
    ANSWER_ROW(NUMBER, "nrmse", "scatter about the one response that is best for all, free of any model",
               .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_ROW(TEXT, "odd", "a record that stands out; empty: none"),
    ANSWER_ROW(NUMBER, "odd_nrmse", "its error under the response of the others", .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_ROW(NUMBER, "others_nrmse", "scatter of the others", .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_SAY("[{odd?}Repeated records: " AGREE
               " {odd} stands out: it is {odd_nrmse} off the response of the others, which agree to {others_nrmse}. "
               "Hit twice or elsewhere, a cable, a clamp? Look at it, or leave it out.]"),
    ANSWER_SAY("[{odd?}\n]"),
    {0},
};

const struct answer_field repeatability_floor_fields[] = {
    ANSWER_ROW(NUMBER, "nrmse", "", .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_SAY("[{odd!}\nRepeated records: " AGREE "]"),
    {0},
};

void repeatability_json(struct json *root, const struct model *model, const struct record records[],
                        const struct repeatability *repeatability)
{
    struct json *list = json_put(root, "repeatability", json_new_array());
    for (size_t i = 0; i < repeatability->n; i++) {
        const struct repeatability_channel *c = &repeatability->all[i];
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "output", model->outputs[c->output].name);
        json_put_text(one, "input", model->inputs[c->input].name);
        json_put_number(one, "records", (double)c->n_records);
        json_put_number(one, "nrmse", c->nrmse);
        json_put_text(one, "odd", c->stands_out ? record_base_name(&records[c->odd]) : "");
        json_put_number(one, "odd_nrmse", c->stands_out ? c->odd_nrmse : 0.0);
        json_put_number(one, "others_nrmse", c->stands_out ? c->others_nrmse : c->nrmse);
    }
}
