/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * model_units.c — values that look like another unit. The windows hold laboratory beams of every common material with
 * room to spare; the strongest test needs no window of its own: E/ρ of metals is the same within a few per cent
 * (2.6e7 m²/s²), of plastics ten times less, of carbon laminates four times more, so EI/rho tells the thickness.
 */
#include "model.h"
#include "model_check.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct warnings {
    model_warning *text;
    size_t n, room;
};

static void warn(struct warnings *w, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void warn(struct warnings *w, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (w->n < w->room)
        (void)vsnprintf(w->text[w->n++], sizeof *w->text, format, args);
    va_end(args);
}

static double span_of(const struct model *m, const char *region)
{
    double span = 0.0;
    for (size_t i = 0; i < m->n_regions; i++)
        if (strcmp(m->regions[i].name, region) == 0)
            span += m->regions[i].to_m - m->regions[i].from_m;
    return span;
}

/* The material of the longest span stands for the beam. */
static const struct material *main_material(const struct model *m)
{
    const struct material *best = NULL;
    double longest = 0.0;
    for (size_t i = 0; i < m->n_materials; i++) {
        double span = span_of(m, m->materials[i].name);
        if (span > longest) {
            longest = span;
            best = &m->materials[i];
        }
    }
    return best;
}

void model_place_advice(double x_m, double length_m, char text[PLACE_ADVICE])
{
    const bool of_another_unit = x_m > 2.0 * length_m; /* nearer is a slip of the ruler */
    const bool mm = of_another_unit && x_m * 1e-3 <= length_m, cm = of_another_unit && x_m * 1e-2 <= length_m;
    if (mm && cm)
        (void)snprintf(text, PLACE_ADVICE, "in metres? %g mm are %g m, %g cm %g m", x_m, 1e-3 * x_m, x_m, 1e-2 * x_m);
    else if (mm)
        (void)snprintf(text, PLACE_ADVICE, "in metres? %g mm are %g m", x_m, 1e-3 * x_m);
    else
        (void)snprintf(text, PLACE_ADVICE, "give a place within 0 … %g m", length_m);
}

static bool within(double x, double low, double high)
{
    return x >= low && x <= high;
}

static bool is_slender(double slenderness)
{
    return within(slenderness, 3e-4, 0.1);
}

/* Only a unit that makes a laboratory beam of it: thickness goes with the root of EI/rho. */
static const char *advise_unit(double slenderness, double rho)
{
    const bool EI = is_slender(slenderness * 1e-3), mass = is_slender(slenderness * sqrt(1e3)),
               length = is_slender(slenderness * 1e3);
    if (rho > 500.0)
        return "is the mass per length a density in kg/m³?";
    if (EI)
        return "is EI in N·mm²?";
    if (mass && length)
        return "is the mass per length in g/m, or the length in mm?";
    if (mass)
        return "is the mass per length in g/m?";
    return length ? "is the length in mm?" : "is one of the three wrong?";
}

static void check_stiffness_and_mass(const struct model *m, const struct material *beam, struct warnings *w)
{
    const double specific_modulus = 2.6e7;                                               /* E/ρ, m²/s² */
    double thickness = sqrt(12.0 * beam->EI.value / beam->rho.value / specific_modulus); /* EI/ρA = (E/ρ) h²/12 */
    double slenderness = thickness / m->length_m;
    if (!is_slender(slenderness) && w->n == 0)
        warn(w, "%s = %g N·m² with %s = %g kg/m is a metal beam %.3g mm thick and %.4g m long: %s", beam->EI.name,
             beam->EI.value, beam->rho.name, beam->rho.value, thickness * 1e3, m->length_m,
             advise_unit(slenderness, beam->rho.value));
    if (!within(beam->rho.value, 1e-4, 1e2))
        warn(w, "%s = %g kg/m is far from a laboratory beam (0.0001 … 100 kg/m): mass per length, in kg/m?",
             beam->rho.name, beam->rho.value);
    for (size_t i = 0; i < m->n_materials; i++) {
        const struct material *other = &m->materials[i];
        if (!within(other->EI.value / beam->EI.value, 1.0 / 300.0, 300.0))
            warn(w, "%s is %.3g times %s: are both in N·m²?", other->EI.name, other->EI.value / beam->EI.value,
                 beam->EI.name);
        if (!within(other->rho.value / beam->rho.value, 1.0 / 300.0, 300.0))
            warn(w, "%s is %.3g times %s: are both in kg/m?", other->rho.name, other->rho.value / beam->rho.value,
                 beam->rho.name);
    }
}

static void check_damping(const struct model *m, const struct material *beam, struct warnings *w)
{
    const double omega = model_first_mode_radps(m);
    double external = m->gamma.value / (2.0 * beam->rho.value * omega);
    if (external > 0.2)
        warn(w, "%s = %g alone damps the first mode by %.0f %% of critical: is it in N·s/m² (per metre of beam)?",
             m->gamma.name, m->gamma.value, external * 100.0);
    for (size_t i = 0; i < m->n_materials; i++) {
        const struct material *material = &m->materials[i];
        double internal = material->cDI.value * omega / (2.0 * material->EI.value);
        if (internal > 0.2)
            warn(w, "%s = %g alone damps the first mode by %.0f %% of critical: is it in N·m²·s?", material->cDI.name,
                 material->cDI.value, internal * 100.0);
    }
}

size_t model_unit_warnings(const struct model *model, model_warning text[], size_t room)
{
    struct warnings w = {text, 0, room};
    const struct material *beam = main_material(model);
    if (!within(model->length_m, 0.005, 20.0))
        warn(&w, "length_m = %g m is far from a laboratory beam (0.005 … 20 m): is it in mm or cm?", model->length_m);
    if (beam)
        check_stiffness_and_mass(model, beam, &w);
    if (beam && w.n == 0) /* else the first mode is not known either */
        check_damping(model, beam, &w);
    return w.n;
}
