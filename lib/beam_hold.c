/* SPDX-License-Identifier: MIT */
/* Exact responses to piecewise polynomial inputs (φ-functions: Hochbruck and Ostermann, Acta Numerica 2010). */
#include "beam_hold.h"

#define PI BEAM_K(3.141592653589793238463)

enum { NODES = 6, PIECES = 8 };

/* Modified Bessel function of order 0 by its power series; x ≤ 20. */
static beam_real bessel(beam_real x)
{
    beam_real term = BEAM_K(1.0), sum = BEAM_K(1.0);
    for (int k = 1; k < 60; k++) {
        term *= (BEAM_K(0.5) * x / (beam_real)k) * (BEAM_K(0.5) * x / (beam_real)k);
        sum += term;
    }
    return sum;
}

enum beam_status beam_kernel_make(enum beam_hold hold, int half_width, struct beam_kernel *out)
{
    out->hold = hold;
    out->half_width = 1;
    out->shape = BEAM_K(0.0);
    out->peak = BEAM_K(1.0);
    if (hold == BEAM_HOLD_FIRST_ORDER || hold == BEAM_HOLD_ZERO_ORDER)
        return BEAM_OK;
    const int width = half_width == 0 ? 20 : half_width;
    if (hold != BEAM_HOLD_BAND_LIMITED || width < 4 || width > BEAM_HALF_WIDTH)
        return BEAM_ERROR_ARGUMENT;
    /* Kaiser 1974: attenuation for a transition from 0.4 to 0.6 of the sample rate over 2L samples */
    const beam_real decibel = BEAM_K(8.0) + BEAM_K(2.285) * BEAM_K(2.0) * (beam_real)width * BEAM_K(0.4) * PI;
    out->half_width = width;
    out->shape = BEAM_K(0.1102) * (decibel - BEAM_K(8.7));
    out->peak = bessel(out->shape);
    return BEAM_OK;
}

beam_real beam_kernel_at(const struct beam_kernel *kernel, int piece, beam_real r)
{
    const int l = kernel->half_width;
    if (piece < -l || piece >= l)
        return BEAM_K(0.0);
    if (kernel->hold == BEAM_HOLD_FIRST_ORDER)
        return piece < 0 ? r : BEAM_K(1.0) - r;
    if (kernel->hold == BEAM_HOLD_ZERO_ORDER)
        return piece < 0 ? BEAM_K(0.0) : BEAM_K(1.0);
    const beam_real x = (beam_real)piece + r, share = x / (beam_real)l;
    const beam_real rest = BEAM_K(1.0) - share * share;
    const beam_real window =
        beam_less(BEAM_K(0.0), rest) ? bessel(kernel->shape * beam_sqrt(rest)) / kernel->peak : BEAM_K(0.0);
    if (beam_less(beam_fabs(x), BEAM_K(1e-4)))
        return window;
    const beam_real nearest = beam_less(BEAM_K(0.5), r) ? BEAM_K(1.0) - r : r; /* exactly 0 at integers */
    const beam_real sine = beam_sin(PI * nearest);
    return (piece % 2 == 0 ? sine : -sine) / (PI * x) * window;
}

void beam_phi(int n, beam_real z_re, beam_real z_im, beam_real out_re[], beam_real out_im[])
{
    const beam_real size2 = z_re * z_re + z_im * z_im;
    if (beam_less(size2, BEAM_K(9.0))) { /* φ_k = Σ z^j/(j + k)! by Horner's rule */
        beam_real factorial = BEAM_K(1.0);
        for (int k = 1; k <= n; k++) {
            beam_real re = BEAM_K(1.0), im = BEAM_K(0.0);
            for (int j = 30; j >= 1; j--) {
                const beam_real t = (re * z_re - im * z_im) / (beam_real)(j + k);
                im = (re * z_im + im * z_re) / (beam_real)(j + k);
                re = BEAM_K(1.0) + t;
            }
            factorial *= (beam_real)k;
            out_re[k - 1] = re / factorial;
            out_im[k - 1] = im / factorial;
        }
        return;
    }
    const beam_real grown = beam_exp(z_re);
    beam_real re = grown * beam_cos(z_im), im = grown * beam_sin(z_im), factorial = BEAM_K(1.0);
    for (int k = 1; k <= n; k++) { /* φ_k = (φ_{k−1} − 1/(k−1)!)/z */
        const beam_real d = re - BEAM_K(1.0) / factorial;
        re = (d * z_re + im * z_im) / size2;
        im = (im * z_re - d * z_im) / size2;
        out_re[k - 1] = re;
        out_im[k - 1] = im;
        factorial *= (beam_real)k;
    }
}

/* Weights of ∫ p(r) e^{z(1−r)} dr over r in [0, 1] for the polynomial p through n equidistant nodes. */
struct piece_rule {
    int nodes, pieces;
    beam_real width;              /* of one piece, samples */
    beam_real decay_re, decay_im; /* e^{z width} */
    beam_real re[NODES], im[NODES];
};

static void make_rule(const struct beam_kernel *kernel, beam_real z_re, beam_real z_im, beam_real length,
                      struct piece_rule *rule)
{
    const int smooth = kernel->hold == BEAM_HOLD_BAND_LIMITED;
    const int n = smooth ? NODES : 2;
    beam_real phi_re[NODES], phi_im[NODES];
    rule->nodes = n;
    rule->pieces = smooth ? PIECES : 1;
    rule->width = length / (beam_real)rule->pieces;
    beam_phi(n, z_re * rule->width, z_im * rule->width, phi_re, phi_im);
    const beam_real grown = beam_exp(z_re * rule->width);
    rule->decay_re = grown * beam_cos(z_im * rule->width);
    rule->decay_im = grown * beam_sin(z_im * rule->width);
    for (int i = 0; i < n; i++) {
        beam_real poly[NODES] = {BEAM_K(1.0)}, factorial = BEAM_K(1.0); /* Lagrange polynomial i, by powers of r */
        int degree = 0;
        for (int j = 0; j < n; j++) {
            if (j == i)
                continue;
            const beam_real zero = (beam_real)j / (beam_real)(n - 1), gap = (beam_real)(i - j) / (beam_real)(n - 1);
            degree++;
            for (int k = degree; k > 0; k--)
                poly[k] = ((k < degree ? -zero * poly[k] : BEAM_K(0.0)) + poly[k - 1]) / gap;
            poly[0] = -zero * poly[0] / gap;
        }
        rule->re[i] = rule->im[i] = BEAM_K(0.0);
        for (int k = 0; k < n; k++) { /* ∫ r^k e^{z(1−r)} dr = k! φ_{k+1} */
            rule->re[i] += poly[k] * factorial * phi_re[k];
            rule->im[i] += poly[k] * factorial * phi_im[k];
            factorial *= (beam_real)(k + 1);
        }
    }
}

/* x over the stretch that begins at `piece` + from and has the rule's pieces. */
static void advance(const struct beam_kernel *kernel, const struct piece_rule *rule, int piece, beam_real from,
                    beam_real *x_re, beam_real *x_im)
{
    for (int p = 0; p < rule->pieces; p++) {
        const beam_real re = *x_re * rule->decay_re - *x_im * rule->decay_im;
        beam_real sum_re = re, sum_im = *x_re * rule->decay_im + *x_im * rule->decay_re;
        for (int i = 0; i < rule->nodes; i++) {
            const beam_real r = from + rule->width * ((beam_real)p + (beam_real)i / (beam_real)(rule->nodes - 1));
            const beam_real value = rule->width * beam_kernel_at(kernel, piece, r);
            sum_re += value * rule->re[i];
            sum_im += value * rule->im[i];
        }
        *x_re = sum_re;
        *x_im = sum_im;
    }
}

void beam_kernel_response(const struct beam_kernel *kernel, beam_real z_re, beam_real z_im, beam_real offset,
                          beam_real out_re[BEAM_RESPONSE], beam_real out_im[BEAM_RESPONSE])
{
    const int split = beam_less(BEAM_K(0.0), offset), l = kernel->half_width;
    struct piece_rule before, after;
    beam_real re = BEAM_K(0.0), im = BEAM_K(0.0);
    if (split)
        make_rule(kernel, z_re, z_im, offset, &before);
    make_rule(kernel, z_re, z_im, BEAM_K(1.0) - offset, &after);
    for (int i = 0; i <= 2 * l; i++) { /* at −L + i + offset */
        if (i > 0)
            advance(kernel, &after, i - 1 - l, offset, &re, &im);
        if (split)
            advance(kernel, &before, i - l, BEAM_K(0.0), &re, &im);
        out_re[i] = re;
        out_im[i] = im;
    }
}
