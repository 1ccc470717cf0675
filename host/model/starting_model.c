/* SPDX-License-Identifier: GPL-3.0-or-later */
/* starting_model.c — the text of a commented model file from a ruler and a handbook. */
#include "laminate.h"

#include <stdio.h>
#include <stdlib.h>

#include "ground/ground.h"

/* Young's modulus and density of common beams, rounded; laminates and woods vary by tens of per cent. */
const struct handbook_material handbook_materials[] = {
    {"aluminium", 70e9, 2700.0}, {"steel", 205e9, 7850.0},    {"stainless", 193e9, 8000.0}, {"brass", 100e9, 8500.0},
    {"copper", 120e9, 8930.0},   {"titanium", 110e9, 4500.0}, {"glass", 70e9, 2500.0},      {"acrylic", 3.0e9, 1190.0},
    {"abs", 2.2e9, 1040.0},      {"carbon", 70e9, 1550.0},    {"fibreglass", 20e9, 1900.0}, {"spruce", 11e9, 430.0},
    {"pzt", 63e9, 7750.0},
};
const size_t handbook_materials_count = sizeof handbook_materials / sizeof *handbook_materials;

enum { COMMENT_COLUMN = 50 };

static void print_line(FILE *f, const char *left, const char *comment)
{
    (void)fprintf(f, "%-*s # %s\n", COMMENT_COLUMN, left, comment);
}

/* Four digits are more than a handbook knows. */
static void print_value(FILE *f, const char *name, double value, const char *more, const char *comment)
{
    char number[DECIMAL_TEXT], line[160];
    decimal_print_rounded(number, value, 4);
    (void)snprintf(line, sizeof line, "  %s: {value: %s%s}", name, number, more);
    print_line(f, line, comment);
}

/* One patch by the shorthand, several as pieces of one name. */
static void print_patches(FILE *f, const struct starting_beam *b)
{
    char line[160], from[DECIMAL_TEXT], to[DECIMAL_TEXT];
    if (b->n_patches > 1)
        print_line(f, "  regions:", "pieces of one name are alike: they share EI, rho, cDI");
    for (size_t i = 0; i < b->n_patches; i++) {
        decimal_print(from, b->patch_m[i][0]);
        decimal_print(to, b->patch_m[i][1]);
        if (b->n_patches == 1)
            (void)snprintf(line, sizeof line, "  patch_m: [%s, %s]", from, to);
        else
            (void)snprintf(line, sizeof line, "    - {name: patch, from_m: %s, to_m: %s}", from, to);
        print_line(f, line, "where the piezo patch begins and ends, m from the clamp");
    }
}

static void print_beam(FILE *f, const struct starting_beam *b)
{
    char line[160], number[DECIMAL_TEXT];
    (void)fputs(
        "# A model for beamfit, begun by `beamfit init`. Everything is in SI units: m, kg, s, N, V, rad.\n"
        "# What is free below is what `beamfit fit` estimates; {fixed: true} holds a value, {prior: 0.03} says how\n"
        "# well it is known (relative standard deviation), min and max bound it.\n"
        "format: beamfit-model/1\n"
        "beam:\n",
        f);
    decimal_print(number, b->length_m);
    (void)snprintf(line, sizeof line, "  length_m: %s", number);
    print_line(f, line, "free length from the edge of the clamp, m");
    (void)snprintf(line, sizeof line, "  support: %s", model_support_name(b->support));
    print_line(f, line, "clamped-free, clamped-clamped, pinned-pinned, free-free");
    print_patches(f, b);
}

static void print_region(FILE *f, const struct starting_beam *b, const char *region, int sides)
{
    char name[MODEL_NAME], comment[160];
    bool weighed = b->mass_kg > 0.0;
    double EI = laminate_EI(&b->beam, &b->patch, sides), rho = laminate_rho(&b->beam, &b->patch, sides);
    if (weighed)
        rho += b->mass_kg / b->length_m - laminate_rho(&b->beam, &b->patch, 0);
    (void)snprintf(name, sizeof name, "EI_%s_Nm2", region);
    (void)snprintf(comment, sizeof comment, "bending stiffness, N·m²; before a fit: %s, %s",
                   sides ? b->patch_material : b->beam_material,
                   sides == 2   ? "on both faces, without glue (eq. 30)"
                   : sides == 1 ? "on one face, without glue"
                                : "E w t³/12");
    print_value(f, name, EI, sides ? "" : ", prior: 0.1", comment);
    (void)snprintf(name, sizeof name, "rho_%s_kgpm", region);
    print_value(f, name, rho,
                sides     ? ""
                : weighed ? ", prior: 0.01"
                          : ", prior: 0.05",
                sides     ? "mass per length, kg/m; before a fit: without glue (eq. 31)"
                : weighed ? "mass per length, kg/m; before a fit: weighed"
                          : "mass per length, kg/m; before a fit: from the density (weigh it)");
    (void)snprintf(name, sizeof name, "cDI_%s_sNm2", region);
    print_value(f, name, 1.7e-5 * EI, "", "internal damping, N·m²·s; before a fit: as in metals");
}

static void print_parameters(FILE *f, const struct starting_beam *b)
{
    (void)fputs("parameters:\n", f);
    print_region(f, b, "beam", 0);
    if (b->n_patches > 0)
        print_region(f, b, "patch", b->patch_sides);
    print_value(f, "gamma_sNpm2", 0.09 * b->beam.width_m, "",
                "air damping, N·s/m per metre of beam; before a fit: typical");
    bool senses = false, drives = false;
    for (size_t i = 0; i < b->n_outputs; i++)
        senses = senses || b->outputs[i].kind == OUTPUT_PATCH_STRAIN;
    for (size_t i = 0; i < b->n_inputs; i++)
        drives = drives || b->inputs[i].kind == INPUT_PATCH_MOMENT;
    if (senses)
        print_value(f, "Ks_V", 50.0, "", "patch as sensor, volt per rad of slope difference; before a fit: typical");
    if (drives)
        print_value(f, "KB_NmpV", 0.01, "", "patch as actuator, N·m per volt; before a fit: typical");
}

/* place: ", at_m: 0.3", ", patch_m: [0.1, 0.2]" or "". */
static void print_channel(FILE *f, const char *name, const char *kind, const char *place, const char *comment)
{
    char line[256];
    (void)snprintf(line, sizeof line, "  %s: {kind: %s%s}", name, kind, place);
    print_line(f, line, comment);
}

enum { PLACE_TEXT = 2 * DECIMAL_TEXT + 20 };

static void point_text(double at_m, char text[PLACE_TEXT])
{
    char at[DECIMAL_TEXT];
    decimal_print(at, at_m);
    (void)snprintf(text, PLACE_TEXT, ", at_m: %s", at);
}

/* Of an only patch nothing need be said. */
static void patch_text(const struct starting_beam *b, double from_m, double to_m, char text[PLACE_TEXT])
{
    char from[DECIMAL_TEXT], to[DECIMAL_TEXT];
    decimal_print(from, from_m);
    decimal_print(to, to_m);
    text[0] = '\0';
    if (b->n_patches > 1)
        (void)snprintf(text, PLACE_TEXT, ", patch_m: [%s, %s]", from, to);
}

static void print_channels(FILE *f, const struct starting_beam *b)
{
    char place[PLACE_TEXT];
    static const char *const inputs[] = {"N, at this distance from the clamp, m", "V on the patch"};
    static const char *const outputs[] = {"m, at this distance from the clamp, m", "m/s", "m/s²", "V of the patch"};
    print_line(f, b->n_inputs ? "inputs:" : "inputs: {}", b->n_inputs ? "each name is a column of the record" : "none");
    for (size_t i = 0; i < b->n_inputs; i++) {
        const struct model_input *input = &b->inputs[i];
        if (input->kind == INPUT_POINT_FORCE)
            point_text(input->at_m, place);
        else
            patch_text(b, input->from_m, input->to_m, place);
        print_channel(f, input->name, model_input_kind_name(input->kind), place, inputs[input->kind]);
    }
    print_line(f, b->n_outputs ? "outputs:" : "outputs: {}", b->n_outputs ? "likewise" : "none");
    for (size_t i = 0; i < b->n_outputs; i++) {
        const struct model_output *output = &b->outputs[i];
        if (output->kind != OUTPUT_PATCH_STRAIN)
            point_text(output->at_m, place);
        else
            patch_text(b, output->from_m, output->to_m, place);
        print_channel(f, output->name, model_output_kind_name(output->kind), place, outputs[output->kind]);
    }
    print_line(f, "effects: []", "`beamfit effects` lists them, `beamfit add` puts them here");
}

/* For a beam that a controller can drive and sense: what `beamfit export` will ask for. */
static void print_board(FILE *f, const struct starting_beam *b)
{
    const char *sensor = NULL, *drive = NULL;
    for (size_t i = 0; i < b->n_inputs; i++)
        drive = b->inputs[i].kind == INPUT_PATCH_MOMENT ? b->inputs[i].name : drive;
    for (size_t i = 0; i < b->n_outputs; i++)
        sensor = b->outputs[i].kind == OUTPUT_PATCH_STRAIN ? b->outputs[i].name : sensor;
    if (!sensor || !drive)
        return;
    (void)fprintf(f,
                  "# A controller that is to run the model (beamfit export); take the # away and write its numbers:\n"
                  "#board:\n"
                  "#  sample_Hz: 1000\n"
                  "#  sensor: {output: %s, per_code: 0.001, zero_code: 2048}  # A/D: value = (code - zero_code) x "
                  "per_code\n"
                  "#  drive: {input: %s, per_code: 0.02, zero_code: 2048}     # D/A\n"
                  "#  alarm_ratio: 3                                          # residual rms over the noise's\n"
                  "#  clear_ratio: 2\n"
                  "#  averaging_s: 1\n",
                  sensor, drive);
}

char *starting_model_text(const struct starting_beam *beam)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    if (!f)
        return bf_strdup("");
    print_beam(f, beam);
    print_parameters(f, beam);
    print_channels(f, beam);
    print_board(f, beam);
    (void)fclose(f);
    return text;
}
