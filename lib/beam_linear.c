/* SPDX-License-Identifier: MIT */
/*
 * The loops over the 2 × 2 blocks, two blocks a turn; an odd last block has a neighbour of zeros. The order of the sums
 * is written out, so that with contraction off every target rounds alike.
 */
#include "beam_plan.h"

_Static_assert(BEAM_BLOCKS % 2 == 0, "blocks are taken in twos");

void beam_turn_blocks(const struct beam_plan *plan, beam_real u, beam_real x[BEAM_STATES])
{
    const beam_real *phi = plan->x.phi[0], *gamma = plan->x.gamma[0];
    const beam_real *const end = x + 2 * plan->n.n_blocks;
    for (; x < end; x += 4, phi += 8, gamma += 4) {
        const beam_real a = x[0], b = x[1], c = x[2], d = x[3];
        x[0] = a + (phi[0] * a + phi[1] * b + gamma[0] * u);
        x[1] = b + (phi[2] * a + phi[3] * b + gamma[1] * u);
        x[2] = c + (phi[4] * c + phi[5] * d + gamma[2] * u);
        x[3] = d + (phi[6] * c + phi[7] * d + gamma[3] * u);
    }
}

/* beam_turn_blocks() and then beam_row_times() of output 0, while x is in registers. */
#if defined(BEAM_FLOAT) && defined(__GNUC__) && defined(__thumb2__) && defined(__ARM_FP)
/*
 * On a Cortex-M with single precision: neighbours are fetched and stored together, one instruction for four or eight, which GCC 12 does
 * not do by itself. The same sums in the same order as below, so the same bits (make target NAMES=bits). C names the registers because
 * the instructions want neighbours; what is beyond s15 is saved by one instruction, and not on the way to a step with laws, which takes the most stack.
 */
__attribute__((noinline)) static beam_real turn_and_read(const struct beam_plan *plan, beam_real u,
                                                         beam_real x[BEAM_STATES])
{
    const beam_real *phi = plan->x.phi[0], *gamma = plan->x.gamma[0], *row = plan->x.row[0];
    const beam_real *const end = x + 2 * plan->n.n_blocks;
    beam_real even = BEAM_K(0.0), odd = BEAM_K(0.0);
    while (x < end) {
        register float a __asm__("s0"), b __asm__("s1"), c __asm__("s2"), d __asm__("s3");
        register float p0 __asm__("s4"), p1 __asm__("s5"), p2 __asm__("s6"), p3 __asm__("s7");
        register float p4 __asm__("s8"), p5 __asm__("s9"), p6 __asm__("s10"), p7 __asm__("s11");
        register float g0 __asm__("s12"), g1 __asm__("s13"), g2 __asm__("s14"), g3 __asm__("s15");
        register float e __asm__("s16"), f __asm__("s17"), g __asm__("s18"), h __asm__("s19");
        register float r0 __asm__("s20"), r1 __asm__("s21"), r2 __asm__("s22"), r3 __asm__("s23");
        __asm__ volatile("vldmia %[x], {s0-s3}\n\tvldmia %[phi]!, {s4-s11}\n\tvldmia %[gamma]!, {s12-s15}"
                         : "=t"(a), "=t"(b), "=t"(c), "=t"(d), "=t"(p0), "=t"(p1), "=t"(p2), "=t"(p3), "=t"(p4),
                           "=t"(p5), "=t"(p6), "=t"(p7), "=t"(g0), "=t"(g1), "=t"(g2),
                           "=t"(g3), [phi] "+r"(phi), [gamma] "+r"(gamma)
                         : [x] "r"(x)
                         : "memory");
        e = a + (p0 * a + p1 * b + g0 * u);
        f = b + (p2 * a + p3 * b + g1 * u);
        g = c + (p4 * c + p5 * d + g2 * u);
        h = d + (p6 * c + p7 * d + g3 * u);
        __asm__ volatile("vstmia %[x]!, {s16-s19}\n\tvldmia %[row]!, {s20-s23}"
                         : "=t"(r0), "=t"(r1), "=t"(r2), "=t"(r3), [x] "+r"(x), [row] "+r"(row)
                         : "t"(e), "t"(f), "t"(g), "t"(h)
                         : "memory");
        even += r0 * e;
        odd += r1 * f;
        even += r2 * g;
        odd += r3 * h;
    }
    return even + odd;
}
#else
static beam_real turn_and_read(const struct beam_plan *plan, beam_real u, beam_real x[BEAM_STATES])
{
    const beam_real *phi = plan->x.phi[0], *gamma = plan->x.gamma[0], *row = plan->x.row[0];
    const beam_real *const end = x + 2 * plan->n.n_blocks;
    beam_real even = BEAM_K(0.0), odd = BEAM_K(0.0);
    for (; x < end; x += 4, phi += 8, gamma += 4, row += 4) {
        const beam_real a = x[0], b = x[1], c = x[2], d = x[3];
        const beam_real e = a + (phi[0] * a + phi[1] * b + gamma[0] * u);
        const beam_real f = b + (phi[2] * a + phi[3] * b + gamma[1] * u);
        const beam_real g = c + (phi[4] * c + phi[5] * d + gamma[2] * u);
        const beam_real h = d + (phi[6] * c + phi[7] * d + gamma[3] * u);
        x[0] = e;
        x[1] = f;
        x[2] = g;
        x[3] = h;
        even += row[0] * e;
        odd += row[1] * f;
        even += row[2] * g;
        odd += row[3] * h;
    }
    return even + odd;
}
#endif

void beam_add_column(int n_blocks, const beam_real gamma[BEAM_STATES], beam_real u, beam_real x[BEAM_STATES])
{
    const beam_real *const end = x + 2 * n_blocks;
    for (; x < end; x += 4, gamma += 4) {
        x[0] += gamma[0] * u;
        x[1] += gamma[1] * u;
        x[2] += gamma[2] * u;
        x[3] += gamma[3] * u;
    }
}

beam_real beam_row_times(int n_blocks, const beam_real row[BEAM_STATES], const beam_real x[BEAM_STATES])
{
    const beam_real *const end = x + 2 * n_blocks;
    beam_real even = BEAM_K(0.0), odd = BEAM_K(0.0);
    for (; x < end; x += 4, row += 4) {
        even += row[0] * x[0];
        odd += row[1] * x[1];
        even += row[2] * x[2];
        odd += row[3] * x[3];
    }
    return even + odd;
}

enum beam_status beam_linear_step(const struct beam_plan *plan, struct beam_state *state, const beam_real u[],
                                  beam_real y[])
{
    const int n_blocks = plan->n.n_blocks, inputs = plan->n.n_inputs, outputs = plan->n.n_outputs;
    const beam_real *taps = plan->x.taps;
    beam_real sum = BEAM_K(0.0);
    beam_turn_blocks(plan, state->u_last[0], state->x);
    for (int i = 1; i < inputs && i < BEAM_ALL_INPUTS; i++)
        beam_add_column(n_blocks, plan->x.gamma[i], state->u_last[i], state->x);
    for (int o = 0; o < outputs; o++) {
        beam_real value = beam_row_times(n_blocks, plan->x.row[o], state->x);
        for (int i = 0; i < inputs; i++)
            value += taps[o * inputs + i] * u[i];
        y[o] = value;
        sum += value;
    }
    for (int i = 0; i < inputs; i++)
        state->u_last[i] = u[i];
    state->k++;
    return beam_finite(sum) ? BEAM_OK : BEAM_ERROR_STATE;
}

/* The firmware's usual case by itself, so that it saves few registers: no effect, no history, one input and output. */
enum beam_status beam_step(const struct beam_plan *plan, struct beam_state *state, const beam_real u[], beam_real y[])
{
    const struct beam_plan_counts *n = &plan->n;
    if (n->n_uses != 0 || n->n_taps != 1 || n->n_inputs != 1 || n->n_outputs != 1)
        return beam_general_step(plan, state, u, y);
    const beam_real value = turn_and_read(plan, state->u_last[0], state->x) + plan->x.taps[0] * u[0];
    y[0] = value;
    state->u_last[0] = u[0];
    state->k++;
    return beam_finite(value) ? BEAM_OK : BEAM_ERROR_STATE;
}
