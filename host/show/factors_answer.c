/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "show.h"

const struct answer_field channel_factor_fields[] = {
    ANSWER_ROW(TEXT, "channel", "that is probably wrong"),
    ANSWER_ROW(TEXT, "kind", "factor, time, no_time, place, exchange"),
    ANSWER_ROW(TEXT, "or_channel",
               "or this one, the records cannot tell; of an exchange the other column; empty: it is certain"),
    ANSWER_ROW(NUMBER, "factor", "that would be right"),
    ANSWER_ROW(NUMBER, "found", "by the records; of a place in metres"),
    ANSWER_ROW(NUMBER, "nrmse_without", "error as it is"),
    ANSWER_ROW(NUMBER, "nrmse_with", "error with the factor"),
    ANSWER_ROW(TEXT, "line", "of the model file to write"),
    ANSWER_ROW(TEXT, "block", "of the model file in which it stands; empty: none"),
    ANSWER_ROW(TEXT, "text", "in a sentence"),
    ANSWER_SAY("  {text}"),
    ANSWER_SAY("[  In the model file, under {block}:]"),
    ANSWER_SAY("[{block?}    {line}]", .flags = ANSWER_VERBATIM),
    {0},
};

static const char *const kinds[] = {"factor", "time", "no_time", "place", "exchange"}; /* enum factor_kind */

void channel_factors_json(struct json *root, const struct model *model, const struct channel_factors *factors)
{
    struct json *list = json_put(root, "channel_factors", json_new_array());
    for (size_t i = 0; i < factors->n; i++) {
        const struct channel_factor *f = &factors->all[i];
        struct json *one = json_push(list, json_new_object());
        const bool time = f->kind == FACTOR_TIME || f->kind == FACTOR_NO_TIME;
        const bool input = f->kind != FACTOR_EXCHANGE || f->other_is_input;
        const bool other = f->either || f->kind == FACTOR_EXCHANGE;
        json_put_text(one, "channel",
                      time          ? "time_s"
                      : f->is_input ? model->inputs[f->channel].name
                                    : model->outputs[f->channel].name);
        json_put_text(one, "kind", kinds[f->kind]);
        json_put_text(one, "or_channel",
                      !other  ? ""
                      : input ? model->inputs[f->other].name
                              : model->outputs[f->other].name);
        json_put_number(one, "factor", f->factor);
        json_put_number(one, "found", f->found);
        json_put_number(one, "nrmse_without", f->before);
        json_put_number(one, "nrmse_with", f->after);
        json_put_text(one, "block", f->block != NULL ? f->block : "");
        json_put_text(one, "line", f->line);
        json_put_text(one, "text", f->text);
    }
}
