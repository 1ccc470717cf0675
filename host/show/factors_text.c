/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "show.h"

void channel_factors_print(FILE *out, const struct channel_factors *factors)
{
    char text[sizeof factors->all->text + 40];
    for (size_t i = 0; i < factors->n; i++) {
        const struct channel_factor *f = &factors->all[i];
        (void)snprintf(text, sizeof text, "%s%s", i == 0 ? "First of all: " : "", f->text);
        text_print_wrapped(out, text, 2, text_columns());
        if (f->block != NULL)
            (void)fprintf(out, "  In the model file, under %s:\n    %s\n", f->block, f->line);
    }
    if (factors->n > 0)
        (void)fprintf(out, "\n");
}

const struct answer_field channel_factor_fields[] = {
    ANSWER_ROW(TEXT, "channel", "that is probably wrong"),
    ANSWER_ROW(TEXT, "or_channel", "or this one, the records cannot tell; empty: it is certain"),
    ANSWER_ROW(NUMBER, "factor", "that would be right"),
    ANSWER_ROW(NUMBER, "found", "by the records"),
    ANSWER_ROW(NUMBER, "nrmse_without", "error as it is"),
    ANSWER_ROW(NUMBER, "nrmse_with", "error with the factor"),
    ANSWER_ROW(TEXT, "line", "of the model file to write"),
    ANSWER_ROW(TEXT, "text", "in a sentence"),
    {0},
};

void channel_factors_json(struct json *root, const struct model *model, const struct channel_factors *factors)
{
    struct json *list = json_put(root, "channel_factors", json_new_array());
    for (size_t i = 0; i < factors->n; i++) {
        const struct channel_factor *f = &factors->all[i];
        struct json *one = json_push(list, json_new_object());
        const bool time = f->kind == FACTOR_TIME;
        json_put_text(one, "channel",
                      time          ? "time_s"
                      : f->is_input ? model->inputs[f->channel].name
                                    : model->outputs[f->channel].name);
        json_put_text(one, "or_channel", f->either ? model->inputs[f->other].name : "");
        json_put_number(one, "factor", f->factor);
        json_put_number(one, "found", f->found);
        json_put_number(one, "nrmse_without", f->before);
        json_put_number(one, "nrmse_with", f->after);
        json_put_text(one, "line", f->line);
        json_put_text(one, "text", f->text);
    }
}
