/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One or two plain sentences about a reconstructed force. */
#include "reconstruct_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "maths/maths.h"

/* A channel shows misfit above this many times its noise, and shows none below that. */
static const double shows = 3.0, clean = 1.3;
/* Shares that count as the main part of what is explained, and as a part worth saying. */
static const double main_part = 0.6, a_part = 0.2;

/* rms residual over noise of an output, its worst record. */
static double worst_ratio(const struct motion *motion, size_t output, bool *any)
{
    double worst = 0.0;
    *any = false;
    for (size_t c = 0; c < motion->n_channels; c++) {
        const struct predict_channel *channel = &motion->channels[c];
        if (channel->output != output || !(motion->sigma[c] > 0.0))
            continue;
        *any = true;
        worst = fmax(worst, root_mean_square(motion->residual + channel->row, channel->n) / motion->sigma[c]);
    }
    return worst;
}

void reconstruct_channels(const struct motion *motion, struct reconstruction *out)
{
    const struct model *model = transfer_model(motion->predictor);
    size_t showing = 0, silent = 0, seen = 0, which = 0;
    for (size_t o = 0; o < model->n_outputs; o++) {
        bool any;
        double ratio = worst_ratio(motion, o, &any);
        seen += any;
        silent += any && ratio < clean;
        if (any && ratio > shows) {
            showing++;
            which = o;
        }
    }
    out->sensor_like = showing == 1 && silent > 0 && silent + 1 == seen;
    if (out->sensor_like)
        (void)snprintf(out->channel, sizeof out->channel, "%s", model->outputs[which].name);
}

static const char *elastic_words(const struct reconstruction *out)
{
    if (out->elastic_even > a_part * (out->elastic_odd + out->elastic_even))
        return "a one-sided or lopsided spring: the force is a function of displacement, different on the two sides";
    return out->hardening ? "a hardening spring: the force is an odd function of displacement and grows faster than it"
                          : "a softening spring: the force is an odd function of displacement and grows slower than it";
}

static const char *damping_words(const struct reconstruction *out)
{
    return out->drag ? "a drag that grows faster than velocity: the force is an odd function of velocity"
                     : "dry friction: the force is an odd function of velocity and hardly grows with it";
}

/* At a frequency where the model has no mode the beam may have one: the force alone does not tell it from one that comes from outside. */
static void line_words(const struct reconstruction *out, char *text, size_t room)
{
    (void)snprintf(text, room,
                   "a force at one frequency, %.4g Hz, where the model has no mode: hum, a shaking support, a small "
                   "resonator, or a mode of the beam that the model has elsewhere",
                   out->frequency_Hz);
}

static const char *shape_words(const struct reconstruction *out)
{
    double elastic = out->elastic_odd + out->elastic_even, explained = 1.0 - out->memory;
    if (!out->is_law)
        return out->dissipated > 0.3
                   ? "friction with memory: no function of displacement and velocity there, and it takes energy out"
                   : "no function of displacement and velocity there: memory, a force from outside, or several places";
    if (out->linear > 0.9 * explained)
        return "a linear spring, mass or damper: the force is proportional to the motion";
    if (elastic > main_part * explained)
        return elastic_words(out);
    if (out->dissipative > a_part * explained)
        return damping_words(out);
    return "part spring, part damper";
}

static void place_words(const struct reconstruction *out, char *text, size_t room)
{
    switch (out->best.place) {
    case RECONSTRUCT_POINT:
        (void)snprintf(text, room, "near x = %.2f m", out->best.at_m);
        break;
    case RECONSTRUCT_PATCH:
        (void)snprintf(text, room, "at the patch");
        break;
    case RECONSTRUCT_SPREAD:
        (void)snprintf(text, room, "spread over the span");
        break;
    }
}

void reconstruct_text(struct reconstruction *out)
{
    char place[64], shape[256];
    const char *doubt = "";
    if (out->sensor_like) {
        (void)snprintf(out->text, sizeof out->text,
                       "Only %s shows the misfit, every other channel is at its noise: look at that sensor and its "
                       "amplifier, not at the beam.",
                       out->channel);
        return;
    }
    place_words(out, place, sizeof place);
    if (!out->located && !out->is_law && !isfinite(out->best.by_history))
        doubt =
            " Its place cannot be told from one channel a record; a second sensor in the same record would tell it.";
    else if (!out->located)
        doubt = " Its place is uncertain: other places explain nearly as much.";
    if (out->resonant)
        line_words(out, shape, sizeof shape);
    else
        (void)snprintf(shape, sizeof shape, "%s", shape_words(out));
    (void)snprintf(out->text, sizeof out->text, "A force %s looks like %s.%s", place, shape, doubt);
}
