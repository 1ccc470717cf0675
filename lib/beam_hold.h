/* SPDX-License-Identifier: MIT */
/*
 * beam_hold.h — what a sampled signal does between its samples: u(t) = Σ u_j κ(t/Δt − j), κ = 0 outside [−L, L].
 * Private to lib/.
 */
#ifndef BEAM_HOLD_H
#define BEAM_HOLD_H

#include "beam_dense.h"

enum { BEAM_RESPONSE = 2 * BEAM_HALF_WIDTH + 1 };

/* κ of one hold; L = 1 for zero and first order. */
struct beam_kernel {
    enum beam_hold hold;
    int half_width;
    beam_real shape, peak; /* Kaiser's β and I₀(β) */
};

#define beam_kernel_make     BEAM_NAME(kernel_make)
#define beam_kernel_at       BEAM_NAME(kernel_at)
#define beam_kernel_response BEAM_NAME(kernel_response)
#define beam_phi             BEAM_NAME(phi)

/* ARGUMENT when half_width is outside 4..BEAM_HALF_WIDTH (band limited; 0 means 20). */
enum beam_status beam_kernel_make(enum beam_hold hold, int half_width, struct beam_kernel *out);

/* κ(piece + r), piece an integer, r in [0, 1]: the limit from inside the piece. */
beam_real beam_kernel_at(const struct beam_kernel *kernel, int piece, beam_real r);

/*
 * Response of ẋ = z x + κ(t), at rest before −L, at t = l + offset for l = −L .. L: out[l + L], 2L + 1 of them.
 * offset in [0, 1). κ is taken as a polynomial on pieces (exactly linear for the holds of order 0, 1; degree 5 on
 * eighths of a sample, error 1e-6, for the band-limited one) and the integral is then exact for every z with re ≤ 0.
 */
void beam_kernel_response(const struct beam_kernel *kernel, beam_real z_re, beam_real z_im, beam_real offset,
                          beam_real out_re[BEAM_RESPONSE], beam_real out_im[BEAM_RESPONSE]);

/* φ_k(z) = ∫₀¹ e^{(1−r)z} r^{k−1}/(k−1)! dr for k = 1 .. n ≤ 6; out[k − 1]. φ₁ = (e^z − 1)/z. */
void beam_phi(int n, beam_real z_re, beam_real z_im, beam_real out_re[], beam_real out_im[]);

#endif
