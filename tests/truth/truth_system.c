/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From a spec to ẋ = A x + B u + laws, and y from x. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Internal states of one effect. */
static size_t states_of(const struct truth_effect *effect, size_t n_modes)
{
    switch (effect->kind) {
    case TRUTH_VISCOELASTIC:
    case TRUTH_ELECTRICAL_COUPLING:
        return n_modes;
    case TRUTH_ATTACHED_RESONATOR:
        return 2;
    case TRUTH_MICROSLIP:
        return 1;
    default:
        return 0;
    }
}

/* ṗ = s v, v̇ = −(ω²/s) p − C v */
static void fill_oscillators(struct truth_system *s)
{
    size_t n = s->n_modes, N = s->n_states;
    for (size_t i = 0; i < n; i++) {
        s->A[i * N + n + i] = s->scale[i];
        s->A[(n + i) * N + i] = -s->omega[i] * s->omega[i] / s->scale[i];
        for (size_t j = 0; j < n; j++)
            s->A[(n + i) * N + n + j] = -s->damping[i * n + j];
    }
}

/* ζ = s z: ζ̇ = s v − ζ/τ, v̇ −= E1 ⟨φ'', φ''⟩ z, over the whole span or the patch */
static void fill_maxwell(struct truth_system *s, const struct truth_assembly *fe, const double *weight, double strength,
                         double tau_s, size_t first)
{
    size_t n = s->n_modes, N = s->n_states;
    double *K1 = truth_assembly_integral(fe, 2, weight);
    for (size_t i = 0; i < n; i++) {
        s->A[(first + i) * N + n + i] = s->scale[i];
        s->A[(first + i) * N + first + i] = -1 / tau_s;
        for (size_t j = 0; j < n; j++)
            s->A[(n + i) * N + first + j] -= strength * K1[i * n + j] / s->scale[j];
    }
    free(K1);
}

/* m r̈ = k (y − r) + d (ẏ − ṙ) =: F, −F on the beam; states Ω r, ṙ */
static void fill_absorber(struct truth_system *s, const struct truth_assembly *fe, const double p[], double at_m,
                          size_t first)
{
    size_t n = s->n_modes, N = s->n_states, r = first, rd = first + 1;
    double w = 2 * TRUTH_PI * p[1], mass = p[0], k = mass * w * w, d = 2 * p[2] * mass * w;
    double *row = truth_array(n);
    truth_assembly_row(fe, at_m, 0, 1, row);
    s->A[r * N + rd] = w;
    s->A[rd * N + r] = -w;
    s->A[rd * N + rd] = -2 * p[2] * w;
    s->B[rd * s->n_inputs + s->n_inputs - 1] = -1; /* it rides on the shaken clamp too */
    for (size_t j = 0; j < n; j++) {
        s->A[rd * N + j] = w * w * row[j] / s->scale[j];
        s->A[rd * N + n + j] = 2 * p[2] * w * row[j];
        s->A[(n + j) * N + r] += row[j] * k / w;
        s->A[(n + j) * N + rd] += row[j] * d;
        for (size_t i = 0; i < n; i++) {
            s->A[(n + i) * N + j] -= row[i] * k * row[j] / s->scale[j];
            s->A[(n + i) * N + n + j] -= row[i] * d * row[j];
        }
    }
    free(row);
}

static void add_law(struct truth_system *s, const struct truth_spec *spec, const struct truth_effect *effect,
                    const struct truth_assembly *fe, size_t state)
{
    struct truth_law *law = &s->law[s->n_laws++];
    const struct truth_mesh *mesh = &fe->mesh;
    double at_m = spec->length_m;
    truth_effect_place(spec, effect, &at_m);
    *law = (struct truth_law){.kind = (enum truth_effect_kind)effect->kind, .state = state};
    law->row = truth_array(s->n_modes);
    memcpy(law->p, effect->parameter, sizeof law->p);
    switch (effect->kind) {
    case TRUTH_PATCH_SOFTENING:
    case TRUTH_COULOMB_FRICTION:
    case TRUTH_MICROSLIP:
        truth_assembly_slope_difference(fe, mesh->patch_from_m, mesh->patch_to_m, 1, law->row);
        break;
    case TRUTH_BILINEAR_STIFFNESS:
        truth_assembly_slope_difference(fe, fmax(at_m - effect->parameter[2] / 2, 0),
                                        fmin(at_m + effect->parameter[2] / 2, spec->length_m), 1, law->row);
        break;
    default:
        truth_assembly_row(fe, at_m, 0, 1, law->row);
    }
}

/* Two Gauss points an element, with φ, φ', φ'' of every mode. */
static void fill_quadrature(struct truth_system *s, const struct truth_assembly *fe)
{
    const struct truth_mesh *mesh = &fe->mesh;
    size_t n = s->n_modes;
    s->n_points = 2 * mesh->n_elements;
    s->weight = truth_array(s->n_points);
    s->EI_point = truth_array(s->n_points);
    s->rho_point = truth_array(s->n_points);
    s->Y = truth_array(s->n_points * n);
    s->dY = truth_array(s->n_points * n);
    s->ddY = truth_array(s->n_points * n);
    for (size_t k = 0; k < s->n_points; k++) {
        size_t e = k / 2;
        double h = mesh->x_m[e + 1] - mesh->x_m[e];
        double x = mesh->x_m[e] + h * (k % 2 ? 0.5 + 0.5 / sqrt(3) : 0.5 - 0.5 / sqrt(3));
        s->weight[k] = h / 2;
        s->EI_point[k] = mesh->EI[e];
        s->rho_point[k] = mesh->rho[e];
        truth_assembly_row(fe, x, 0, 1, s->Y + k * n);
        truth_assembly_row(fe, x, 1, 1, s->dY + k * n);
        truth_assembly_row(fe, x, 2, 1, s->ddY + k * n);
    }
}

/* −⟨ρ, φ⟩ − Σ m φ(a): what an accelerating clamp does to the relative motion. */
static void fill_base(struct truth_system *s, const struct truth_spec *spec, const struct truth_assembly *fe)
{
    double *ones = truth_array(fe->n), *load = truth_array(fe->n);
    for (size_t i = 0; i < fe->n; i += 2)
        ones[i] = 1; /* y = 1, y' = 0 at every node is the rigid translation */
    truth_multiply_add(fe->n, fe->n, fe->M, ones, load);
    for (size_t i = 0; i < fe->n; i++)
        for (size_t j = 0; j < s->n_modes; j++)
            s->in_base[j] -= load[i] * fe->shape[i * s->n_modes + j];
    for (size_t e = 0; e < spec->n_effects; e++) {
        const struct truth_effect *effect = &spec->effect[e];
        if (effect->kind == TRUTH_BASE_MOTION) {
            s->base_amplitude_mps2 = effect->parameter[0];
            s->base_phase_rad = effect->parameter[1];
            s->base_radps = 2 * TRUTH_PI * effect->parameter[2];
        }
    }
    free(ones);
    free(load);
}

static void fill_effects(struct truth_system *s, const struct truth_spec *spec, const struct truth_assembly *fe)
{
    size_t first = 2 * s->n_modes;
    for (size_t e = 0; e < spec->n_effects; e++) {
        const struct truth_effect *effect = &spec->effect[e];
        const double *p = effect->parameter;
        double at_m = spec->length_m;
        truth_effect_place(spec, effect, &at_m);
        switch (effect->kind) {
        case TRUTH_VISCOELASTIC:
            fill_maxwell(s, fe, NULL, p[0], p[1], first);
            break;
        case TRUTH_ELECTRICAL_COUPLING:
            fill_maxwell(s, fe, fe->mesh.in_patch, p[0], p[1], first);
            break;
        case TRUTH_ATTACHED_RESONATOR:
            fill_absorber(s, fe, p, at_m, first);
            break;
        case TRUTH_QUADRATIC_DRAG:
            s->drag += p[0];
            s->drag_power = p[1];
            break;
        case TRUTH_LARGE_ROTATION:
            s->rotation += p[0];
            break;
        case TRUTH_THERMAL_DRIFT:
            s->drift_ps += p[0];
            s->settling_s = p[1];
            break;
        case TRUTH_STIFFNESS_STEP:
            s->step = p[0];
            s->step_at_s = p[1];
            break;
        case TRUTH_CUBIC_STIFFNESS:
        case TRUTH_PATCH_SOFTENING:
        case TRUTH_COULOMB_FRICTION:
        case TRUTH_MICROSLIP:
        case TRUTH_BILINEAR_STIFFNESS:
        case TRUTH_STOP_CONTACT:
        case TRUTH_QUINTIC_SPRING:
        case TRUTH_TIP_MAGNET:
        case TRUTH_DELAYED_FEEDBACK:
            add_law(s, spec, effect, fe, first);
            break;
        default:
            break;
        }
        first += states_of(effect, s->n_modes);
    }
}

static void fill_ports(struct truth_system *s, const struct truth_spec *spec, const struct truth_assembly *fe)
{
    size_t n = s->n_modes;
    double *row = truth_array(n);
    for (size_t k = 0; k < spec->n_inputs; k++) {
        memset(row, 0, n * sizeof *row);
        if (spec->input[k].kind == TRUTH_POINT_FORCE)
            truth_assembly_row(fe, spec->input[k].at_m, 0, 1, row);
        else
            truth_assembly_slope_difference(fe, fe->mesh.patch_from_m, fe->mesh.patch_to_m, spec->KB_NmpV, row);
        for (size_t j = 0; j < n; j++)
            s->B[(n + j) * s->n_inputs + k] = row[j];
    }
    for (size_t j = 0; j < n; j++)
        s->B[(n + j) * s->n_inputs + spec->n_inputs] = s->in_base[j];
    for (size_t k = 0; k < spec->n_outputs; k++) {
        s->output[k].kind = spec->output[k].kind;
        s->output[k].row = truth_array(n);
        if (spec->output[k].kind == TRUTH_PATCH_STRAIN)
            truth_assembly_slope_difference(fe, fe->mesh.patch_from_m, fe->mesh.patch_to_m, spec->Ks_V,
                                            s->output[k].row);
        else
            truth_assembly_row(fe, spec->output[k].at_m, 0, 1, s->output[k].row);
    }
    free(row);
}

static void fill_damping(struct truth_system *s, const struct truth_spec *spec, const struct truth_assembly *fe)
{
    s->damping = truth_assembly_project(fe, fe->C);
    for (size_t e = 0; e < spec->n_effects; e++)
        if (spec->effect[e].kind == TRUTH_HYSTERETIC_DAMPING)
            for (size_t j = 0; j < s->n_modes; j++)
                s->damping[j * s->n_modes + j] += spec->effect[e].parameter[0] * s->omega[j];
}

static void allocate(struct truth_system *s, const struct truth_spec *spec, size_t n_modes)
{
    s->n_modes = n_modes;
    s->n_states = 2 * n_modes;
    for (size_t e = 0; e < spec->n_effects; e++)
        s->n_states += states_of(&spec->effect[e], n_modes);
    s->scale = truth_array(n_modes);
    s->in_base = truth_array(n_modes);
    s->A = truth_array(s->n_states * s->n_states);
    s->B = truth_array(s->n_states * s->n_inputs);
    for (size_t j = 0; j < n_modes; j++)
        s->scale[j] = fmax(s->omega[j], 1);
}

int truth_system_make(const struct truth_spec *original, struct truth_system *s, char message[TRUTH_MESSAGE])
{
    struct truth_spec spec = *original;
    struct truth_assembly fe;
    *s = (struct truth_system){.n_inputs = spec.n_inputs + 1, .n_outputs = spec.n_outputs};
    s->omega = truth_array(TRUTH_MODES);
    int status = truth_assembly_make(&spec, &fe, s->omega, message);
    if (status == 0) {
        allocate(s, &spec, fe.n_modes);
        fill_damping(s, &spec, &fe);
        fill_oscillators(s);
        fill_effects(s, &spec, &fe);
        fill_base(s, &spec, &fe);
        fill_ports(s, &spec, &fe);
        if (s->drift_ps != 0 || s->step != 0)
            s->K_bending = truth_assembly_integral(&fe, 2, fe.mesh.EI);
        if (s->drag != 0 || s->rotation != 0)
            fill_quadrature(s, &fe);
    }
    truth_assembly_free(&fe);
    return status;
}

void truth_system_free(struct truth_system *s)
{
    double *owned[] = {s->omega,  s->scale,    s->A,         s->B, s->damping, s->in_base, s->K_bending,
                       s->weight, s->EI_point, s->rho_point, s->Y, s->dY,      s->ddY};
    for (size_t i = 0; i < sizeof owned / sizeof owned[0]; i++)
        free(owned[i]);
    for (size_t k = 0; k < s->n_outputs; k++)
        free(s->output[k].row);
    for (size_t k = 0; k < s->n_laws; k++)
        free(s->law[k].row);
    *s = (struct truth_system){0};
}

void truth_system_observe(const struct truth_system *s, double t_s, const double *x, const double *xdot, double *y)
{
    size_t n = s->n_modes;
    double phase = s->base_radps * t_s + s->base_phase_rad;
    double base = t_s >= 0 ? s->base_amplitude_mps2 : 0;
    for (size_t k = 0; k < s->n_outputs; k++) {
        const double *row = s->output[k].row;
        double sum = 0;
        switch (s->output[k].kind) {
        case TRUTH_ACCELERATION:
            for (size_t j = 0; j < n; j++)
                sum += row[j] * xdot[n + j];
            sum += base * sin(phase);
            break;
        case TRUTH_VELOCITY:
            for (size_t j = 0; j < n; j++)
                sum += row[j] * x[n + j];
            sum -= base > 0 ? base / s->base_radps * cos(phase) : 0;
            break;
        default:
            for (size_t j = 0; j < n; j++)
                sum += row[j] * x[j] / s->scale[j];
            if (s->output[k].kind == TRUTH_DISPLACEMENT)
                sum -= base > 0 ? base / (s->base_radps * s->base_radps) * sin(phase) : 0;
        }
        y[k] = sum;
    }
}
