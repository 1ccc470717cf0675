/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factor_words.c — a factor of a channel as sentences, as the line of the model file, and in the model. */
#include "factor_pair.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double g = 9.80665; /* m/s² */
/* Standard deviations of what is only about right, and what a fit finds better: a place that a short fit has found, of the length; a decade. */
static const double place_sd = 0.01, decade_sd = 0.05;

/* ---- The gain that says it ---- */

static struct parameter *gain_of(struct model *model, bool is_input, size_t channel)
{
    if (is_input)
        return model->inputs[channel].kind == INPUT_PATCH_MOMENT ? &model->KB : &model->inputs[channel].own.gain;
    return model->outputs[channel].kind == OUTPUT_PATCH_STRAIN ? &model->Ks : &model->outputs[channel].own.gain;
}

static bool is_ten(double size)
{
    return size > 5.0 && size < 50.0;
}

static bool is_tenth(double size)
{
    return size > 0.02 && size < 0.2;
}

/* Standard gravity stands for itself only where an acceleration or a force may be counted in it. */
static double gain_factor(const struct model *model, const struct channel_factor *f)
{
    const double size = fabs(f->factor), sign = f->factor < 0.0 ? -1.0 : 1.0;
    const bool gravity = f->is_input ? is_ten(size) && model->inputs[f->channel].kind == INPUT_POINT_FORCE
                                     : is_tenth(size) && model->outputs[f->channel].kind == OUTPUT_ACCELERATION;
    if (gravity)
        return sign * (is_ten(size) ? g : 1.0 / g);
    return sign * (is_ten(size) ? 10.0 : is_tenth(size) ? 0.1 : size);
}

static struct channel_parameters *own_of(struct model *model, bool is_input, size_t channel)
{
    return is_input ? &model->inputs[channel].own : &model->outputs[channel].own;
}

static void set_place(struct model *model, const struct channel_factor *f)
{
    struct channel_parameters *own = own_of(model, f->is_input, f->channel);
    *(f->is_input ? &model->inputs[f->channel].at_m : &model->outputs[f->channel].at_m) = f->found;
    own->at.value = own->at.prior_value = f->found, own->at.sd = 0.0;
    if (own->at.fixed)
        model_channel_open_place(own, f->found, place_sd * model->length_m);
}

/* A sensor of 10.2 mV/(m/s²) is off by a decade; a sign and a thousand are exact. The gain of a patch is K_s or K_B, which has its own prior. */
static void open_decade(struct model *model, const struct channel_factor *f)
{
    struct channel_parameters *own = own_of(model, f->is_input, f->channel);
    const double size = fabs(f->factor);
    if (own->gain.name[0] && own->gain.fixed && (is_ten(size) || is_tenth(size)))
        model_channel_open_gain(own, decade_sd);
}

void channel_factors_apply(const struct channel_factors *factors, struct model *model)
{
    for (size_t i = 0; i < factors->n; i++) {
        const struct channel_factor *f = &factors->all[i];
        if (f->kind == FACTOR_PLACE)
            set_place(model, f);
        if (f->kind != FACTOR_CHANNEL)
            continue;
        struct parameter *gain = gain_of(model, f->is_input, f->channel);
        const double factor = gain_factor(model, f), low = gain->min, high = gain->max;
        gain->value *= factor, gain->prior_value *= factor, gain->sd = 0.0;
        gain->logarithmic = gain->logarithmic && gain->value > 0.0;
        if (isfinite(low) || isfinite(high))
            gain->min = factor > 0.0 ? low * factor : -HUGE_VAL, gain->max = factor > 0.0 ? high * factor : HUGE_VAL;
        open_decade(model, f);
    }
}

static const char *name_of(const struct model *model, bool is_input, size_t channel)
{
    return is_input ? model->inputs[channel].name : model->outputs[channel].name;
}

static void exchange_columns(struct record *record, const char *a, const char *b)
{
    char **one = NULL, **two = NULL;
    for (size_t c = 0; c < record->n_columns; c++) {
        one = strcmp(record->columns[c].name, a) == 0 ? &record->columns[c].name : one;
        two = strcmp(record->columns[c].name, b) == 0 ? &record->columns[c].name : two;
    }
    if (one == NULL || two == NULL)
        return;
    char *name = *one;
    *one = *two, *two = name;
}

void channel_factors_apply_to_records(const struct channel_factors *factors, const struct model *model,
                                      struct record records[], size_t n_records)
{
    for (size_t i = 0; i < factors->n; i++)
        for (size_t r = 0; r < n_records; r++) {
            const struct channel_factor *f = &factors->all[i];
            if (f->kind == FACTOR_TIME)
                records[r].t0_s *= f->factor, records[r].dt_s *= f->factor;
            else if (f->kind == FACTOR_EXCHANGE)
                exchange_columns(&records[r], name_of(model, f->is_input, f->channel),
                                 name_of(model, f->other_is_input, f->other));
        }
}

/* ---- Words ---- */

/* What a column that is `size` times what its name says may hold. */
const char *factor_unit_words(const struct model *model, const struct channel_factor *f)
{
    const double size = f->is_input ? 1.0 / fabs(f->factor) : fabs(f->factor); /* column over truth */
    const bool acceleration = !f->is_input && model->outputs[f->channel].kind == OUTPUT_ACCELERATION;
    const bool force = f->is_input && model->inputs[f->channel].kind == INPUT_POINT_FORCE;
    if (size > 100.0)
        return "in thousandths of its unit (mV for V, mm for m, mN for N)";
    if (size < 0.01)
        return "in thousands of its unit (kV, km, kN)";
    if (size < 1.0 && acceleration)
        return "in g instead of m/s² (factor 1/9.81), or a gain off by a decade";
    if (size < 1.0 && force)
        return "in kilogram-force instead of N (factor 1/9.81), or a gain off by a decade";
    if (acceleration || force)
        return "multiplied by 9.81 once too often, or a gain off by a decade";
    return size < 1.0 ? "ten times too small: a gain off by a decade" : "ten times too large: a gain off by a decade";
}

static bool turned(const struct channel_factor *f)
{
    return f->factor < 0.0;
}

static bool scaled(const struct channel_factor *f)
{
    return fabs(log(fabs(f->factor))) > 1e-9;
}

static void say_what(const struct model *model, const struct channel_factor *f, FILE *out)
{
    const char *name = name_of(model, f->is_input, f->channel);
    const char *other = f->either ? name_of(model, true, f->other) : "";
    if (turned(f) && f->either)
        (void)fprintf(out, "%s and %s point opposite ways. ", other, name);
    else if (turned(f))
        (void)fprintf(out, "%s points the other way than the model and the other channels say. ", name);
    if (scaled(f) && f->either)
        (void)fprintf(out, "%s is %.4g times what the model answers to %s. That is %s as if %s were %s. ", name,
                      fabs(f->found), other, turned(f) ? "beside its sign" : "", name, factor_unit_words(model, f));
    else if (scaled(f) && f->relative)
        (void)fprintf(out, "Against %s, %s is %.4g times what the model says, as if it were %s. ",
                      model->outputs[f->against].name, name, fabs(f->found), factor_unit_words(model, f));
    else if (scaled(f))
        (void)fprintf(out, "%s is %.4g times what the model says, as if it were %s. ", name,
                      f->is_input ? 1.0 / fabs(f->found) : fabs(f->found), factor_unit_words(model, f));
}

static void say_why(const struct model *model, const struct channel_factor *f, FILE *out)
{
    (void)fprintf(out, "With that changed the error of a fit falls from %.3g %% to %.3g %%", 100.0 * f->before,
                  100.0 * f->after);
    if (turned(f))
        (void)fprintf(out, ", in all bands; a mass, a spring or a wrong place turns some modes, not all");
    (void)fprintf(out, ". ");
    if (f->relative)
        (void)fprintf(out, "It could be %s that is off the other way: the gain of what drives both is open. ",
                      model->outputs[f->against].name);
    else if (f->either)
        (void)fprintf(out,
                      "The records know only the product of the two channels: which of them it is they cannot tell "
                      "(the same change in %s does as well), and for the fit it makes no difference. ",
                      name_of(model, true, f->other));
    if (scaled(f) && !f->relative && fabs(f->factor) > 0.01 && fabs(f->factor) < 100.0)
        (void)fprintf(out, "A beam whose mass per length is wrong by this factor in the model would look the same: "
                           "weigh it if there is a doubt. ");
}

static void say_point_line(const struct model *model, struct channel_factor *f, const char *name, double value)
{
    const struct model_output *o = f->is_input ? NULL : &model->outputs[f->channel];
    const struct model_input *i = f->is_input ? &model->inputs[f->channel] : NULL;
    char mass[40] = "";
    if (o != NULL && o->mass_kg > 0.0)
        (void)snprintf(mass, sizeof mass, ", mass_kg: %.9g", o->mass_kg);
    (void)snprintf(f->line, sizeof f->line, "%s: {kind: %s, at_m: %.9g%s, gain: %.6g}", name,
                   o != NULL ? model_output_kind_name(o->kind) : model_input_kind_name(i->kind),
                   o != NULL ? o->at_m : i->at_m, mass, value);
}

static void say_line(const struct model *model, struct channel_factor *f)
{
    const char *name = name_of(model, f->is_input, f->channel);
    struct model copy = *model;
    const struct parameter *gain = gain_of(&copy, f->is_input, f->channel);
    const double value = gain->value * gain_factor(model, f);
    const bool patch = f->is_input ? model->inputs[f->channel].kind == INPUT_PATCH_MOMENT
                                   : model->outputs[f->channel].kind == OUTPUT_PATCH_STRAIN;
    const struct channel_parameters *own =
        f->is_input ? &model->inputs[f->channel].own : &model->outputs[f->channel].own;
    f->block = patch ? "parameters" : f->is_input ? "inputs" : "outputs";
    if (patch)
        (void)snprintf(f->line, sizeof f->line, "%s: {value: %.6g}", gain->name, value);
    else if (own->lists_at || own->lists_gain)
        (void)snprintf(f->line, sizeof f->line, "%s: {..., gain: %.6g}", name, value);
    else
        say_point_line(model, f, name, value);
}

static void say_time(const struct channel_factor *f, FILE *out)
{
    if (f->factor < 1.0)
        (void)fprintf(out, "time_s is in milliseconds: as seconds the records end below the beam's lowest mode");
    else
        (void)fprintf(out, "time_s is a thousandth of the seconds that passed: the records ring far above the beam");
    (void)fprintf(out,
                  ". With the times %s a fit leaves %.3g %%. Import the records again with --time-unit %s, or "
                  "%s their first column by 1000. ",
                  f->factor < 1.0 ? "divided by 1000" : "multiplied by 1000", 100.0 * f->after,
                  f->factor < 1.0 ? "ms" : "s", f->factor < 1.0 ? "divide" : "multiply");
}

static void say_no_time(FILE *out)
{
    (void)fprintf(out, "time_s holds no time of this beam: as seconds the records end below its lowest mode, or ring "
                       "far above it, and with the "
                       "times in thousandths no fit finds it either. Is it a frequency response? Then the first column "
                       "is freq_Hz, and import takes it "
                       "with --frequency CHANNEL. ");
}

/* The channel as it stands in the file, at the place that was found. */
static void say_place_line(const struct model *model, struct channel_factor *f, const char *name)
{
    const struct model_output *o = f->is_input ? NULL : &model->outputs[f->channel];
    const struct model_input *i = f->is_input ? &model->inputs[f->channel] : NULL;
    const struct channel_parameters *own = o != NULL ? &o->own : &i->own;
    f->block = o != NULL ? "outputs" : "inputs";
    if (own->lists_at || own->lists_gain || (o != NULL && o->mass_kg > 0.0))
        (void)snprintf(f->line, sizeof f->line, "%s: {..., at_m: %.3g, ...}", name, f->found);
    else
        (void)snprintf(f->line, sizeof f->line, "%s: {kind: %s, at_m: %.3g}", name,
                       o != NULL ? model_output_kind_name(o->kind) : model_input_kind_name(i->kind), f->found);
}

static void say_place(const struct model *model, struct channel_factor *f, FILE *out)
{
    const char *name = name_of(model, f->is_input, f->channel);
    const double given_m = f->is_input ? model->inputs[f->channel].at_m : model->outputs[f->channel].at_m;
    (void)fprintf(
        out,
        "%s was at %.3g m from the clamp, not at %.3g m: with that the error of a fit falls from %.3g %% to %.3g %%. ",
        name, f->found, given_m, 100.0 * f->before, 100.0 * f->after);
    if (f->either)
        (void)fprintf(out, "%s at %.3g m, not at %.3g m, does as well: go and measure. ", model->inputs[f->other].name,
                      f->other_found, model->inputs[f->other].at_m);
    say_place_line(model, f, name);
}

static void say_exchange(const struct model *model, const struct channel_factor *f, FILE *out)
{
    (void)fprintf(out,
                  "%s and %s stand in each other's columns: exchanged, the error of a fit falls from %.3g %% to %.3g "
                  "%%. Import the records again with "
                  "the names as they should be (--channel FROM=TO), or exchange the two in their header. ",
                  name_of(model, f->is_input, f->channel), name_of(model, f->other_is_input, f->other),
                  100.0 * f->before, 100.0 * f->after);
}

void factor_words(const struct model *model, struct channel_factor *f)
{
    FILE *out = fmemopen(f->text, sizeof f->text, "w");
    f->text[0] = f->line[0] = '\0';
    if (out == NULL)
        return;
    if (f->kind == FACTOR_TIME) {
        say_time(f, out);
    } else if (f->kind == FACTOR_NO_TIME) {
        say_no_time(out);
    } else if (f->kind == FACTOR_PLACE) {
        say_place(model, f, out);
    } else if (f->kind == FACTOR_EXCHANGE) {
        say_exchange(model, f, out);
    } else {
        say_what(model, f, out);
        say_why(model, f, out);
        say_line(model, f);
    }
    (void)fclose(out);
    const size_t n = strlen(f->text);
    if (n > 0 && f->text[n - 1] == ' ')
        f->text[n - 1] = '\0';
}
