/* SPDX-License-Identifier: GPL-3.0-or-later */
/* localise_text.c — where the misfit is, in sentences and as JSON. */
#include "localise_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "ground/ground.h"

static const double little = 0.02;    /* excess over the noise below which nothing is said to be left */
static const double mostly = 0.5;     /* share that deserves the first sentence alone */
static const double late_part = 0.75; /* of the misfit in the second half of the motion */

static void add(char *text, size_t size, const char *sentence)
{
    const size_t used = strlen(text);
    if (used + strlen(sentence) + 1 < size)
        (void)snprintf(text + used, size - used, "%s%s", used > 0 ? " " : "", sentence);
}

static const char *name_of(const struct misfit_channel *channel, bool by_channel)
{
    return by_channel ? channel->channel : text_base_name(channel->file);
}

static bool are_several(const struct misfit_channel channels[], size_t n, bool by_channel)
{
    for (size_t c = 1; c < n; c++)
        if (strcmp(name_of(&channels[c], by_channel), name_of(&channels[0], by_channel)) != 0)
            return true;
    return false;
}

/* Largest share of one channel name, or of one record: says when nearly all misfit is in one of several. */
static void say_single(const struct misfit_channel channels[], size_t n, const struct localisation *l, bool by_channel,
                       char *text, size_t size)
{
    double share = 0.0, all = 0.0;
    const char *first = NULL;
    for (size_t i = 0; i < l->n; i++) {
        const char *name = name_of(&channels[l->parts[i].channel], by_channel);
        if (first == NULL)
            first = name;
        all += l->parts[i].share;
        share += strcmp(name, first) == 0 ? l->parts[i].share : 0.0;
    }
    char sentence[240];
    if (first == NULL || l->n < 2 || !(share > 0.9 * all) || !are_several(channels, n, by_channel))
        return;
    (void)snprintf(sentence, sizeof sentence, "%.0f %% of it is in %s %s.", 100.0 * share,
                   by_channel ? "the channel" : "the record", first);
    add(text, size, sentence);
}

static void say_part(const struct misfit_channel channels[], const struct localised *p, bool first, char *text,
                     size_t size)
{
    char sentence[400], where[48] = "";
    const struct misfit_channel *c = &channels[p->channel];
    if (p->mode > 0)
        (void)snprintf(where, sizeof where, " (mode %zu)", p->mode);
    (void)snprintf(sentence, sizeof sentence,
                   "%.0f %% %s in %s of %s between %.3g and %.3g Hz%s, %.*f %% of the motion there%s%s.",
                   100.0 * p->share, first ? "of what is unexplained is" : "is", c->channel, text_base_name(c->file),
                   p->from_Hz, p->to_Hz, where, p->relative < 0.1 ? 1 : 0, 100.0 * p->relative,
                   p->amplitude == AMPLITUDE_LARGE   ? ", a share that grows with amplitude"
                   : p->amplitude == AMPLITUDE_SMALL ? ", a share that falls with amplitude"
                                                     : "",
                   p->late_share > late_part ? "; it builds up with time" : "");
    add(text, size, sentence);
}

void localise_describe(const struct misfit_channel channels[], size_t n_channels, struct localisation *out)
{
    out->text[0] = '\0';
    if (out->n == 0 || out->excess < little) {
        add(out->text, sizeof out->text, "Nothing above the noise is left unexplained.");
        return;
    }
    double said = 0.0;
    for (size_t i = 0; i < out->n && i < 3 && said < mostly + 0.25; i++) {
        say_part(channels, &out->parts[i], i == 0, out->text, sizeof out->text);
        said += out->parts[i].share;
    }
    say_single(channels, n_channels, out, true, out->text, sizeof out->text);
    say_single(channels, n_channels, out, false, out->text, sizeof out->text);
}

/* "all", "large", "small" */
static const char *amplitude_text(enum localise_amplitude amplitude)
{
    return amplitude == AMPLITUDE_LARGE ? "large" : amplitude == AMPLITUDE_SMALL ? "small" : "all";
}

struct json *localise_json(const struct localisation *localisation, const struct misfit_channel channels[])
{
    struct json *where = json_new_array();
    for (size_t i = 0; i < localisation->n; i++) {
        const struct localised *p = &localisation->parts[i];
        struct json *part = json_push(where, json_new_object());
        json_put_text(part, "file", channels[p->channel].file);
        json_put_text(part, "channel", channels[p->channel].channel);
        json_put_number(part, "from_Hz", p->from_Hz);
        json_put_number(part, "to_Hz", p->to_Hz);
        json_put_number(part, "share", p->share);
        json_put_text(part, "amplitude", amplitude_text(p->amplitude));
        json_put_number(part, "noise_ratio", p->noise_ratio);
        json_put_number(part, "relative", p->relative);
        json_put_number(part, "late_share", p->late_share);
    }
    return where;
}
