/* SPDX-License-Identifier: MIT */
/* Elementary functions in float arithmetic, equal bit for bit wherever floats are IEEE 754 and contraction is off. */
#include <stdint.h>
#include <string.h>
#include "beam_real.h"

#ifdef BEAM_FLOAT

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static float float_of(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* 2ⁿ, −126 ≤ n ≤ 127 */
static float power_of_two(int n)
{
    return float_of((uint32_t)(n + 127) << 23);
}

/* ln 2 = LN2_HIGH + LN2_LOW; LN2_HIGH times any exponent is exact */
#define LN2_HIGH 0.693145752F
#define LN2_LOW  1.42860677e-6F

float beam_math_exp(float x)
{
    if (!(x > -104.0F)) /* NaN too */
        return x != x ? x : 0.0F;
    if (x > 88.8F)
        return float_of(0x7F800000u);
    const float scaled = x * 1.44269504F;
    const int n = (int)(scaled < 0.0F ? scaled - 0.5F : scaled + 0.5F);
    const float high = x - (float)n * LN2_HIGH, low = (float)n * LN2_LOW, r = high - low; /* |r| ≤ ln 2/2 */
    const float tail =
        r * r *
        (0.5F + r * (1.66666667e-1F +
                     r * (4.16666667e-2F + r * (8.33333333e-3F + r * (1.38888889e-3F + r * 1.98412698e-4F)))));
    const float grown = 1.0F + (high + (tail - low)); /* eʳ = 1 + r + r²/2 + … + r⁷/7! */
    const int half = n / 2;                           /* in two factors: 2ⁿ may be no normal float */
    return grown * power_of_two(half) * power_of_two(n - half);
}

float beam_math_log(float x)
{
    int n = 0;
    if (!(x > 0.0F))
        return x == 0.0F ? -float_of(0x7F800000u) : x - x + float_of(0x7FC00000u);
    if (x < power_of_two(-126)) {
        x *= 33554432.0F; /* 2²⁵ */
        n = -25;
    }
    const uint32_t bits = bits_of(x);
    if (bits >= 0x7F800000u)
        return x;
    const uint32_t shifted = bits - 0x3F3504F3u; /* of √½: the mantissa is taken in [√½, √2) */
    n += (int)shifted >> 23;
    const float f = float_of((shifted & 0x7FFFFFu) + 0x3F3504F3u) - 1.0F;
    const float s = f / (2.0F + f), z = s * s;
    const float r = z * (0.666666667F + z * (0.4F + z * (0.285714286F + z * (0.222222222F + z * 0.181818182F))));
    const float half_square = 0.5F * f * f; /* ln(1 + f) = f − f²/2 + s (f²/2 + r) */
    const float k = (float)n;
    return k * LN2_HIGH + (f - (half_square - (s * (half_square + r) + k * LN2_LOW)));
}

float beam_math_tanh(float x)
{
    const float size = fabsf(x);
    if (size < 0.55F) { /* continued fraction to x²/9 */
        const float z = x * x;
        return x - x * (z * (315.0F + 14.0F * z)) / (945.0F + z * (420.0F + 15.0F * z));
    }
    if (size > 9.1F)
        return x < 0.0F ? -1.0F : 1.0F;
    const float y = 1.0F - 2.0F / (beam_math_exp(2.0F * size) + 1.0F);
    return x < 0.0F ? -y : y;
}

/*
 * |x| = (quarters + rest/(π/2)) π/2, |rest| ≤ π/4, quarters modulo 4, by an exact product: x = m 2ᵉ, and of the bits of
 * 2/π only the 96 that matter for m are taken. Valid for π/4 ≤ |x| < ∞.
 */
static unsigned quarters(float x, float *rest)
{
    static const uint32_t two_over_pi[] = {0,           0xA2F9836Eu, 0x4E441529u, 0xFC2757D1u,
                                           0xF534DDC0u, 0xDB629599u, 0x3C439041u, 0xFE5163ABu};
    const uint32_t bits = bits_of(x), m = (bits & 0x7FFFFFu) | 0x800000u;
    const unsigned place = (bits >> 23 & 0xFFu) - 150u + 30u, word = place / 32u, shift = place % 32u;
    uint32_t w[3];
    for (unsigned i = 0; i < 3; i++)
        w[i] = two_over_pi[word + i] << shift | (shift > 0 ? two_over_pi[word + i + 1] >> (32u - shift) : 0u);
    const uint64_t low = (uint64_t)m * w[2], middle = (uint64_t)m * w[1] + (low >> 32);
    const uint32_t top = m * w[0] + (uint32_t)(middle >> 32); /* two bits of quarters, then the fraction */
    const unsigned nearest = (top + 0x20000000u) >> 30;
    uint32_t high = top - (nearest << 30), next = (uint32_t)middle;
    const int negative = (int)(high >> 31);
    if (negative) {
        next = ~next + 1u;
        high = ~high + (next == 0u);
    }
    const float fraction = (float)high * 4294967296.0F + (float)next;
    *rest = (negative ? -fraction : fraction) * 3.40612161e-19F; /* π/2 · 2⁻⁶² */
    return nearest;
}

static float sine(float x) /* |x| ≤ π/4 */
{
    const float z = x * x;
    return x - x * z * (1.66666667e-1F - z * (8.33333333e-3F - z * (1.98412698e-4F - z * 2.75573192e-6F)));
}

static float cosine(float x)
{
    const float z = x * x;
    return 1.0F -
           (0.5F * z - z * z * (4.16666667e-2F - z * (1.38888889e-3F - z * (2.48015873e-5F - z * 2.75573192e-7F))));
}

/* sin(|x| + ahead π/2) */
static float turned(float x, unsigned ahead)
{
    float rest = fabsf(x);
    if (!(rest < float_of(0x7F800000u)))
        return x - x;
    const unsigned quarter = (rest < 0.785398163F ? 0u : quarters(rest, &rest)) + ahead;
    const float y = quarter & 1u ? cosine(rest) : sine(rest);
    return quarter & 2u ? -y : y;
}

float beam_math_sin(float x)
{
    const float y = turned(x, 0);
    return x < 0.0F ? -y : y;
}

float beam_math_cos(float x)
{
    return turned(x, 1);
}

#else
typedef int beam_math_of_the_c_library; /* the double and complex builds */
#endif
