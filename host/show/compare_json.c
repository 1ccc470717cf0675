/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_json.c — a comparison for programs: the keys of `beamfit compare --help`, and what else was measured. */
#include "compare_text.h"
#include "show.h"
#include "compare/compare.h"

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
