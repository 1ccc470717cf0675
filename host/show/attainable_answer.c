/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_answer.c — the attainable floor in an answer. */
#include "show.h"

#include <math.h>
#include <stdio.h>

/* Errors within this factor of each other are the same for a reader who looks for a cause. */
static const double alike = 1.15;

/* The noise as a share of the signal, root mean square over the channels where it is known. */
static double noise_share(const struct attainable *a)
{
    double sum = 0.0, n = 0.0;
    for (size_t c = 0; c < a->n_channels; c++)
        if (a->channels[c].noise_ratio > 0.0) {
            const double share = a->channels[c].nrmse / a->channels[c].noise_ratio;
            sum += share * share;
            n += 1.0;
        }
    return n > 0.0 ? sqrt(sum / n) : nan("");
}

static bool beats_linear(const struct attainable *a, double nrmse)
{
    return nrmse < a->nrmse / alike;
}

static const char *advice(const struct attainable *a, double nrmse)
{
    const bool noise_only = a->noise_ratio <= alike;
    if (beats_linear(a, nrmse))
        return "The model does better than any linear one that was found: what it has beyond one is in the records.";
    if (noise_only && nrmse <= alike * a->nrmse)
        return "Nothing is left to explain; only a quieter sensor would show more.";
    if (noise_only)
        return "What the model misses is linear: a mass, a spring, a support, damping, a place, or a sensor's own "
               "response.";
    if (nrmse <= alike * a->nrmse)
        return "No linear model does better: look for a nonlinearity, for a signal that no input caused, or for modes "
               "that no bending beam has.";
    return "The model misses something linear first (a mass, a spring, a support, damping, a place, a sensor's own "
           "response); what a linear model leaves is a nonlinearity, a signal that no input caused, or modes that no "
           "bending beam has.";
}

/* " Of what was held out …"; "" where nothing was, and for a model that has what no linear one has. */
static void held_out(const struct attainable *a, double nrmse, size_t size, char text[])
{
    text[0] = '\0';
    if (!isfinite(a->held_out_noise_ratio) || !isfinite(a->noise_ratio) || beats_linear(a, nrmse))
        return;
    const bool worse = attainable_is_apart(a->held_out_noise_ratio, a->noise_ratio);
    (void)snprintf(text, size,
                   " Of the held-out records that linear model leaves %.3g times the noise, of its own %.3g.%s",
                   a->held_out_noise_ratio, a->noise_ratio,
                   worse ? " No one linear beam made both: compare the places and strengths of the blows, the gains, "
                           "or look for a nonlinearity."
                         : "");
}

/* " Of each record alone …"; "" where they may be of one linear beam. */
static void of_each(const struct attainable *a, size_t size, char text[])
{
    text[0] = '\0';
    if (attainable_differs(a))
        (void)snprintf(
            text, size,
            " Of each record alone such a model leaves %.3g %%, %.3g times the noise instead of %.3g: they are "
            "not of one linear beam. Was something changed between them (a mass, a screw, the place of a blow or a "
            "sensor, a gain)? Then fit them apart, or say in the model which value differs (per_record: {}). If "
            "nothing was, look for a nonlinearity: frequencies or damping that go with the level.",
            100.0 * a->each_nrmse, a->each_noise_ratio, a->noise_ratio);
}

static void put_text(struct json *object, const struct attainable *a, double nrmse)
{
    char text[1792], each[640], check[320], noise[64] = "the noise is not known";
    const double share = noise_share(a);
    of_each(a, sizeof each, each);
    held_out(a, nrmse, sizeof check, check);
    if (isfinite(share))
        (void)snprintf(noise, sizeof noise, "the noise %.2g %%", 100.0 * share);
    (void)snprintf(text, sizeof text,
                   "Attainable: a free linear model of %zu modes leaves %.3g %% (this model %.3g %%, %s). %s%s%s",
                   a->modes, 100.0 * a->nrmse, 100.0 * nrmse, noise, advice(a, nrmse), each, check);
    json_put_text(object, "text", text);
}

static const struct answer_field pole_fields[] = {
    ANSWER_ROW(NUMBER, "frequency_Hz", "of the mode"),
    ANSWER_ROW(NUMBER, "damping_ratio", "share of critical damping"),
    {0},
};

const struct answer_field attainable_fields[] = {
    ANSWER_ROW(NUMBER, "nrmse", "it leaves"),
    ANSWER_ROW(NUMBER, "noise_ratio", "the same in units of the noise"),
    ANSWER_ROW(NUMBER, "held_out_noise_ratio", "what it leaves of held-out records; null: none, or not known",
               .flags = ANSWER_NULL),
    ANSWER_ROW(
        NUMBER, "each_nrmse",
        "what free linear models of each record alone leave; null: one record, or all together are near the noise",
        .flags = ANSWER_NULL),
    ANSWER_ROW(NUMBER, "each_noise_ratio", "the same in units of the noise", .flags = ANSWER_NULL),
    ANSWER_ROW(COUNT, "modes", "of the linear model"),
    ANSWER_ROW_OF(LIST, "poles", "one for each mode", pole_fields),
    ANSWER_ROW(TEXT, "text", "what that says of the model"),
    ANSWER_SAY("{text}"),
    {0},
};

void attainable_json(struct json *root, const struct attainable *a, double nrmse)
{
    if (a->modes == 0) {
        json_put_number(root, "attainable", nan("")); /* null */
        return;
    }
    struct json *object = json_put(root, "attainable", json_new_object());
    json_put_number(object, "nrmse", a->nrmse);
    json_put_number(object, "noise_ratio", a->noise_ratio);
    json_put_number(object, "held_out_noise_ratio", a->held_out_noise_ratio);
    json_put_number(object, "each_nrmse", a->each_nrmse);
    json_put_number(object, "each_noise_ratio", a->each_noise_ratio);
    json_put_number(object, "modes", (double)a->modes);
    put_text(object, a, nrmse);
    struct json *poles = json_put(object, "poles", json_new_array());
    for (size_t k = 0; k < a->modes; k++) {
        struct json *pole = json_push(poles, json_new_object());
        json_put_number(pole, "frequency_Hz", a->poles[k].frequency_Hz);
        json_put_number(pole, "damping_ratio", a->poles[k].damping_ratio);
    }
}
