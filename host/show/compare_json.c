/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_json.c — a comparison for programs: the keys of `beamfit compare --help`, and what else was measured. */
#include "compare_text.h"
#include "show.h"
#include "compare/compare.h"

static const struct answer_field band_fields[] = {
    ANSWER_ROW(NUMBER, "from_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "to_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "share", "of the misfit's power"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over noise in it"),
    {ANSWER_COUNT, "mode", "of the model in it, from 1", NULL, ANSWER_MAYBE, NULL},
    {0},
};

static const struct answer_field noise_fields[] = {
    ANSWER_ROW(TEXT, "method", "how it was judged"),
    ANSWER_ROW(NUMBER, "rms", "in the channel's unit"),
    ANSWER_ROW(NUMBER, "rms_sd", "its standard error"),
    ANSWER_ROW(NUMBER, "used_share", "of the record that was used"),
    ANSWER_ROW(COUNT, "cells", "of time and frequency that were used"),
    ANSWER_ROW(NUMBER, "quantisation", "step of the data, in the channel's unit"),
    {0},
};

static const struct answer_field white_fields[] = {
    ANSWER_ROW(NUMBER, "p_value", "of both tests together"),
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
    ANSWER_ROW(NUMBER, "coherence", "of residual and input"),
    {0},
};

static const struct answer_field channel_fields[] = {
    ANSWER_ROW(TEXT, "name", "column of the record"),
    ANSWER_ROW(NUMBER, "nrmse", "norm of the misfit over norm of the signal"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data"),
    ANSWER_ROW_OF(LIST, "bands", "where the misfit is", band_fields),
    ANSWER_ROW_OF(OBJECT, "noise", "of the channel, as the record shows it", noise_fields),
    ANSWER_ROW(NUMBER, "residual_rms", "in the channel's unit"),
    ANSWER_ROW(NUMBER, "measured_rms", "in the channel's unit"),
    ANSWER_ROW(NUMBER, "scale", "of the model that would fit best"),
    ANSWER_ROW(NUMBER, "alignment", "of measured and model: 1 alike, -1 turned"),
    ANSWER_ROW(NUMBERS, "time_share", "of the misfit's power, in thirds of the record"),
    ANSWER_ROW(NUMBERS, "amplitude_share", "the same by size of the motion, small to large"),
    ANSWER_ROW(NUMBERS, "amplitude_error", "relative error there"),
    {ANSWER_OBJECT, "whiteness", "of the residual", white_fields, ANSWER_MAYBE, NULL},
    {ANSWER_LIST, "inputs", "what the residual has of each", input_fields, ANSWER_MAYBE, NULL},
    ANSWER_ROW(TEXT, "text", "in a sentence or two"),
    {ANSWER_TEXT, "warning", "on the channel", NULL, ANSWER_MAYBE, NULL},
    {0},
};

static const struct answer_field record_fields[] = {
    ANSWER_ROW(TEXT, "file", "the record"),
    ANSWER_ROW(TEXT, "sha256", "of it"),
    ANSWER_ROW(BOOL, "held_out", "of the fit"),
    ANSWER_ROW(NUMBER, "level", "of the excitation, 1 unless it was solved for"),
    ANSWER_ROW_OF(LIST, "channels", "one for each output", channel_fields),
    {0},
};

const struct answer_field compare_fields[] = {
    ANSWER_ROW_OF(LIST, "records", "fitted ones first", record_fields),
    ANSWER_ROW(TEXTS, "notes", "on what looks ordinary"),
    ANSWER_ROW(NUMBER, "nrmse", "error: root mean square over channels of norm of the misfit over norm of the signal"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data (1: nothing is left to explain)"),
    {ANSWER_OBJECT, "attainable", "what the best linear model with as many modes leaves; null: not known",
     attainable_fields, ANSWER_NULL, NULL},
    ANSWER_ROW(NUMBER, "check_nrmse", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_noise_ratio", "of held-out records"),
    ANSWER_ROW(NUMBERS, "frequency_Hz", "of the model's modes"),
    ANSWER_ROW_OF(LIST, "channel_factors", "wrong signs and units of channels", channel_factor_fields),
    ANSWER_ROW_OF(LIST, "record_findings", "what is wrong with records before any model", record_finding_fields),
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

static void put_noise(struct json *channel, const struct noise_estimate *noise)
{
    struct json *object = json_put(channel, "noise", json_new_object());
    json_put_text(object, "method", noise_method_text(noise->method));
    json_put_number(object, "rms", noise->rms);
    json_put_number(object, "rms_sd", noise->rms_sd);
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
    for (size_t i = 0; i < c->n_inputs; i++) {
        const struct comparison_input *from = &c->inputs[i];
        struct json *input = json_push(inputs, json_new_object());
        json_put_text(input, "name", from->name);
        json_put_number(input, "correlation", from->correlation.largest);
        json_put_number(input, "lag_s", (double)from->correlation.largest_lag * c->dt_s);
        json_put_number(input, "bound", from->correlation.bound_all);
        json_put_number(input, "p_value", from->correlation.p_value);
        json_put_number(input, "coherence", from->coherence);
    }
}

static void put_channel(struct json *channels, const struct comparison *all, const struct comparison_channel *c)
{
    char text[1200];
    struct json *channel = json_push(channels, json_new_object());
    json_put_text(channel, "name", c->name);
    json_put_number(channel, "nrmse", c->nrmse);
    json_put_number(channel, "noise_ratio", c->noise_ratio);
    put_bands(channel, c);
    put_noise(channel, &c->noise);
    json_put_number(channel, "residual_rms", c->residual_rms);
    json_put_number(channel, "measured_rms", c->rms);
    json_put_number(channel, "scale", c->scale);
    json_put_number(channel, "alignment", c->alignment);
    put_numbers(channel, "time_share", c->time_share, 3);
    put_numbers(channel, "amplitude_share", c->amplitude.share, 3);
    put_numbers(channel, "amplitude_error", c->amplitude.relative, 3);
    put_tests(channel, c);
    compare_summary(all, c, text, sizeof text);
    json_put_text(channel, "text", text);
    if (c->warning[0] != '\0')
        json_put_text(channel, "warning", c->warning);
}

struct json *compare_json(const struct comparison *all)
{
    struct json *root = json_new_object(), *records = json_put(root, "records", json_new_array());
    for (size_t r = 0; r < all->n_records; r++) {
        struct json *record = json_push(records, json_new_object());
        json_put_text(record, "file", all->records[r].path != NULL ? all->records[r].path : "");
        json_put_text(record, "sha256", all->records[r].sha256);
        json_put_bool(record, "held_out", r >= all->n_records - all->n_held_out);
        json_put_number(record, "level", all->level[r]);
        struct json *channels = json_put(record, "channels", json_new_array());
        for (size_t i = 0; i < all->n_channels; i++)
            if (all->channels[i].record == r)
                put_channel(channels, all, &all->channels[i]);
    }
    struct json *notes = json_put(root, "notes", json_new_array());
    for (size_t i = 0; i < all->n_notes; i++)
        json_push_text(notes, all->notes[i]);
    json_put_number(root, "nrmse", all->nrmse);
    json_put_number(root, "noise_ratio", all->noise_ratio);
    attainable_json(root, &all->attainable);
    json_put_number(root, "check_nrmse", all->check_nrmse);
    json_put_number(root, "check_noise_ratio", all->check_noise_ratio);
    put_numbers(root, "frequency_Hz", all->frequency_Hz, all->n_modes);
    return root;
}
