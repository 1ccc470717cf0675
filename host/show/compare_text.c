/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compare_text.h"
#include "ground/ground.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Appends to text, never beyond size. */
static void say(char *text, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void say(char *text, size_t size, const char *format, ...)
{
    const size_t n = strlen(text);
    va_list args;
    va_start(args, format);
    if (n + 1 < size)
        (void)vsnprintf(text + n, size - n, format, args);
    va_end(args);
}

static void say_where(const struct comparison_channel *c, char *text, size_t size)
{
    const struct comparison_band *band = compare_worst_band(c);
    if (band != NULL && band->share > 0.3) {
        say(text, size, " %.0f %% of the misfit lies between %.3g and %.3g Hz", 100.0 * band->share, band->from_Hz,
            band->to_Hz);
        if (band->mode > 0)
            say(text, size, " (mode %zu)", band->mode);
        say(text, size, ".");
    }
    const double *t = c->time_share;
    if (t[0] > 0.6)
        say(text, size, " Most of it is in the first third of the record.");
    else if (t[2] > 0.6)
        say(text, size, " Most of it is in the last third of the record.");
    const double small = c->amplitude.relative[0], large = c->amplitude.relative[2];
    const double floor = c->noise.rms > 0.0 && c->rms > 0.0 ? 3.0 * c->noise.rms / c->rms : 0.0;
    if (large > 2.0 * small && large > floor)
        say(text, size, " The relative error grows with the motion (%.2g %% small, %.2g %% large).", 100.0 * small,
            100.0 * large);
}

static void say_input(const struct comparison_channel *c, char *text, size_t size)
{
    for (size_t i = 0; i < c->n_inputs; i++) {
        const struct input_correlation *r = &c->inputs[i].correlation;
        if (!(r->p_value < 0.01))
            continue;
        if (r->largest_lag < 0 && r->largest_lag >= -r->alike)
            say(text, size, " It goes with %s: part of the response to it is missing.", c->inputs[i].name);
        else if (r->largest_lag < 0)
            say(text, size, " The residual runs ahead of %s by %.3g ms: a clock or a channel is out of step.",
                c->inputs[i].name, -1e3 * (double)r->largest_lag * c->dt_s);
        else if (r->largest_lag <= 1)
            say(text, size,
                " It follows %s at once: a direct path is missing (feedthrough, local compliance, a timing error).",
                c->inputs[i].name);
        else
            say(text, size, " It follows %s after %.3g ms: part of the response to it is missing.", c->inputs[i].name,
                1e3 * (double)r->largest_lag * c->dt_s);
    }
}

static bool can_judge(const struct comparison_channel *c)
{
    return c->n >= 20 && c->rms > 0.0;
}

void compare_finding(const struct comparison *all, const struct comparison_channel *c, char *text, size_t size)
{
    text[0] = '\0';
    say(text, size, "%s %s: ", text_base_name(all->records[c->record].path), c->name);
    if (!can_judge(c)) {
        say(text, size, "too little motion to judge.");
        return;
    }
    say(text, size, "the model misses %.3g %% of the signal", 100.0 * c->nrmse);
    if (!isfinite(c->noise_ratio))
        say(text, size, "; the noise could not be told from the record.");
    else if (compare_channel_is_noise(c))
        say(text, size, ", which is the noise of the channel (%.3g %%): nothing is left to explain.",
            100.0 * c->noise.rms / c->rms);
    else
        say(text, size, ", %.3g times the noise of the channel (%.3g %%).", c->noise_ratio,
            100.0 * c->noise.rms / c->rms);
    if (!compare_channel_is_noise(c))
        say_where(c, text, size);
}

void compare_summary(const struct comparison *all, const struct comparison_channel *c, char *text, size_t size)
{
    compare_finding(all, c, text, size);
    if (!can_judge(c))
        return;
    if (compare_channel_is_noise(c)) {
        if (c->whiteness.p_value < 0.01)
            say(text, size,
                " The residual is not white (p = %.2g), so the noise is coloured or a trace of misfit remains.",
                c->whiteness.p_value);
        return;
    }
    char suspected[SUSPECT_TEXT];
    compare_suspect(all, c, suspected);
    if (suspected[0] != '\0') { /* which would make a path, a delay and a nonlinearity of itself */
        say(text, size, " %s", suspected);
        return;
    }
    say_input(c, text, size);
    if (c->noise.rms > 0.0 && c->noise.used_share < 0.5)
        say(text, size,
            " Only %.0f %% of the record behaves as a linear system with noise: expect something nonlinear.",
            100.0 * c->noise.used_share);
}

void compare_put_where(struct json *channel)
{
    const struct json *bands = json_member(channel, "bands");
    char text[1500] = "";
    size_t n = 0;
    for (size_t b = 0; b < json_length(bands) && n < sizeof text; b++) {
        const struct json *band = json_item(bands, b), *number = json_member(band, "mode");
        const double share = json_number_of(json_member(band, "share"));
        char mode[32] = "";
        if (!(share >= 0.005))
            continue;
        if (number != NULL)
            (void)snprintf(mode, sizeof mode, " m%.0f", json_number_of(number));
        n += (size_t)snprintf(text + n, sizeof text - n, "%s%.3g-%.3g Hz%s %.0f", n > 0 ? ", " : "",
                              json_number_of(json_member(band, "from_Hz")), json_number_of(json_member(band, "to_Hz")),
                              mode, 100.0 * share);
    }
    json_put_text(channel, "where", text);
}
