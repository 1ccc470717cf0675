/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Elementary functions of the float builds: errors against the C library's double ones, ends of the range, symmetry. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>

typedef float function(float x);
function beamf_math_exp, beamf_math_log, beamf_math_tanh, beamf_math_sin, beamf_math_cos;
function beamt_math_exp, beamt_math_log, beamt_math_tanh, beamt_math_sin, beamt_math_cos;

static float float_of(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Distance of neighbouring floats at this value */
static double last_place(double value)
{
    int exponent;
    (void)frexp(fabs(value), &exponent);
    return ldexp(1.0, (exponent < -125 ? -125 : exponent) - 24);
}

/* Every 4001st float of all; largest error in last places. NaN and infinity must come out where the reference says so. */
static double worst_error(function *ours, double (*reference)(double))
{
    double worst = 0.0;
    for (uint64_t bits = 0; bits <= UINT32_MAX; bits += 4001) {
        const float x = float_of((uint32_t)bits), y = ours(x);
        const double right = reference((double)x);
        if (isnan(right)) {
            assert_true(isnan(y));
        } else if (isinf(y) || fabs(right) > 3.4028235e38) {
            assert_true(fabs(right) > 3.40282e38 && isinf(y) && (y > 0.0F) == (right > 0.0));
        } else {
            worst = fmax(worst, fabs((double)y - right) / last_place(right));
        }
    }
    return worst;
}

static void test_error_over_all_floats(void **unused)
{
    (void)unused;
    const struct {
        function *ours;
        double (*reference)(double);
        double bound;
    } cases[] = {{beamt_math_exp, exp, 1.0},
                 {beamt_math_log, log, 1.0},
                 {beamt_math_tanh, tanh, 1.5},
                 {beamt_math_sin, sin, 2.7},
                 {beamt_math_cos, cos, 2.7}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double worst = worst_error(cases[i].ours, cases[i].reference);
        print_message("%.2f of the last place, at most %.1f\n", worst, cases[i].bound);
        assert_true(worst <= cases[i].bound);
        assert_true(worst > 0.4); /* a comparison that compares nothing shows 0 */
    }
}

static void test_ends_of_the_range(void **unused)
{
    (void)unused;
    const float big = float_of(0x7F7FFFFFu), endless = float_of(0x7F800000u), nothing = float_of(0x7FC00000u);
    assert_true(isinf(beamt_math_exp(big)) && isinf(beamt_math_exp(endless)));
    assert_true(beamt_math_exp(-big) == 0.0F && beamt_math_exp(-endless) == 0.0F && beamt_math_exp(0.0F) == 1.0F);
    assert_true(isinf(beamt_math_log(0.0F)) && beamt_math_log(0.0F) < 0.0F && isnan(beamt_math_log(-1.0F)));
    assert_true(isinf(beamt_math_log(endless)) && beamt_math_log(1.0F) == 0.0F);
    assert_true(beamt_math_tanh(endless) == 1.0F && beamt_math_tanh(-endless) == -1.0F);
    assert_true(isnan(beamt_math_sin(endless)) && isnan(beamt_math_cos(-endless)) && beamt_math_cos(0.0F) == 1.0F);
    assert_true(isnan(beamt_math_exp(nothing)) && isnan(beamt_math_log(nothing)) && isnan(beamt_math_tanh(nothing)) &&
                isnan(beamt_math_sin(nothing)) && isnan(beamt_math_cos(nothing)));
}

static void test_symmetry(void **unused)
{
    (void)unused;
    for (uint64_t bits = 1; bits < 0x7F800000u; bits += 65521) {
        const float x = float_of((uint32_t)bits);
        assert_true(bits_of(beamt_math_sin(-x)) == bits_of(-beamt_math_sin(x)));
        assert_true(bits_of(beamt_math_tanh(-x)) == bits_of(-beamt_math_tanh(x)));
        assert_true(bits_of(beamt_math_cos(-x)) == bits_of(beamt_math_cos(x)));
    }
}

static void test_both_float_builds_agree(void **unused)
{
    (void)unused;
    function *const pairs[][2] = {{beamt_math_exp, beamf_math_exp},
                                  {beamt_math_log, beamf_math_log},
                                  {beamt_math_tanh, beamf_math_tanh},
                                  {beamt_math_sin, beamf_math_sin},
                                  {beamt_math_cos, beamf_math_cos}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
        for (uint64_t bits = 0; bits < 0x7F800000u; bits += 65521) {
            const float x = float_of((uint32_t)bits);
            assert_true(bits_of(pairs[i][0](x)) == bits_of(pairs[i][1](x)));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_over_all_floats),
        cmocka_unit_test(test_ends_of_the_range),
        cmocka_unit_test(test_symmetry),
        cmocka_unit_test(test_both_float_builds_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
