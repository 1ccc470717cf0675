/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "show.h"

#include <math.h>

static void print_damping(FILE *out, double measured, double model)
{
    if (isnan(measured))
        (void)fprintf(out, "         -");
    else
        (void)fprintf(out, "  %8.5f", measured);
    if (isnan(model))
        (void)fprintf(out, "          -\n");
    else
        (void)fprintf(out, "  %9.5f\n", model);
}

void pole_table_print(FILE *out, const struct pole_table *table, const struct modes *modes)
{
    (void)fprintf(out, "mode    measured    ± sd       model       measured/model   damping measured, model\n");
    for (size_t i = 0; i < table->n; i++) {
        const struct pole_pair *pair = &table->pairs[i];
        const double damping = pair->mode > 0 ? modes->mode[pair->mode - 1].damping_ratio : nan("");
        if (pair->mode > 0)
            (void)fprintf(out, "%4zu", pair->mode);
        else
            (void)fprintf(out, "   -");
        (void)fprintf(out, "  %10.5g", pair->measured.frequency_Hz);
        if (pair->measured.sd_Hz > 0.0)
            (void)fprintf(out, "  %-8.2g", pair->measured.sd_Hz);
        else
            (void)fprintf(out, "  %-8s", "-");
        if (pair->mode > 0)
            (void)fprintf(out, "  %10.5g Hz  %10.4f      ", pair->model_Hz, pair->ratio);
        else
            (void)fprintf(out, "  %10s     %10s      ", "none", "-");
        print_damping(out, pair->measured.damping_ratio, damping);
    }
    if (table->text[0] != '\0') {
        (void)fprintf(out, "\n");
        text_print_wrapped(out, table->text, 0, text_columns());
    }
}

void pole_table_json(struct json *root, const struct pole_table *table)
{
    struct json *list = json_put(root, "measured", json_new_array());
    for (size_t i = 0; i < table->n; i++) {
        const struct pole_pair *pair = &table->pairs[i];
        struct json *one = json_push(list, json_new_object());
        json_put_number(one, "frequency_Hz", pair->measured.frequency_Hz);
        json_put_number(one, "sd_Hz", pair->measured.sd_Hz > 0.0 ? pair->measured.sd_Hz : nan(""));
        json_put_number(one, "damping_ratio", pair->measured.damping_ratio);
        json_put_number(one, "mode", pair->mode > 0 ? (double)pair->mode : nan(""));
        json_put_number(one, "model_Hz", pair->model_Hz);
        json_put_number(one, "ratio", pair->ratio);
    }
    json_put_number(root, "common_factor", table->factor);
    json_put_number(root, "spread", table->spread);
    json_put_text(root, "text", table->text);
}
