/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <complex.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"

#undef I
static const double complex I = (double complex)_Complex_I;

static struct beam_model model;
static struct beam_work work;

static void build(enum beam_basis basis)
{
    const struct beam_description d = case_description(basis);
    assert_int_equal(beam_assemble(&d, &model), BEAM_OK);
}

static void add_memory(double share, double tau_s)
{
    struct beam_memory *memory = &model.memory[model.n_memories++];
    memory->relaxation_s = tau_s;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            memory->form[i][j] = share * model.K[i][j];
}

static void add_damper(double damping_Nspm)
{
    double phi[BEAM_N];
    assert_int_equal(beam_shape(BEAM_BASIS_PATCH, beam_length(), 0, phi), BEAM_OK);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            model.C[i][j] += damping_Nspm * phi[i] * phi[j];
}

/* cᵀ (s²M + sC + K + Σ τs/(1+τs) X)⁻¹ b by Gauss elimination. */
static double complex direct(double complex s, const double c[BEAM_N], const double b[BEAM_N])
{
    double complex q[BEAM_N][BEAM_N], x[BEAM_N], sum = 0;
    for (int i = 0; i < BEAM_N; i++) {
        x[i] = b[i];
        for (int j = 0; j < BEAM_N; j++) {
            q[i][j] = s * s * model.M[i][j] + s * model.C[i][j] + model.K[i][j];
            for (int m = 0; m < model.n_memories; m++) {
                const double complex ts = s * model.memory[m].relaxation_s;
                q[i][j] += ts / (1.0 + ts) * model.memory[m].form[i][j];
            }
        }
    }
    for (int j = 0; j < BEAM_N; j++)
        for (int i = j + 1; i < BEAM_N; i++) {
            const double complex f = q[i][j] / q[j][j];
            for (int k = j; k < BEAM_N; k++)
                q[i][k] -= f * q[j][k];
            x[i] -= f * x[j];
        }
    for (int i = BEAM_N - 1; i >= 0; i--) {
        for (int k = i + 1; k < BEAM_N; k++)
            x[i] -= q[i][k] * x[k];
        x[i] /= q[i][i];
        sum += c[i] * x[i];
    }
    return sum;
}

/* The same from poles and shapes. */
static double complex by_poles(double complex s, const double c[BEAM_N], const double b[BEAM_N])
{
    const struct beam_poles *p = &work.poles;
    double complex sum = 0;
    for (int k = 0; k < p->n_complex + p->n_real; k++) {
        const double complex pole = p->re[k] + I * p->im[k];
        double complex left = 0, right = 0;
        for (int i = 0; i < BEAM_N; i++) {
            left += c[i] * (p->shape_re[k][i] + I * p->shape_im[k][i]);
            right += b[i] * (p->shape_re[k][i] + I * p->shape_im[k][i]);
        }
        sum += p->sign[k] * left * right / (s - pole);
        if (k < p->n_complex)
            sum += conj(left * right) / (s - conj(pole));
    }
    return sum;
}

/* Largest relative difference over the band, on and off the axis, for patch output and both inputs. */
static double transfer_error(void)
{
    double worst = 0.0;
    for (int line = 0; line < 59; line++)
        for (int input = 0; input < 2; input++) {
            const double f = 0.5 * pow(1.17, line);
            const double complex s = 2.0 * acos(-1.0) * f * (I + (input ? 0.1 : 0.0));
            const double complex a = direct(s, model.output[0].vector, model.input[input].vector);
            const double complex b = by_poles(s, model.output[0].vector, model.input[input].vector);
            worst = fmax(worst, cabs(a - b) / cabs(a));
        }
    return worst;
}

static void poles_and_shapes_are_the_transfer_function(void **state)
{
    (void)state;
    for (int basis = 0; basis < 2; basis++) {
        build((enum beam_basis)basis);
        assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
        assert_int_equal(work.poles.n_complex, BEAM_N);
        assert_int_equal(work.poles.n_real, 0);
        assert_true(transfer_error() < 1e-9);
    }
}

static void undamped_poles_lie_on_the_axis_at_the_natural_frequencies(void **state)
{
    (void)state;
    build(BEAM_BASIS_PATCH);
    memset(model.C, 0, sizeof model.C);
    assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
    for (int k = 0; k < BEAM_N; k++) {
        assert_close(work.poles.re[k], 0.0, 1e-14 * work.modes.omega_radps[k]);
        assert_close(work.poles.im[k] / work.modes.omega_radps[k], 1.0, 1e-13);
    }
}

static void damping_far_from_proportional_is_resolved(void **state)
{
    (void)state;
    for (int power = 0; power < 10; power++) { /* through critical: pairs become real and return */
        const double damping = 0.01 * pow(3.0, power);
        build(BEAM_BASIS_PATCH);
        add_damper(damping);
        assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
        assert_int_equal(2 * work.poles.n_complex + work.poles.n_real, 2 * BEAM_N);
        assert_true(transfer_error() < 1e-7);
    }
}

static void memory_adds_real_poles_also_when_they_coincide(void **state)
{
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        build(BEAM_BASIS_PATCH);
        add_memory(kind == 0 ? 0.1 : 1e-6, kind == 2 ? 1e-5 : 5e-3); /* in proportion to K: nearly ten equal poles */
        assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
        assert_int_equal(work.poles.n_complex, BEAM_N);
        assert_int_equal(work.poles.n_real, BEAM_N);
        assert_true(transfer_error() < 1e-8);
    }
}

static void two_branches_and_an_overdamped_pair_together(void **state)
{
    double patch[BEAM_N];
    (void)state;
    build(BEAM_BASIS_PATCH);
    add_damper(30.0);
    add_memory(0.05, 2e-3);
    memcpy(patch, model.output[0].vector, sizeof patch);
    struct beam_memory *second = &model.memory[model.n_memories++];
    second->relaxation_s = 0.02;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            second->form[i][j] = 1e-7 * patch[i] * patch[j]; /* rank one: a patch on a resistor */
    assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
    assert_int_equal(work.n_memory_states, BEAM_N + 1);
    assert_int_equal(2 * work.poles.n_complex + work.poles.n_real, 3 * BEAM_N + 1);
    assert_true(transfer_error() < 1e-7);
}

/* Basis change to (1, x/ℓ, φ₃ …): K of a beam that nothing holds has the two rigid motions in its null space. */
static void a_free_beam_keeps_its_rigid_motions(void **state)
{
    (void)state;
    build(BEAM_BASIS_UNIFORM);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < 2; j++)
            model.K[i][j] = model.K[j][i] = 0.0;
    assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
    assert_true(work.modes.omega_radps[0] == 0.0 && work.modes.omega_radps[1] == 0.0);
    assert_true(work.modes.omega_radps[2] > 1.0);
    assert_int_equal(work.poles.n_real, 4); /* air damping: 0 and −c/m for each */
    assert_true(transfer_error() < 1e-6);
}

static void wrong_models_are_named(void **state)
{
    (void)state;
    build(BEAM_BASIS_PATCH);
    model.M[3][3] = -1.0;
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_MASS);
    build(BEAM_BASIS_PATCH);
    for (int i = 0; i < BEAM_N; i++)
        model.M[9][i] = model.M[i][9] = model.M[8][i] = model.M[i][8]; /* two equal rows: singular */
    model.M[9][9] = model.M[8][9] = model.M[9][8] = model.M[8][8];
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_MASS);
    build(BEAM_BASIS_PATCH);
    model.K[0][0] *= -1.0;
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_STIFFNESS);
    build(BEAM_BASIS_PATCH);
    memset(model.K, 0, sizeof model.K);
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_STIFFNESS);
    build(BEAM_BASIS_PATCH);
    model.K[1][2] *= 1.001;
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_ASYMMETRIC);
    build(BEAM_BASIS_PATCH);
    model.C[4][4] = NAN;
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_NOT_FINITE);
    build(BEAM_BASIS_PATCH);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            model.C[i][j] = -model.C[i][j];
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_UNSTABLE);
    build(BEAM_BASIS_PATCH);
    add_memory(-0.1, 1e-3);
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_MEMORY);
    build(BEAM_BASIS_PATCH);
    add_memory(0.1, 0.0);
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_MEMORY);
    build(BEAM_BASIS_PATCH);
    add_memory(0.1, 1e-3);
    add_memory(0.1, 1e-2); /* 20 internal states */
    assert_int_equal(beam_find_poles(&model, &work), BEAM_ERROR_CAPACITY);
}

static void a_critically_damped_model_is_refused_or_right(void **state)
{
    /* Ĉ = 2 ω_1 on mode 1 only: p = −ω_1 twice with one shape */
    double g[BEAM_N] = {0};
    (void)state;
    build(BEAM_BASIS_PATCH);
    assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            g[i] += model.M[i][j] * work.modes.shape[j][0];
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            model.C[i][j] = 2.0 * work.modes.omega_radps[0] * g[i] * g[j];
    const enum beam_status status = beam_find_poles(&model, &work);
    if (status == BEAM_OK)
        assert_true(transfer_error() < 1e-5);
    else
        assert_int_equal(status, BEAM_ERROR_DEFECTIVE);
}

static void float_finds_the_same_frequencies(void **state)
{
    double f[BEAM_N];
    int n_real = -1;
    (void)state;
    for (int basis = 0; basis < 2; basis++) {
        build((enum beam_basis)basis);
        assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
        assert_int_equal(shadow_poles(basis, 0.0, 1.0, f, &n_real), BEAM_OK);
        assert_int_equal(n_real, 0);
        for (int k = 0; k < BEAM_N; k++)
            assert_close(f[k] * 2.0 * acos(-1.0) / hypot(work.poles.re[k], work.poles.im[k]), 1.0, 2e-4);
        add_memory(0.1, 5e-3);
        assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
        assert_int_equal(shadow_poles(basis, 0.1, 5e-3, f, &n_real), BEAM_OK);
        assert_int_equal(n_real, BEAM_N);
        for (int k = 0; k < BEAM_N; k++)
            assert_close(f[k] * 2.0 * acos(-1.0) / hypot(work.poles.re[k], work.poles.im[k]), 1.0, 2e-4);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(poles_and_shapes_are_the_transfer_function),
        cmocka_unit_test(undamped_poles_lie_on_the_axis_at_the_natural_frequencies),
        cmocka_unit_test(damping_far_from_proportional_is_resolved),
        cmocka_unit_test(memory_adds_real_poles_also_when_they_coincide),
        cmocka_unit_test(two_branches_and_an_overdamped_pair_together),
        cmocka_unit_test(a_free_beam_keeps_its_rigid_motions),
        cmocka_unit_test(wrong_models_are_named),
        cmocka_unit_test(a_critically_damped_model_is_refused_or_right),
        cmocka_unit_test(float_finds_the_same_frequencies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
