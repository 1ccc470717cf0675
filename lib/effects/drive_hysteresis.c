/* SPDX-License-Identifier: MIT */
/*
 * Bouc–Wen: u_eff = u − a z, dz = du (1 − (β sgn(du z) + ζ) |z|).
 *
 * While the drive moves one way the equation is piecewise linear in z. With the direction taken out (Z = ±z,
 * D = |du| ≥ 0) it reads dZ/dD = 1 + λ Z, λ = ζ − β below zero and −(β + ζ) above, so a step is taken exactly:
 * Z = Z₀ e^(λD) + D (e^(λD) − 1)/(λD), joined at the crossing of zero. The result does not depend on how
 * finely a one-way stretch of the drive is sampled, and its derivatives are exact and continuous but at a turn.
 */
#include "beam_effect.h"

/* φ(x) = (eˣ − 1)/x and its derivative; series where the difference would cancel. Returns eˣ. */
static beam_real growth(beam_real x, beam_real *phi, beam_real *phi_x)
{
    if (beam_less(beam_fabs(x), BEAM_K(0.5))) {
        beam_real sum = BEAM_K(0.0), sum_x = BEAM_K(0.0);
        for (int n = 13; n >= 0; n--) { /* φ = Σ xⁿ/(n+1)! by Horner: s ← (1 + x s)/(n + 1) */
            sum_x = (sum + x * sum_x) / (beam_real)(n + 1);
            sum = (BEAM_K(1.0) + x * sum) / (beam_real)(n + 1);
        }
        *phi = sum;
        *phi_x = sum_x;
        return BEAM_K(1.0) + x * sum;
    }
    const beam_real e = beam_exp(x);
    *phi = (e - BEAM_K(1.0)) / x;
    *phi_x = (e - *phi) / x;
    return e;
}

/* ψ(y) = ln(1 + y)/y and its derivative, y > −1. */
static void logarithm(beam_real y, beam_real *psi, beam_real *psi_y)
{
    if (beam_less(beam_fabs(y), BEAM_K(0.2))) {
        beam_real sum = BEAM_K(0.0), sum_y = BEAM_K(0.0);
        for (int n = 24; n >= 1; n--) { /* ψ = Σ (−y)ⁿ⁻¹/n */
            sum_y = -sum - y * sum_y;
            sum = BEAM_K(1.0) / (beam_real)n - y * sum;
        }
        *psi = sum;
        *psi_y = sum_y;
        return;
    }
    *psi = beam_log(BEAM_K(1.0) + y) / y;
    *psi_y = (BEAM_K(1.0) / (BEAM_K(1.0) + y) - *psi) / y;
}

struct flow {
    beam_real end, by_start, by_distance, by_lambda;
};

/* Z at the end of a stretch of length distance, from dZ/dD = 1 + λ Z. */
static struct flow flow(beam_real lambda, beam_real start, beam_real distance)
{
    beam_real phi, phi_x;
    struct flow f;
    f.by_start = growth(lambda * distance, &phi, &phi_x); /* e^(λD) */
    f.end = start * f.by_start + distance * phi;
    f.by_distance = BEAM_K(1.0) + lambda * f.end;
    f.by_lambda = distance * (start * f.by_start + distance * phi_x);
    return f;
}

struct advance {
    beam_real end, by_start, by_distance, by_below, by_above; /* the last two: by λ below and above zero */
};

/* One stretch, through zero when it is reached. Returns −1 where z would run away (|z| > 1/(ζ − β) already). */
static int advance(beam_real below, beam_real above, beam_real start, beam_real distance, struct advance *out)
{
    if (!beam_less(start, BEAM_K(0.0))) {
        const struct flow f = flow(above, start, distance);
        *out = (struct advance){f.end, f.by_start, f.by_distance, BEAM_K(0.0), f.by_lambda};
        return 0;
    }
    const beam_real y = below * start;
    if (!beam_less(-BEAM_K(1.0), y))
        return -1;
    beam_real psi, psi_y;
    logarithm(y, &psi, &psi_y);
    const beam_real to_zero = -start * psi; /* −ln(1 + λ Z₀)/λ */
    if (beam_less(distance, to_zero)) {
        const struct flow f = flow(below, start, distance);
        *out = (struct advance){f.end, f.by_start, f.by_distance, f.by_lambda, BEAM_K(0.0)};
        return 0;
    }
    const struct flow f = flow(above, BEAM_K(0.0), distance - to_zero);
    out->end = f.end;
    out->by_distance = f.by_distance;
    out->by_start = f.by_distance / (BEAM_K(1.0) + y);
    out->by_below = f.by_distance * start * start * psi_y;
    out->by_above = f.by_lambda;
    return 0;
}

static int drive(const beam_real p[], beam_real u, beam_real u_old, const beam_real z[BEAM_DRIVE_STATES],
                 struct beam_drive_output *out)
{
    const beam_real share = p[0], slip = p[1], shape = p[2];
    const beam_real du = u - u_old;
    const beam_real way = beam_less(du, BEAM_K(0.0)) ? -BEAM_K(1.0) : BEAM_K(1.0);
    struct advance a;
    if (beam_less(slip + shape, BEAM_K(0.0)) || advance(shape - slip, -(slip + shape), way * z[0], way * du, &a) != 0)
        return -1;
    out->z[0] = way * a.end;
    out->z_z[0][0] = a.by_start;
    out->z_u[0] = a.by_distance;
    out->z_u_old[0] = -a.by_distance;
    out->z_p[0][1] = -way * (a.by_below + a.by_above);
    out->z_p[0][2] = way * (a.by_below - a.by_above);
    out->u = u - share * out->z[0];
    out->u_u = BEAM_K(1.0) - share * out->z_u[0];
    out->u_u_old = -share * out->z_u_old[0];
    out->u_z[0] = -share * out->z_z[0][0];
    out->u_p[0] = -out->z[0];
    out->u_p[1] = -share * out->z_p[0][1];
    out->u_p[2] = -share * out->z_p[0][2];
    return 0;
}

const struct beam_effect BEAM_NAME(effect_drive_hysteresis) = {
    .id = "drive_hysteresis",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("the patch's moment lags its voltage (ferroelectric hysteresis)"),
    .form = BEAM_TEXT("u → u − a z, dz = du (1 − (β sgn(du z) + ζ) |z|)"),
    .source = BEAM_TEXT("Wen, Method for random vibration of hysteretic systems, Journal of the Engineering Mechanics "
                        "Division ASCE, 1976; Low and Guo, Modeling of a three-layer piezoelectric bimorph beam with "
                        "hysteresis, Journal of Microelectromechanical Systems, 1995"),
    .looks_like = BEAM_TEXT(
        "Driven response grows faster than the drive: small voltages lose the share a, large ones less. "
        "At middle levels it lags by a phase that does not depend on frequency, with odd harmonics of the "
        "drive in every channel. Hammer records are exact."),
    .confused_with = BEAM_TEXT(
        "drive_saturation: grows slower than the drive, without lag. KB: the same at every level; "
        "record 1 : 3 : 10. microslip, coulomb_friction: act in hammer records too. sensor_delay: its "
        "phase grows with frequency. Drive slowly, below mode 1, and plot deflection against voltage: "
        "a loop."),
    .target_cost =
        BEAM_TEXT("one state per patch input; one exponential a step, and one logarithm when z changes sign"),
    .step_instructions = 560,
    .n_parameters = 3,
    .parameters = {{.name = BEAM_TEXT("share"),
                    .unit = BEAM_TEXT(""),
                    .what = BEAM_TEXT("a: share of a small drive that is lost"),
                    .role = BEAM_ROLE_SHARE,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1.0,
                    .start = 0.1,
                    .flags = 0},
                   {.name = BEAM_TEXT("slip_pV"),
                    .unit = BEAM_TEXT("1/V"),
                    .what = BEAM_TEXT("β: how fast z yields when the drive goes on"),
                    .role = BEAM_ROLE_LEVEL,
                    .neutral = 0.1,
                    .minimum = 1e-6,
                    .maximum = 1e3,
                    .start = 0.1,
                    .flags = BEAM_PARAMETER_LOG | BEAM_PARAMETER_INNER},
                   {.name = BEAM_TEXT("shape_pV"),
                    .unit = BEAM_TEXT("1/V"),
                    .what =
                        BEAM_TEXT("ζ ≥ −β: part of the yielding that ignores the direction; z stays within 1/(β + ζ)"),
                    .role = BEAM_ROLE_LEVEL,
                    .neutral = 0.05,
                    .minimum = -1e3,
                    .maximum = 1e3,
                    .start = 0.05,
                    .flags = BEAM_PARAMETER_INNER}},
    .channels = BEAM_CHANNELS_PATCH_INPUT,
    .drive = drive,
};
