/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Finite-element matrices with the linear effects in them, normal modes, projections on the modes. */
#include "truth_internal.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

double *truth_array(size_t n)
{
    double *x = calloc(n ? n : 1, sizeof *x);
    if (!x) {
        fprintf(stderr, "truth: out of memory\n");
        exit(4);
    }
    return x;
}

int truth_fail(char message[TRUTH_MESSAGE], const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, TRUTH_MESSAGE, format, arguments);
    va_end(arguments);
    return -1;
}

/* matrix += value row rowᵀ */
static void add_point(const struct truth_assembly *fe, double at_m, int derivative, double value, double *matrix)
{
    double *row = truth_array(fe->n);
    truth_mesh_row(&fe->mesh, at_m, derivative, row);
    for (size_t i = 0; i < fe->n; i++)
        for (size_t j = 0; row[i] != 0 && j < fe->n; j++)
            matrix[i * fe->n + j] += value * row[i] * row[j];
    free(row);
}

static void add_effect(struct truth_assembly *fe, const struct truth_spec *spec, const struct truth_effect *effect)
{
    /* first-order shear correction of the rotary term: 1 + E/(k G), aluminium, rectangular section */
    const double shear = 1 + 2 * (1 + 0.33) * 6 / 5;
    const double *p = effect->parameter;
    double at_m = spec->length_m;
    truth_effect_place(spec, effect, &at_m);
    switch (effect->kind) {
    case TRUTH_TIP_MASS:
    case TRUTH_POINT_MASS:
        add_point(fe, at_m, 0, p[0], fe->M);
        break;
    case TRUTH_ROOT_COMPLIANCE:
        if (p[0] > 0) {
            add_point(fe, 0, 1, 1 / p[0], fe->K);
            add_point(fe, 0, 1, p[1] / p[0], fe->C);
            add_point(fe, 0, 1, 1 / (p[0] * pow(2 * TRUTH_PI * p[2], 2)), fe->M); /* a support that rocks */
        }
        break;
    case TRUTH_POINT_SPRING:
        add_point(fe, at_m, 0, p[0], fe->K);
        add_point(fe, at_m, 0, p[1], fe->C);
        break;
    case TRUTH_POINT_DAMPER:
        add_point(fe, at_m, 0, p[0], fe->C);
        break;
    case TRUTH_AXIAL_LOAD:
        truth_mesh_integrate(&fe->mesh, 1, NULL, p[0], fe->K);
        break;
    case TRUTH_ROTARY_INERTIA:
        truth_mesh_integrate(&fe->mesh, 1, fe->mesh.rho_gyration2, p[0] * shear, fe->M);
        break;
    case TRUTH_SQUARE_ROOT_DAMPING:
        truth_mesh_integrate(&fe->mesh, 1, NULL, p[0], fe->C);
        break;
    default:
        break;
    }
}

static void apply_supports(const struct truth_spec *spec, struct truth_assembly *fe)
{
    size_t last = fe->n - 2;
    const struct truth_effect *root = truth_effect_find(spec, TRUTH_ROOT_COMPLIANCE);
    fe->fixed = calloc(fe->n, sizeof *fe->fixed);
    if (!fe->fixed)
        abort();
    if (spec->support != TRUTH_FREE_FREE)
        fe->fixed[0] = true;
    if (spec->support == TRUTH_CLAMPED_FREE || spec->support == TRUTH_CLAMPED_CLAMPED)
        fe->fixed[1] = !(root && root->parameter[0] > 0);
    if (spec->support == TRUTH_CLAMPED_CLAMPED || spec->support == TRUTH_PINNED_PINNED)
        fe->fixed[last] = true;
    if (spec->support == TRUTH_CLAMPED_CLAMPED)
        fe->fixed[last + 1] = true;
    for (size_t i = 0; i < fe->n; i++)
        fe->kept += fe->fixed[i] ? 0 : 1;
}

/* Φᵀ X Φ, [n_modes²] */
double *truth_assembly_project(const struct truth_assembly *fe, const double *X)
{
    size_t n = fe->n, m = fe->n_modes;
    double *half = truth_array(n * m), *modal = truth_array(m * m);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            for (size_t a = 0; X[i * n + j] != 0 && a < m; a++)
                half[i * m + a] += X[i * n + j] * fe->shape[j * m + a];
    for (size_t i = 0; i < n; i++)
        for (size_t a = 0; a < m; a++)
            for (size_t b = 0; b < m; b++)
                modal[a * m + b] += fe->shape[i * m + a] * half[i * m + b];
    free(half);
    return modal;
}

double *truth_assembly_integral(const struct truth_assembly *fe, int derivative, const double *weight)
{
    double *full = truth_array(fe->n * fe->n);
    truth_mesh_integrate(&fe->mesh, derivative, weight, 1, full);
    double *modal = truth_assembly_project(fe, full);
    free(full);
    return modal;
}

/* out [n_modes] += factor φ^(d)(x) */
void truth_assembly_row(const struct truth_assembly *fe, double x_m, int derivative, double factor, double *out)
{
    double *row = truth_array(fe->n);
    truth_mesh_row(&fe->mesh, x_m, derivative, row);
    for (size_t i = 0; i < fe->n; i++)
        for (size_t a = 0; row[i] != 0 && a < fe->n_modes; a++)
            out[a] += factor * row[i] * fe->shape[i * fe->n_modes + a];
    free(row);
}

void truth_assembly_slope_difference(const struct truth_assembly *fe, double from_m, double to_m, double factor,
                                     double *out)
{
    truth_assembly_row(fe, to_m, 1, factor, out);
    truth_assembly_row(fe, from_m, 1, -factor, out);
}

/* Effects that move the geometry; everything after works on the moved copy. */
static void move_geometry(struct truth_spec *spec)
{
    const struct truth_effect *patch = truth_effect_find(spec, TRUTH_PATCH_POSITION);
    const struct truth_effect *blow = truth_effect_find(spec, TRUTH_INPUT_POSITION);
    if (patch && spec->n_regions > 1) {
        spec->region[1].from_m += patch->parameter[0];
        spec->region[1].to_m += patch->parameter[0];
    }
    for (size_t i = 0; blow && i < spec->n_inputs; i++)
        if (spec->input[i].kind == TRUTH_POINT_FORCE)
            spec->input[i].at_m += blow->parameter[0];
}

int truth_assembly_make(struct truth_spec *spec, struct truth_assembly *fe, double omega_radps[TRUTH_MODES],
                        char message[TRUTH_MESSAGE])
{
    *fe = (struct truth_assembly){0};
    move_geometry(spec);
    truth_mesh_make(spec, &fe->mesh);
    fe->n = fe->mesh.n_dof;
    fe->M = truth_array(fe->n * fe->n);
    fe->C = truth_array(fe->n * fe->n);
    fe->K = truth_array(fe->n * fe->n);
    truth_mesh_integrate(&fe->mesh, 0, fe->mesh.rho, 1, fe->M);
    truth_mesh_integrate(&fe->mesh, 0, NULL, spec->gamma_sNpm2, fe->C);
    truth_mesh_integrate(&fe->mesh, 2, fe->mesh.cDI, 1, fe->C);
    truth_mesh_integrate(&fe->mesh, 2, fe->mesh.EI, 1, fe->K);
    for (size_t i = 0; i < spec->n_effects; i++)
        add_effect(fe, spec, &spec->effect[i]);
    apply_supports(spec, fe);
    if (fe->kept < spec->modes)
        return truth_fail(message, "%zu modes from %zu unknowns: ask for fewer modes or more elements", spec->modes,
                          fe->kept);
    return truth_basis_make(fe, spec, omega_radps, message);
}

void truth_assembly_free(struct truth_assembly *fe)
{
    truth_mesh_free(&fe->mesh);
    free(fe->M);
    free(fe->C);
    free(fe->K);
    free(fe->fixed);
    free(fe->shape);
}
