/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"
#include "beam_tables.h"

static const double exact_Hz[5] = {6.64605, 38.36154, 95.51843, 178.74231, 305.19956};

static void frequencies(const struct beam_model *model, double out_Hz[BEAM_N])
{
    struct beam_modes modes;
    assert_int_equal(beam_find_modes(model, &modes), BEAM_OK);
    for (int j = 0; j < BEAM_N; j++)
        out_Hz[j] = modes.omega_radps[j] / (2.0 * acos(-1.0));
}

static void both_bases_have_the_frequencies_of_the_paper_s_beam(void **state)
{
    /* relative errors against the exact stepped beam, as stated in beam.h and docs/library.md */
    const double error[2][4] = {{0.0051, 0.0030, 0.0042, 0.0040}, {8e-6, 2.6e-4, 1.93e-3, 8.4e-3}};
    const double digits[2][4] = {{1e-4, 1e-4, 1e-4, 1e-4}, {1e-6, 1e-5, 1e-5, 1e-4}};
    (void)state;
    for (int basis = 0; basis < 2; basis++) {
        struct beam_description d = case_description((enum beam_basis)basis);
        struct beam_model model;
        double f[BEAM_N];
        assert_int_equal(beam_assemble(&d, &model), BEAM_OK);
        frequencies(&model, f);
        for (int j = 0; j < 4; j++)
            assert_close(f[j] / exact_Hz[j] - 1.0, error[basis][j], digits[basis][j]);
        for (int j = 0; j < 5; j++)
            assert_true(f[j] > exact_Hz[j]); /* Galerkin: from above */
    }
}

static void a_uniform_cantilever_has_the_textbook_frequencies(void **state)
{
    const double beta[4] = {1.875104068711961, 4.694091132974175, 7.854757438237613, 10.995540734875467};
    struct beam_description d = case_description(BEAM_BASIS_UNIFORM);
    struct beam_model model;
    double f[BEAM_N];
    (void)state;
    d.parameters.EI_patch_Nm2 = d.parameters.EI_beam_Nm2;
    d.parameters.rho_patch_kgpm = d.parameters.rho_beam_kgpm;
    assert_int_equal(beam_assemble(&d, &model), BEAM_OK);
    frequencies(&model, f);
    for (int j = 0; j < 4; j++) {
        const double exact = pow(beta[j] / beam_length(), 2.0) *
                             sqrt(d.parameters.EI_beam_Nm2 / d.parameters.rho_beam_kgpm) / (2.0 * acos(-1.0));
        /* cubic splines of width h: (βh/ℓ)⁴/1440 (Strang and Fix, An Analysis of the Finite Element Method) */
        const double known = pow(beta[j] / 9.0, 4.0) / 1440.0;
        assert_close(f[j] / exact - 1.0, known, (j < 2 ? 0.2 : 1.0) * known);
    }
}

static void shapes_meet_the_clamp_and_their_own_derivatives(void **state)
{
    (void)state;
    for (int basis = 0; basis < 2; basis++) {
        const enum beam_basis b = (enum beam_basis)basis;
        double phi[BEAM_N], slope[BEAM_N], left[BEAM_N], right[BEAM_N];
        assert_int_equal(beam_shape(b, 0.0, 0, phi), BEAM_OK);
        assert_int_equal(beam_shape(b, 0.0, 1, slope), BEAM_OK);
        for (int i = 0; i < BEAM_N; i++)
            assert_true(phi[i] == 0.0 && slope[i] == 0.0);
        for (int place = 0; place < 64; place++)
            for (int derivative = 0; derivative < 2; derivative++) {
                const double h = 1e-6, x = 0.0013 + 0.0071 * place;
                assert_int_equal(beam_shape(b, x, derivative + 1, slope), BEAM_OK);
                assert_int_equal(beam_shape(b, x - h, derivative, left), BEAM_OK);
                assert_int_equal(beam_shape(b, x + h, derivative, right), BEAM_OK);
                for (int i = 0; i < BEAM_N; i++)
                    assert_close((right[i] - left[i]) / (2 * h), slope[i], 2e-2 * (derivative ? 5.0 : 1e-3) + 1e-4);
            }
        assert_int_equal(beam_shape(b, beam_length(), 0, phi), BEAM_OK);
        assert_close(phi[BEAM_N - 1], 1.0, 1e-14); /* the last spline alone holds the free end */
    }
}

static void curvature_may_jump_at_the_patch_edges_only_in_the_patch_basis(void **state)
{
    const double edge = 0.02535, h = 1e-9;
    (void)state;
    for (int basis = 0; basis < 2; basis++) {
        double left[BEAM_N], right[BEAM_N], jump = 0.0, kink = 0.0;
        for (int derivative = 1; derivative < 3; derivative++) {
            assert_int_equal(beam_shape((enum beam_basis)basis, edge - h, derivative, left), BEAM_OK);
            assert_int_equal(beam_shape((enum beam_basis)basis, edge + h, derivative, right), BEAM_OK);
            for (int i = 0; i < BEAM_N; i++)
                *(derivative == 1 ? &kink : &jump) += fabs(right[i] - left[i]);
        }
        assert_true(kink < 1e-3);
        assert_true(basis == BEAM_BASIS_PATCH ? jump > 1000.0 : jump < 1.0);
    }
}

/* The tables against Simpson's rule on beam_shape, an independent quadrature. */
static void tables_are_the_integrals_of_the_shapes(void **state)
{
    const double edge[4] = {0.0, 0.02535, 0.08905, 0.4573};
    (void)state;
    for (int basis = 0; basis < 2; basis++)
        for (int derivative = 0; derivative < 3; derivative++) {
            double form[2][BEAM_N][BEAM_N] = {{{0}}}, load[2][BEAM_N] = {{0}};
            for (int piece = 0; piece < 3; piece++) {
                const int steps = 6000;
                const double h = (edge[piece + 1] - edge[piece]) / steps;
                for (int k = 0; k <= steps; k++) {
                    double phi[BEAM_N], x = edge[piece] + k * h;
                    if (k == 0 || k == steps) /* one-sided at the edges */
                        x += (k == 0 ? 1 : -1) * 1e-12;
                    const double w = h / 3.0 * (k == 0 || k == steps ? 1 : k % 2 ? 4 : 2);
                    assert_int_equal(beam_shape((enum beam_basis)basis, x, derivative, phi), BEAM_OK);
                    for (int i = 0; i < BEAM_N; i++) {
                        load[piece == 1][i] += w * phi[i];
                        for (int j = 0; j < BEAM_N; j++)
                            form[piece == 1][i][j] += w * phi[i] * phi[j];
                    }
                }
            }
            const struct beam_table *t = &beam_tables[basis];
            for (int r = 0; r < 2; r++)
                for (int i = 0; i < BEAM_N; i++) {
                    if (derivative == 0)
                        assert_close(load[r][i], t->load[r][i], 1e-9);
                    for (int j = i; j < BEAM_N; j++) {
                        const double table = j - i > BEAM_DEGREE ? 0.0
                                             : derivative == 0   ? t->mass[r][i][j - i]
                                             : derivative == 1   ? t->slope[r][i][j - i]
                                                                 : t->curvature[r][i][j - i];
                        const double size[3] = {0.05, 100.0, 3e6};
                        assert_close(form[r][i][j], table, 2e-5 * size[derivative]);
                    }
                }
        }
}

static void matrices_are_symmetric_and_linear_in_the_parameters(void **state)
{
    (void)state;
    for (int basis = 0; basis < 2; basis++) {
        struct beam_description a = case_description((enum beam_basis)basis), b = a, sum = a;
        struct beam_model ma, mb, ms;
        b.parameters = (struct beam_parameters){0.1, 0.2, 0.3, 0.4, 1e-6, 2e-6, 0.5, 1.0, 1.0};
        const double *pa = (const double *)&a.parameters, *pb = (const double *)&b.parameters;
        double *ps = (double *)&sum.parameters;
        for (size_t i = 0; i < sizeof a.parameters / sizeof *ps; i++)
            ps[i] = pa[i] + pb[i];
        assert_int_equal(beam_assemble(&a, &ma), BEAM_OK);
        assert_int_equal(beam_assemble(&b, &mb), BEAM_OK);
        assert_int_equal(beam_assemble(&sum, &ms), BEAM_OK);
        for (int i = 0; i < BEAM_N; i++)
            for (int j = 0; j < BEAM_N; j++) {
                assert_true(ma.M[i][j] == ma.M[j][i] && ma.K[i][j] == ma.K[j][i] && ma.C[i][j] == ma.C[j][i]);
                assert_close(ms.M[i][j], ma.M[i][j] + mb.M[i][j], 1e-15);
                assert_close(ms.C[i][j], ma.C[i][j] + mb.C[i][j], 1e-13 * fabs(ms.C[i][i]));
                assert_close(ms.K[i][j], ma.K[i][j] + mb.K[i][j], 1e-13 * fabs(ms.K[i][i]));
            }
    }
}

static void a_tip_mass_and_a_spring_do_what_rayleigh_says(void **state)
{
    /* first-order change of ω₁²: −ω₁² m ψ₁(a)² and + k ψ₁(a)² */
    const struct beam_description plain = case_description(BEAM_BASIS_PATCH);
    struct beam_model model;
    struct beam_modes modes;
    double phi[BEAM_N], psi = 0.0;
    (void)state;
    assert_int_equal(beam_assemble(&plain, &model), BEAM_OK);
    assert_int_equal(beam_find_modes(&model, &modes), BEAM_OK);
    assert_int_equal(beam_shape(BEAM_BASIS_PATCH, 0.3, 0, phi), BEAM_OK);
    for (int i = 0; i < BEAM_N; i++)
        psi += phi[i] * modes.shape[i][0];
    const double square = modes.omega_radps[0] * modes.omega_radps[0];
    struct beam_description heavy = plain, stiff = plain;
    case_add_effect(&heavy, beam_effect_find("point_mass"), 0, 1e-6, 0.3, 0);
    case_add_effect(&stiff, beam_effect_find("point_spring"), 0, 1e-3, 0, 0.3);
    assert_int_equal(beam_assemble(&heavy, &model), BEAM_OK);
    assert_int_equal(beam_find_modes(&model, &modes), BEAM_OK);
    assert_close((modes.omega_radps[0] * modes.omega_radps[0] - square) / (-square * 1e-6 * psi * psi), 1.0, 1e-3);
    assert_int_equal(beam_assemble(&stiff, &model), BEAM_OK);
    assert_int_equal(beam_find_modes(&model, &modes), BEAM_OK);
    assert_close((modes.omega_radps[0] * modes.omega_radps[0] - square) / (1e-3 * psi * psi), 1.0, 1e-3);
}

static void hysteretic_damping_gives_every_mode_half_its_loss_factor(void **state)
{
    struct beam_description d = case_description(BEAM_BASIS_PATCH);
    static struct beam_model model;
    static struct beam_work work;
    (void)state;
    d.parameters.cDI_beam_sNm2 = d.parameters.cDI_patch_sNm2 = d.parameters.gamma_sNpm2 = 0.0;
    case_add_effect(&d, beam_effect_find("hysteretic_damping"), 0, 0.02, 0, 0);
    case_add_effect(&d, beam_effect_find("tip_mass"), 0, 0.004, 0, 0); /* after it: the modes are those of the whole */
    assert_int_equal(beam_assemble(&d, &model), BEAM_OK);
    assert_int_equal(beam_find_poles(&model, &work), BEAM_OK);
    assert_int_equal(work.poles.n_complex, BEAM_N);
    for (int k = 0; k < BEAM_N; k++)
        assert_close(-work.poles.re[k] / hypot(work.poles.re[k], work.poles.im[k]), 0.01, 1e-9);
}

static void every_effect_of_the_build_assembles_or_says_why_not(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++) {
        const struct beam_effect *effect = beam_effects[e];
        struct beam_description d = case_description(BEAM_BASIS_PATCH);
        static struct beam_model model;
        case_add_effect(&d, effect, 0, 0, 0, 0);
        for (int i = 0; i < effect->n_parameters; i++)
            d.use[0].p[i] =
                effect->parameters[i].start * (effect->parameters[i].role == BEAM_ROLE_PLACE ? beam_length() : 1.0);
        const enum beam_status status = beam_assemble(&d, &model);
        if (effect->releases_root || effect->geometry || strcmp(effect->id, "attached_resonator") == 0)
            assert_int_equal(status, BEAM_ERROR_NEEDS_HOST);
        else if (status != BEAM_ERROR_CAPACITY) /* laws of two coordinates over the span need BEAM_PORTS 16 */
            assert_int_equal(status, BEAM_OK);
    }
}

/* An effect of the test's own with one linear term, as it stands in `asked`, or a law at `law_at`. */
static struct beam_operator asked;
static struct beam_law_place law_at;
static int answer; /* what its functions return */

static int asked_terms(const double p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0] = (struct beam_term){.place = asked, .value = {.mass = p[0], .damping = p[1], .stiffness = p[2]}};
    return answer;
}

static int asked_place(const double p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    *out = law_at;
    return answer;
}

static int no_force(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    (void)p;
    (void)in;
    (void)out;
    return 0;
}

static const struct beam_effect one_term = {.id = "one_term", .n_terms = 1, .terms = asked_terms};
static const struct beam_effect one_law = {.id = "one_law", .law_place = asked_place, .law = no_force};

/* What the term `asked` of mass 2, damping 3, stiffness 5 adds to M, C, K is that many times `form`. */
static enum beam_status added(enum beam_basis basis, double form[BEAM_N][BEAM_N])
{
    const struct beam_description plain = case_description(basis);
    struct beam_description d = plain;
    static struct beam_model model, with;
    case_add_effect(&d, &one_term, 0, 2.0, 3.0, 5.0);
    const enum beam_status status = beam_assemble(&d, &with);
    if (status != BEAM_OK)
        return status;
    assert_int_equal(beam_assemble(&plain, &model), BEAM_OK);
    double most = 0.0;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++) {
            form[i][j] = (with.M[i][j] - model.M[i][j]) / 2.0;
            most = fmax(most, fabs(form[i][j]));
        }
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++) {
            assert_close(with.C[i][j] - model.C[i][j], 3.0 * form[i][j], 1e-12 * (most + fabs(model.C[i][j])));
            assert_close(with.K[i][j] - model.K[i][j], 5.0 * form[i][j], 1e-12 * (most + fabs(model.K[i][j])));
        }
    return status;
}

static void a_functional_s_term_is_the_product_of_its_vector(void **state)
{
    static const struct {
        enum beam_operator_kind kind;
        int derivative;
        double at_m,
            minus_m; /* w = y^(derivative)(at) − y^(derivative)(minus); minus 0: the clamp, where both vanish */
    } cases[4] = {{BEAM_AT_POINT, 0, 0.3, 0.0},
                  {BEAM_AT_SLOPE, 1, 0.2, 0.0},
                  {BEAM_AT_SLOPE_DIFFERENCE, 1, 0.31, 0.17},
                  {BEAM_AT_PATCH, 1, 0.08905, 0.02535}};
    (void)state;
    for (int basis = 0; basis < 2; basis++)
        for (int k = 0; k < 4; k++) {
            double form[BEAM_N][BEAM_N], g[BEAM_N], from[BEAM_N];
            asked = (struct beam_operator){
                .kind = cases[k].kind, .at_m = cases[k].at_m, .from_m = cases[k].minus_m, .to_m = cases[k].at_m};
            assert_int_equal(added((enum beam_basis)basis, form), BEAM_OK);
            assert_int_equal(beam_shape((enum beam_basis)basis, cases[k].at_m, cases[k].derivative, g), BEAM_OK);
            assert_int_equal(beam_shape((enum beam_basis)basis, cases[k].minus_m, cases[k].derivative, from), BEAM_OK);
            for (int i = 0; i < BEAM_N; i++)
                for (int j = 0; j < BEAM_N; j++)
                    assert_close(form[i][j], (g[i] - from[i]) * (g[j] - from[j]), 1e-9);
        }
}

static void a_form_over_the_span_has_its_weight_in_each_region(void **state)
{
    (void)state;
    for (int b = 0; b < 2; b++) {
        const enum beam_basis basis = (enum beam_basis)b;
        const struct beam_description d = case_description(basis);
        const struct beam_table *t = &beam_tables[basis];
        const double ratio = d.parameters.rho_patch_kgpm / d.parameters.rho_beam_kgpm;
        static struct beam_model model;
        double form[BEAM_N][BEAM_N];
        assert_int_equal(beam_assemble(&d, &model), BEAM_OK);
        asked = (struct beam_operator){.kind = BEAM_OVER_DEFLECTION, .weight = BEAM_WEIGHT_RHO};
        assert_int_equal(added(basis, form), BEAM_OK);
        for (int i = 0; i < BEAM_N; i++)
            for (int j = 0; j < BEAM_N; j++)
                assert_close(form[i][j], model.M[i][j], 1e-15);
        asked = (struct beam_operator){.kind = BEAM_OVER_CURVATURE, .weight = BEAM_WEIGHT_PATCH};
        assert_int_equal(added(basis, form), BEAM_OK);
        for (int i = 0; i < BEAM_N; i++)
            for (int j = i; j < BEAM_N && j - i <= BEAM_DEGREE; j++)
                assert_close(form[i][j], t->curvature[1][i][j - i], 1e-12 * t->curvature[1][i][0] + 1e-9);
        asked = (struct beam_operator){.kind = BEAM_OVER_SLOPE, .weight = BEAM_WEIGHT_TURNING};
        assert_int_equal(added(basis, form), BEAM_OK);
        for (int i = 0; i < BEAM_N; i++)
            for (int j = i; j < BEAM_N && j - i <= BEAM_DEGREE; j++)
                assert_close(form[i][j],
                             d.parameters.EI_beam_Nm2 * (t->slope[0][i][j - i] + ratio * t->slope[1][i][j - i]), 1e-9);
    }
}

static void places_that_the_model_lacks_are_named(void **state)
{
    double form[BEAM_N][BEAM_N];
    (void)state;
    asked = (struct beam_operator){.kind = BEAM_AT_NOTHING};
    assert_int_equal(added(BEAM_BASIS_PATCH, form), BEAM_OK);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            assert_true(form[i][j] == 0.0);
    asked.kind = BEAM_AT_ROOT;
    assert_int_equal(added(BEAM_BASIS_PATCH, form), BEAM_ERROR_NEEDS_HOST);
    asked.kind = (enum beam_operator_kind)(BEAM_OVER_MODES + 1);
    assert_int_equal(added(BEAM_BASIS_PATCH, form), BEAM_ERROR_ARGUMENT);
    asked = (struct beam_operator){.kind = BEAM_AT_SLOPE_DIFFERENCE, .from_m = 0.1, .to_m = 0.46};
    assert_int_equal(added(BEAM_BASIS_PATCH, form), BEAM_ERROR_PLACE);

    struct beam_description d = case_description(BEAM_BASIS_PATCH);
    static struct beam_model model;
    case_add_effect(&d, &one_law, 0, 0, 0, 0);
    law_at = (struct beam_law_place){.points = BEAM_LAW_NONE};
    assert_int_equal(beam_assemble(&d, &model), BEAM_OK);
    assert_int_equal(model.n_ports, 0);
    law_at = (struct beam_law_place){.points = BEAM_LAW_AT_SPAN, .at_m = 0.45, .width_m = 0.02};
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_PLACE);
    answer = -1; /* outside the range that only the effect itself knows */
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_EFFECT_RANGE);
    assert_int_equal(added(BEAM_BASIS_PATCH, form), BEAM_ERROR_EFFECT_RANGE);
    answer = 0;
}

static void bad_descriptions_are_named(void **state)
{
    const struct beam_description good = case_description(BEAM_BASIS_PATCH);
    struct beam_description d;
    static struct beam_model model;
    (void)state;
    d = good;
    d.parameters.rho_beam_kgpm = -0.1;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_PARAMETER);
    d = good;
    d.parameters.EI_patch_Nm2 = 0.0;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_PARAMETER);
    d = good;
    d.parameters.gamma_sNpm2 = -1e-9;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_PARAMETER);
    d = good;
    d.parameters.KB_NmpV = NAN;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_NOT_FINITE);
    d = good;
    d.input[0].at_m = 0.5;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_PLACE);
    d = good;
    d.output[2].at_m = -1e-3;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_PLACE);
    d = good;
    d.n_outputs = BEAM_OUTPUTS + 1;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_ARGUMENT);
    d = good;
    d.basis = (enum beam_basis)2;
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_ARGUMENT);
    d = good;
    d.n_uses = 1; /* its effect is NULL: an id that this build does not know */
    assert_null(beam_effect_find("no_such_effect"));
    assert_null(beam_effect_find("tip_mas"));
    assert_null(beam_effect_find("tip_mass2"));
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_EFFECT);
    d = good;
    case_add_effect(&d, beam_effect_find("tip_mass"), 0, -1.0, 0, 0);
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_EFFECT_RANGE);
    d = good;
    case_add_effect(&d, beam_effect_find("point_mass"), 0, 0.01, NAN, 0);
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_EFFECT_RANGE);
    d = good;
    for (int i = 0; i < 3; i++) /* more branches than there is room for */
        case_add_effect(&d, beam_effect_find("viscoelastic"), 0, 0.02, 5e-3, 0);
    assert_int_equal(beam_assemble(&d, &model), BEAM_ERROR_CAPACITY);
    double phi[BEAM_N];
    assert_int_equal(beam_shape(BEAM_BASIS_PATCH, 0.1, 3, phi), BEAM_ERROR_ARGUMENT);
    assert_int_equal(beam_shape(BEAM_BASIS_PATCH, NAN, 0, phi), BEAM_ERROR_PLACE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_bases_have_the_frequencies_of_the_paper_s_beam),
        cmocka_unit_test(a_uniform_cantilever_has_the_textbook_frequencies),
        cmocka_unit_test(shapes_meet_the_clamp_and_their_own_derivatives),
        cmocka_unit_test(curvature_may_jump_at_the_patch_edges_only_in_the_patch_basis),
        cmocka_unit_test(tables_are_the_integrals_of_the_shapes),
        cmocka_unit_test(matrices_are_symmetric_and_linear_in_the_parameters),
        cmocka_unit_test(a_tip_mass_and_a_spring_do_what_rayleigh_says),
        cmocka_unit_test(hysteretic_damping_gives_every_mode_half_its_loss_factor),
        cmocka_unit_test(every_effect_of_the_build_assembles_or_says_why_not),
        cmocka_unit_test(a_functional_s_term_is_the_product_of_its_vector),
        cmocka_unit_test(a_form_over_the_span_has_its_weight_in_each_region),
        cmocka_unit_test(places_that_the_model_lacks_are_named),
        cmocka_unit_test(bad_descriptions_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
