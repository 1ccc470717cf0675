/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_lines_answer.c — records that are no samples beside a model, as a part of the answer of a comparison. */
#include "compare_text.h"
#include "show.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool held_out(const struct line_comparison *lines, size_t record)
{
    return record >= lines->n - lines->n_held_out;
}

/* Difference of a pair in standard errors, or in per cent where nobody stated them; NAN without a mode. */
static double difference(const struct pole_pair *pair, bool damping)
{
    const struct measured_frequency *m = &pair->measured;
    const double z = damping ? m->damping_ratio : m->frequency_Hz, y = damping ? pair->model_damping : pair->model_Hz;
    const double sd = damping ? m->damping_sd : m->sd_Hz;
    return pair->mode > 0 ? (z - y) / (sd > 0.0 ? sd : 0.01 * z) : nan("");
}

/* One band for each measured frequency, up to the geometric means with its neighbours. */
static void put_bands(struct json *channel, const struct pole_table *table, bool damping)
{
    struct json *bands = json_put(channel, "bands", json_new_array());
    double sum = 0.0;
    for (size_t i = 0; i < table->n; i++)
        if (isfinite(difference(&table->pairs[i], damping)))
            sum += pow(difference(&table->pairs[i], damping), 2.0);
    for (size_t i = 0; i < table->n; i++) {
        const struct pole_pair *pair = &table->pairs[i];
        const double f = pair->measured.frequency_Hz, d = difference(pair, damping);
        const double sd = damping ? pair->measured.damping_sd : pair->measured.sd_Hz;
        if (!isfinite(d))
            continue;
        struct json *band = json_push(bands, json_new_object());
        json_put_number(band, "from_Hz", i > 0 ? sqrt(f * table->pairs[i - 1].measured.frequency_Hz) : 0.0);
        json_put_number(band, "to_Hz",
                        i + 1 < table->n ? sqrt(f * table->pairs[i + 1].measured.frequency_Hz) : 2.0 * f);
        json_put_number(band, "share", sum > 0.0 ? d * d / sum : 0.0);
        json_put_number(band, "noise_ratio", sd > 0.0 ? fabs(d) : nan(""));
        json_put_number(band, "mode", (double)pair->mode);
    }
}

/* Of a spectrum: a mode in each, up to the geometric means with its neighbours. */
static void put_spectrum_bands(struct json *channel, const struct line_spectrum *s, const struct modes *modes)
{
    struct json *bands = json_put(channel, "bands", json_new_array());
    double from_Hz = 0.0, sum = 0.0;
    for (size_t k = 0; k < s->n; k++)
        sum += pow(s->predicted[k] - s->measured[k], 2.0);
    for (size_t m = 0; m < modes->n && from_Hz < s->frequency_Hz[s->n - 1]; m++) {
        const double f = modes->mode[m].undamped_Hz;
        const double to_Hz = m + 1 < modes->n ? sqrt(f * modes->mode[m + 1].undamped_Hz) : HUGE_VAL;
        double square = 0.0, ratio = 0.0, n = 0.0;
        for (size_t k = 0; k < s->n; k++) {
            const double r = s->predicted[k] - s->measured[k];
            if (s->frequency_Hz[k] < from_Hz || s->frequency_Hz[k] >= to_Hz)
                continue;
            square += r * r, ratio += r * r / (s->sd[k] * s->sd[k]), n += 1.0;
        }
        struct json *band = json_push(bands, json_new_object());
        json_put_number(band, "from_Hz", from_Hz);
        json_put_number(band, "to_Hz", fmin(to_Hz, s->frequency_Hz[s->n - 1]));
        json_put_number(band, "share", sum > 0.0 ? square / sum : 0.0);
        json_put_number(band, "noise_ratio", n > 0.0 ? sqrt(ratio / n) : nan(""));
        json_put_number(band, "mode", (double)m + 1.0);
        from_Hz = to_Hz;
    }
}

static const struct line_spectrum *spectrum_of(const struct line_comparison *lines, const struct fit_channel_error *c)
{
    for (size_t i = 0; i < lines->spectra[c->record].n; i++)
        if (strcmp(lines->spectra[c->record].all[i].name, c->name) == 0)
            return &lines->spectra[c->record].all[i];
    return NULL;
}

static void say_spectrum(const struct line_comparison *lines, const struct fit_channel_error *c,
                         const struct line_spectrum *s, char text[300])
{
    (void)snprintf(text, 300,
                   "%s %s: %zu lines without phase; the model misses %.3g %% of them, %.3g times the noise%s%s.",
                   text_base_name(lines->records[c->record].path), c->name, c->n, 100.0 * c->nrmse, c->noise_ratio,
                   s->stated ? "" : ", as neighbouring lines tell it",
                   compare_is_noise(c->noise_ratio) ? ": nothing is left to explain" : "");
}

static void say_channel(const struct line_comparison *lines, const struct fit_channel_error *c, char text[300])
{
    const bool damping = strcmp(c->name, "damping_ratio") == 0;
    const struct line_spectrum *spectrum = spectrum_of(lines, c);
    if (spectrum != NULL) {
        say_spectrum(lines, c, spectrum, text);
        return;
    }
    char noise[100] = "; the list states no standard errors";
    if (isfinite(c->noise_ratio))
        (void)snprintf(noise, sizeof noise, ", %.3g times their standard errors%s", c->noise_ratio,
                       compare_is_noise(c->noise_ratio) ? ": nothing is left to explain" : "");
    (void)snprintf(text, 300, "%s: %zu %s, %.3g %% off (rms)%s.", text_base_name(lines->records[c->record].path), c->n,
                   damping ? "damping ratios" : "frequencies", 100.0 * c->nrmse, noise);
}

static void put_channels(struct json *record, const struct line_comparison *lines, size_t r)
{
    struct json *channels = json_put(record, "channels", json_new_array());
    char text[300];
    for (size_t i = 0; i < lines->n_channels; i++) {
        const struct fit_channel_error *c = &lines->channels[i];
        if (c->record != r)
            continue;
        struct json *channel = json_push(channels, json_new_object());
        json_put_text(channel, "name", c->name);
        json_put_number(channel, "nrmse", c->nrmse);
        json_put_number(channel, "noise_ratio", c->noise_ratio);
        const struct line_spectrum *spectrum = spectrum_of(lines, c);
        if (spectrum != NULL)
            put_spectrum_bands(channel, spectrum, &lines->modes);
        else
            put_bands(channel, &lines->tables[r], strcmp(c->name, "damping_ratio") == 0);
        compare_put_where(channel);
        say_channel(lines, c, text);
        json_put_text(channel, "text", text);
    }
}

void compare_lines_json(struct json *records, const struct line_comparison *lines)
{
    for (size_t r = 0; r < lines->n; r++) {
        struct json *record = json_push(records, json_new_object());
        json_put_text(record, "file", lines->records[r].path != NULL ? lines->records[r].path : "");
        json_put_text(record, "sha256", lines->records[r].sha256);
        json_put_bool(record, "held_out", held_out(lines, r));
        json_put_number(record, "level", 1.0);
        json_put_bool(record, "level_solved", false);
        put_channels(record, lines, r);
        if (lines->tables[r].n > 0)
            pole_table_json(record, &lines->tables[r]);
    }
}
