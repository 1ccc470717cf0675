/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_answer.c — a comparison as an answer. */
#include "compare_text.h"
#include "show.h"
#include "compare/compare.h"

#include <math.h>

static const struct answer_field band_fields[] = {
    ANSWER_ROW(NUMBER, "from_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "to_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "share", "of the misfit's power"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over noise in it"),
    ANSWER_ROW(COUNT, "mode", "of the model in it, from 1", .flags = ANSWER_MAYBE),
    {0},
};

static const struct answer_field noise_fields[] = {
    ANSWER_ROW(TEXT, "method", "how it was judged"),
    ANSWER_ROW(NUMBER, "rms", "in the channel's unit"),
    ANSWER_ROW(NUMBER, "rms_sd", "its standard error"),
    ANSWER_ROW(NUMBER, "share", "of the signal", .flags = ANSWER_PERCENT, .digits = 3),
    ANSWER_ROW(NUMBER, "used_share", "of the record that was used"),
    ANSWER_ROW(COUNT, "cells", "of time and frequency that were used"),
    ANSWER_ROW(NUMBER, "quantisation", "step of the data, in the channel's unit"),
    {0},
};

static const struct answer_field white_fields[] = {
    ANSWER_ROW(NUMBER, "p_value", "of both tests together", .digits = 2),
    ANSWER_ROW(NUMBER, "ljung_box", "statistic"),
    ANSWER_ROW(NUMBER, "ljung_box_p", "its p-value"),
    ANSWER_ROW(COUNT, "lags", "of it"),
    ANSWER_ROW(NUMBER, "periodogram_ks", "statistic"),
    ANSWER_ROW(NUMBER, "periodogram_p", "its p-value"),
    {0},
};

static const struct answer_field input_fields[] = {
    ANSWER_ROW(TEXT, "name", "of the input"),
    ANSWER_ROW(NUMBER, "correlation", "largest one with the residual"),
    ANSWER_ROW(NUMBER, "lag_s", "there"),
    ANSWER_ROW(NUMBER, "bound", "of chance"),
    ANSWER_ROW(NUMBER, "p_value", "of no correlation"),
    ANSWER_ROW(NUMBER, "coherence", "of residual and input", .digits = -4),
    ANSWER_ROW(NUMBER, "coherence_bound", "of chance", .digits = -2),
    {0},
};

static const struct answer_field channel_fields[] = {
    ANSWER_ROW(TEXT, "name", "column of the record", .text = "channel"),
    ANSWER_ROW(NUMBER, "nrmse", "norm of the misfit over norm of the signal", .flags = ANSWER_PERCENT, .digits = 4,
               .text = "error"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data", .digits = 4, .text = "× noise"),
    ANSWER_CELL("noise", "[{noise.share}]", .flags = ANSWER_ALL),
    ANSWER_CELL("judged from", "{noise.method}", .flags = ANSWER_ALL),
    ANSWER_CELL("white p", "[{whiteness.p_value}]", .flags = ANSWER_ALL),
    ANSWER_CELL("input p", "[{input_p}]", .flags = ANSWER_ALL),
    ANSWER_ROW_OF(LIST, "bands", "where the misfit is", band_fields),
    ANSWER_ROW_OF(OBJECT, "noise", "of the channel, as the record shows it", noise_fields, .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "residual_rms", "in the channel's unit", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "measured_rms", "in the channel's unit", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "scale", "of the model that would fit best", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "alignment", "of measured and model: 1 alike, -1 turned", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBERS, "time_share", "of the misfit's power, in thirds of the record",
               .flags = ANSWER_MAYBE | ANSWER_PERCENT, .digits = 3),
    ANSWER_ROW(NUMBERS, "amplitude_share", "the same by size of the motion, small to large", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBERS, "amplitude_error", "relative error there", .flags = ANSWER_MAYBE | ANSWER_PERCENT, .digits = 3),
    ANSWER_ROW(TEXT, "where", "bands with a share of the misfit in %, and their modes"),
    ANSWER_ROW(NUMBER, "input_p", "of no correlation with any input", .flags = ANSWER_MAYBE, .digits = 2),
    ANSWER_ROW_OF(OBJECT, "whiteness", "of the residual", white_fields, .flags = ANSWER_MAYBE),
    ANSWER_ROW_OF(LIST, "inputs", "what the residual has of each", input_fields, .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "text", "in a sentence or two"),
    ANSWER_ROW(TEXT, "warning", "on the channel", .flags = ANSWER_MAYBE),
    {0},
};

static const struct answer_field record_fields[] = {
    ANSWER_SAY("[{held_out?}held out:]", .flags = ANSWER_GROUP),
    ANSWER_ROW(TEXT, "file", "the record", .flags = ANSWER_BASE, .text = "record"),
    ANSWER_ROW(TEXT, "sha256", "of it"),
    ANSWER_ROW(BOOL, "held_out", "of the fit"),
    ANSWER_ROW(NUMBER, "level", "of the excitation, 1 unless it was solved for", .digits = 6),
    ANSWER_ROW(BOOL, "level_solved", "for it"),
    ANSWER_ROW_OF(LIST, "channels", "one for each output; of a list frequency and damping_ratio", channel_fields,
                  .flags = ANSWER_TABLE),
    ANSWER_ROW_OF(LIST, "measured", "of a list of frequencies, as it has them", pole_table_fields,
                  .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "common_factor", "of a list: by which all are off", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "spread", "of a list: of the factors, relative", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "text", "of a list: what that says", .flags = ANSWER_MAYBE),
    {0},
};

/* Lists of frequencies, each as a table of its own. */
static const struct answer_field list_fields[] = {
    ANSWER_ROW(TEXT, "file", "", .flags = ANSWER_BASE),
    ANSWER_ROW_OF(LIST, "measured", "", pole_table_fields, .flags = ANSWER_TABLE,
                  .text = "\n{file}, and the modes that its frequencies belong to"),
    ANSWER_SAY("[{measured?}\n{text}]"),
    {0},
};

/* The same channels again, in sentences. */
static const struct answer_field level_fields[] = {
    ANSWER_ROW(TEXT, "file", "", .flags = ANSWER_BASE),
    ANSWER_ROW(NUMBER, "level", "", .digits = 6),
    ANSWER_SAY("[{level_solved?}level of the excitation of {file}: {level} (solved for)]"),
    {0},
};

static const struct answer_field input_lines[] = {
    ANSWER_ROW(NUMBER, "coherence", "", .digits = -4),
    ANSWER_ROW(NUMBER, "coherence_bound", "", .digits = -2),
    ANSWER_SAY("[    coherence with {name} {coherence} (chance: {coherence_bound})]"),
    {0},
};

static const struct answer_field where_lines[] = {
    ANSWER_ROW(NUMBERS, "time_share", "", .flags = ANSWER_PERCENT, .digits = 3),
    ANSWER_ROW(NUMBERS, "amplitude_error", "", .flags = ANSWER_PERCENT, .digits = 3),
    ANSWER_SAY("  {file} {name}:"),
    ANSWER_SAY("[    {where}]"),
    ANSWER_SAY("[    in time (thirds): {time_share}; error by motion, small to large: {amplitude_error}]"),
    ANSWER_ROW_OF(LIST, "inputs", "", input_lines, .text = ""),
    {0},
};

static const struct answer_field where_fields[] = {
    ANSWER_ROW(TEXT, "file", "", .flags = ANSWER_BASE),
    ANSWER_ROW_OF(LIST, "channels", "", where_lines, .text = ""),
    {0},
};

static const struct answer_field summary_lines[] = {
    ANSWER_SAY("- {text}"),
    {0},
};

static const struct answer_field summary_fields[] = {
    ANSWER_ROW_OF(LIST, "channels", "", summary_lines, .text = ""),
    {0},
};

const struct answer_field compare_fields[] = {
    ANSWER_RECORDS_FIRST,
    ANSWER_ROW_OF(LIST, "records", "fitted ones first", record_fields, .flags = ANSWER_TABLE, .text = ""),
    ANSWER_ROW(NUMBER, "nrmse", "error: root mean square over channels of norm of the misfit over norm of the signal",
               .flags = ANSWER_PERCENT, .digits = 4),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data (1: nothing is left to explain)", .digits = 4),
    ANSWER_ROW(NUMBER, "check_nrmse", "of held-out records", .flags = ANSWER_PERCENT, .digits = 4),
    ANSWER_ROW(NUMBER, "check_noise_ratio", "of held-out records", .digits = 4),
    ANSWER_SAY(
        "\nall channels (root mean square): [error {nrmse}[, {noise_ratio} times the noise]][{nrmse?}{check_nrmse?}; "
        "][held out: error {check_nrmse}[, {check_noise_ratio} times the noise]]"),
    ANSWER_ROW_OF(OBJECT, "attainable", "what the best linear model with as many modes leaves; null: not known",
                  attainable_fields, .flags = ANSWER_NULL, .text = ""),
    ANSWER_ROW(NUMBERS, "frequency_Hz", "of the model's modes"),
    ANSWER_ROW_OF(LIST, "records", "", list_fields, .flags = ANSWER_AGAIN, .text = ""),
    ANSWER_ROW_OF(LIST, "records", "", level_fields, .flags = ANSWER_AGAIN, .text = ""),
    ANSWER_ROW_OF(LIST, "records", "", where_fields, .flags = ANSWER_AGAIN,
                  .text = "\nWhere the misfit is (share of it in %; m: the mode in the band):"),
    ANSWER_ROW_OF(LIST, "records", "", summary_fields, .flags = ANSWER_AGAIN, .text = "\n"),
    ANSWER_ROW_OF(LIST, "decays", "modes in free motion, window by window; with --plot or as JSON", amplitude_fields,
                  .flags = ANSWER_MAYBE),
    ANSWER_ROW_OF(LIST, "no_decay", "records without free motion, as `decays`", no_decay_fields, .flags = ANSWER_MAYBE,
                  .text = "\n"),
    ANSWER_ROW(TEXT, "drift", "what changes with amplitude, as `decays`; empty: nothing", .flags = ANSWER_MAYBE),
    ANSWER_SAY("[\n{drift}]"),
    ANSWER_ROW_OF(OBJECT, "stabilisation", "poles that stay in free linear models of rising order, as `decays`",
                  stabilisation_fields, .flags = ANSWER_MAYBE | ANSWER_NULL),
    ANSWER_ROW_OF(OBJECT, "poles", "of the fitted records themselves, as `decays`", record_poles_fields,
                  .flags = ANSWER_MAYBE | ANSWER_NULL, .text = ""),
    ANSWER_ROW_OF(LIST, "repeatability", "", repeatability_floor_fields, .flags = ANSWER_AGAIN, .text = ""),
    ANSWER_ROW(TEXTS, "notes", "on what looks ordinary", .text = ""),
    {0},
};

static void put_numbers(struct json *object, const char *key, const double *x, size_t n)
{
    struct json *array = json_put(object, key, json_new_array());
    for (size_t i = 0; i < n; i++)
        json_push_number(array, x[i]);
}

static void put_bands(struct json *channel, const struct comparison_channel *c)
{
    struct json *bands = json_put(channel, "bands", json_new_array());
    for (size_t b = 0; b < c->n_bands; b++) {
        struct json *band = json_push(bands, json_new_object());
        json_put_number(band, "from_Hz", c->bands[b].from_Hz);
        json_put_number(band, "to_Hz", c->bands[b].to_Hz);
        json_put_number(band, "share", c->bands[b].share);
        json_put_number(band, "noise_ratio", c->bands[b].noise_ratio);
        if (c->bands[b].mode > 0)
            json_put_number(band, "mode", (double)c->bands[b].mode);
    }
}

static void put_noise(struct json *channel, const struct noise_estimate *noise, double signal)
{
    struct json *object = json_put(channel, "noise", json_new_object());
    json_put_text(object, "method", noise_method_text(noise->method));
    json_put_number(object, "rms", noise->rms);
    json_put_number(object, "rms_sd", noise->rms_sd);
    json_put_number(object, "share", signal > 0.0 && noise->method != NOISE_NONE ? noise->rms / signal : (double)NAN);
    json_put_number(object, "used_share", noise->used_share);
    json_put_number(object, "cells", (double)noise->n_used);
    json_put_number(object, "quantisation", noise->quantisation);
}

static void put_tests(struct json *channel, const struct comparison_channel *c)
{
    struct json *white = json_put(channel, "whiteness", json_new_object());
    json_put_number(white, "p_value", c->whiteness.p_value);
    json_put_number(white, "ljung_box", c->whiteness.ljung_box);
    json_put_number(white, "ljung_box_p", c->whiteness.ljung_box_p);
    json_put_number(white, "lags", (double)c->whiteness.lags);
    json_put_number(white, "periodogram_ks", c->whiteness.periodogram_ks);
    json_put_number(white, "periodogram_p", c->whiteness.periodogram_p);
    struct json *inputs = json_put(channel, "inputs", json_new_array());
    double p = c->n_inputs > 0 ? 1.0 : (double)NAN;
    for (size_t i = 0; i < c->n_inputs; i++) {
        const struct comparison_input *from = &c->inputs[i];
        struct json *input = json_push(inputs, json_new_object());
        json_put_text(input, "name", from->name);
        json_put_number(input, "correlation", from->correlation.largest);
        json_put_number(input, "lag_s", (double)from->correlation.largest_lag * c->dt_s);
        json_put_number(input, "bound", from->correlation.bound_all);
        json_put_number(input, "p_value", from->correlation.p_value);
        json_put_number(input, "coherence", from->coherence);
        json_put_number(input, "coherence_bound", from->coherence_bound);
        p = fmin(p, from->correlation.p_value);
    }
    json_put_number(channel, "input_p", p);
}

static void put_channel(struct json *channels, const struct comparison *all, const struct comparison_channel *c)
{
    char text[1200];
    struct json *channel = json_push(channels, json_new_object());
    json_put_text(channel, "name", c->name);
    json_put_number(channel, "nrmse", c->nrmse);
    json_put_number(channel, "noise_ratio", c->noise_ratio);
    put_bands(channel, c);
    put_noise(channel, &c->noise, c->rms);
    json_put_number(channel, "residual_rms", c->residual_rms);
    json_put_number(channel, "measured_rms", c->rms);
    json_put_number(channel, "scale", c->scale);
    json_put_number(channel, "alignment", c->alignment);
    put_numbers(channel, "time_share", c->time_share, 3);
    put_numbers(channel, "amplitude_share", c->amplitude.share, 3);
    put_numbers(channel, "amplitude_error", c->amplitude.relative, 3);
    compare_put_where(channel);
    put_tests(channel, c);
    compare_summary(all, c, text, sizeof text);
    json_put_text(channel, "text", text);
    if (c->warning[0] != '\0')
        json_put_text(channel, "warning", c->warning);
}

struct json *compare_json(const struct comparison *all, const struct line_comparison *lines)
{
    struct json *root = json_new_object(), *records = json_put(root, "records", json_new_array());
    for (size_t r = 0; r < all->n_records; r++) {
        struct json *record = json_push(records, json_new_object());
        json_put_text(record, "file", all->records[r].path != NULL ? all->records[r].path : "");
        json_put_text(record, "sha256", all->records[r].sha256);
        json_put_bool(record, "held_out", r >= all->n_records - all->n_held_out);
        json_put_number(record, "level", all->level[r]);
        json_put_bool(record, "level_solved", all->level[r] < 1.0 || all->level[r] > 1.0);
        struct json *channels = json_put(record, "channels", json_new_array());
        for (size_t i = 0; i < all->n_channels; i++)
            if (all->channels[i].record == r)
                put_channel(channels, all, &all->channels[i]);
    }
    if (lines != NULL)
        compare_lines_json(records, lines);
    struct json *notes = json_put(root, "notes", json_new_array());
    for (size_t i = 0; i < all->n_notes; i++)
        json_push_text(notes, all->notes[i]);
    json_put_number(root, "nrmse", all->nrmse);
    json_put_number(root, "noise_ratio", all->noise_ratio);
    attainable_json(root, &all->attainable, all->nrmse);
    json_put_number(root, "check_nrmse", all->check_nrmse);
    json_put_number(root, "check_noise_ratio", all->check_noise_ratio);
    put_numbers(root, "frequency_Hz", all->frequency_Hz, all->n_modes);
    return root;
}
