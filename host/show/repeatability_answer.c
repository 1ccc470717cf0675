/* SPDX-License-Identifier: GPL-3.0-or-later */
/* repeatability_answer.c — how well repeated hits agree. */
#include "show.h"

#include <math.h>

static const double as_noise = 1.5; /* times the noise: up to here the scatter is the noise */
static const double unlike = 1.2;   /* strongest over weakest hit: above, strengths are said and judged */

/* The bound of every model, in words: in parts, each of which is left out where its value is not known. */
#define AGREE(when)                                                                                                    \
    "[{" when "}{output}: {records} records of {input}][{" when "}{strengths?}, the strongest {strengths} times "      \
    "the weakest,][{" when "} agree with one response, whatever it is, to {nrmse}][{" when "}, {noise_ratio} times "   \
    "the noise][{" when "}; no linear model of one beam leaves less there.][{" when "}{meaning?} {meaning}]"

const struct answer_field repeatability_fields[] = {
    ANSWER_ROW(TEXT, "output", "of the model"),
    ANSWER_ROW(TEXT, "input", "that drives the records alone"),
    ANSWER_ROW(COUNT, "records", "of them"),
    ANSWER_ROW(NUMBER, "strengths", "largest input of the strongest over that of the weakest, where they differ",
               .flags = ANSWER_MAYBE, .digits = 2),
    ANSWER_ROW(NUMBER, "nrmse", "scatter about the one response that is best for all, free of any model",
               .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_ROW(NUMBER, "scatter_rms", "of white noise that would scatter as much, unit of the output", .digits = 3),
    ANSWER_ROW(NUMBER, "noise_ratio", "scatter over what the noise of the channels makes; null: not known",
               .flags = ANSWER_NULL, .digits = 3),
    ANSWER_ROW(TEXT, "meaning", "of the scatter, where it is told"),
    ANSWER_ROW(TEXT, "odd", "a record that stands out; empty: none"),
    ANSWER_ROW(NUMBER, "odd_nrmse", "its error under the response of the others", .flags = ANSWER_PERCENT, .digits = 3),
    ANSWER_ROW(NUMBER, "others_nrmse", "scatter of the others", .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_SAY("[{odd?}Repeated records: ]" AGREE(
        "odd?") "[{odd?} {odd} stands out: it is {odd_nrmse} off the response of the others, which agree to "
                "{others_nrmse}. Hit twice or elsewhere, a cable, a clamp? Look at it, or leave it out.]"),
    ANSWER_SAY("[{odd?}\n]"),
    {0},
};

const struct answer_field repeatability_floor_fields[] = {
    ANSWER_ROW(NUMBER, "strengths", "", .flags = ANSWER_MAYBE, .digits = 2),
    ANSWER_ROW(NUMBER, "nrmse", "", .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_ROW(NUMBER, "noise_ratio", "", .flags = ANSWER_NULL, .digits = 3),
    ANSWER_SAY("[{odd!}\nRepeated records: ]" AGREE("odd!")),
    {0},
};

/* What scatters beyond the noise did not repeat; with hits of other strength a nonlinearity is in it, too. */
static const char *meaning(const struct repeatability_channel *c)
{
    const bool strengths = c->strongest > unlike * c->weakest;
    if (!isfinite(c->noise_ratio) || c->repeats.stands_out)
        return "";
    if (c->noise_ratio <= as_noise)
        return strengths ? "That is the noise: the beam answers hits of these strengths in proportion." : "";
    return strengths ? "More than the noise: what grows with the strength is nonlinear, the rest did not repeat (the "
                       "hammer's place or direction, the clamp)."
                     : "More than the noise: that did not repeat (the hammer's place or direction, the clamp), and "
                       "no model explains it, unless each record has a place of its own.";
}

void repeatability_json(struct json *root, const struct model *model, const struct record records[],
                        const struct repeatability *repeatability)
{
    struct json *list = json_put(root, "repeatability", json_new_array());
    for (size_t i = 0; i < repeatability->n; i++) {
        const struct repeatability_channel *c = &repeatability->all[i];
        const struct repeats *r = &c->repeats;
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "output", model->outputs[c->output].name);
        json_put_text(one, "input", model->inputs[c->input].name);
        json_put_number(one, "records", (double)c->n_records);
        if (c->strongest > unlike * c->weakest)
            json_put_number(one, "strengths", c->strongest / c->weakest);
        json_put_number(one, "nrmse", r->nrmse);
        json_put_number(one, "scatter_rms", c->scatter_rms);
        json_put_number(one, "noise_ratio", c->noise_ratio);
        json_put_text(one, "meaning", meaning(c));
        json_put_text(one, "odd", r->stands_out ? record_base_name(&records[r->odd]) : "");
        json_put_number(one, "odd_nrmse", r->stands_out ? r->odd_nrmse : 0.0);
        json_put_number(one, "others_nrmse", r->stands_out ? r->others_nrmse : r->nrmse);
    }
}
