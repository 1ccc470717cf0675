/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity_added.c — sinusoids of constant amplitude, offsets and drifts in a series that no input has. */
#include "linearity_added.h"
#include "maths/maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    LEAST_SAMPLES = 256,
    PIECES = 6, /* of the record, in which a line must have one amplitude and phase */
    FAR = 24,
    NEAR = 4 /* bins to either side whose power is the background of a line */
};
static const double line_power = 40.0;   /* of a peak over the median around it; noise: once in 10⁵ spectra */
static const double line_sds = 12.0;     /* of a line's amplitude: steady drives leave ripples of up to 10 */
static const double line_scatter = 0.03; /* of its amplitude over the pieces, relative; a mode decays faster */
static const double offset_sds = 6.0;

/* Power of x, Blackman–Harris window: [n/2 + 1]. */
static double *power_spectrum(const double *x, size_t n)
{
    struct bf_error ignored;
    double *power = bf_alloc(n / 2 + 1, sizeof *power);
    if (spectrum_amplitude(x, n, WINDOW_BLACKMAN_HARRIS, power, &ignored) != BF_OK)
        memset(power, 0, (n / 2 + 1) * sizeof *power);
    for (size_t k = 0; k <= n / 2; k++)
        power[k] *= power[k];
    return power;
}

/* Median power of the bins around k. */
static double background(const double *power, size_t n_bins, size_t k)
{
    double around[2 * FAR];
    size_t n = 0;
    for (size_t d = NEAR + 1; d <= FAR; d++) {
        if (k > d)
            around[n++] = power[k - d];
        if (k + d < n_bins)
            around[n++] = power[k + d];
    }
    sort_ascending(n, around);
    return n > 0 ? around[n / 2] : 0.0;
}

/* Complex amplitude 2/Σw Σ w x e^(−iωt) of x[from … to) by a Hann window; t counts from sample 0. */
static double complex demodulate(const double *x, size_t from, size_t to, double omega)
{
    const double complex turn = CMPLX(cos(omega), -sin(omega));
    double complex phasor = CMPLX(cos(omega * (double)from), -sin(omega * (double)from)), sum = 0.0;
    double weight = 0.0;
    for (size_t t = from; t < to; t++) {
        const double w = 1.0 - cos(2.0 * M_PI * ((double)(t - from) + 0.5) / (double)(to - from));
        sum += CMPLX(w * x[t] * creal(phasor), w * x[t] * cimag(phasor));
        phasor = CMPLX(creal(phasor) * creal(turn) - cimag(phasor) * cimag(turn),
                       creal(phasor) * cimag(turn) + cimag(phasor) * creal(turn));
        weight += w;
    }
    return 2.0 * sum / weight;
}

/* Frequency (rad per sample) near `omega` from the phase between the record's halves, twice. */
static double refine(const double *x, size_t n, double omega)
{
    const size_t half = n / 2, later = n - half;
    for (int pass = 0; pass < 3; pass++) {
        const double complex a = demodulate(x, 0, half, omega), b = demodulate(x, later, n, omega);
        omega += carg(b * conj(a)) / (double)later;
    }
    return omega;
}

/* Is the line as strong and in phase in every piece? sd: of a piece's complex amplitude by the background. */
static bool is_steady(const double *x, size_t n, double omega, double sd)
{
    double complex a[PIECES], mean = 0.0;
    double scatter = 0.0;
    for (size_t p = 0; p < PIECES; p++) {
        a[p] = demodulate(x, p * n / PIECES, (p + 1) * n / PIECES, omega);
        mean += a[p] / PIECES;
    }
    for (size_t p = 0; p < PIECES; p++)
        scatter += creal((a[p] - mean) * conj(a[p] - mean)) / PIECES;
    return sqrt(scatter) < fmax(line_scatter * cabs(mean), 3.0 * sd);
}

static bool input_has(const double *const u_power[], size_t n_inputs, size_t n_bins, size_t k)
{
    for (size_t i = 0; i < n_inputs; i++) {
        const double around = background(u_power[i], n_bins, k);
        for (size_t j = k > NEAR ? k - NEAR : 0; j <= k + NEAR && j < n_bins; j++)
            if (u_power[i][j] > line_power * around)
                return true;
    }
    return false;
}

static bool judge_line(const double *x, size_t n, double dt_s, size_t k, double around, struct linearity_added *out)
{
    const double omega = refine(x, n, 2.0 * M_PI * (double)k / (double)n);
    if (!(fabs(omega * (double)n / (2.0 * M_PI) - (double)k) < 2.0))
        return false;
    const double complex a = demodulate(x, 0, n, omega);
    const double sd = sqrt(around / M_LN2); /* of a complex amplitude over the whole record */
    if (!(cabs(a) > line_sds * sd) || !is_steady(x, n, omega, sd * sqrt((double)PIECES)))
        return false;
    *out = (struct linearity_added){
        .frequency_Hz = omega / (2.0 * M_PI * dt_s), .amplitude = cabs(a), .phase_rad = carg(a) + 0.5 * M_PI, .sd = sd};
    return true;
}

static size_t find_lines(const double *x, size_t n, double dt_s, const double *const u[], size_t n_inputs,
                         struct linearity_added found[], size_t room)
{
    const size_t n_bins = n / 2 + 1;
    size_t count = 0;
    double *power = power_spectrum(x, n), **u_power = bf_alloc(n_inputs + 1, sizeof *u_power);
    for (size_t i = 0; i < n_inputs; i++)
        u_power[i] = power_spectrum(u[i], n);
    for (size_t k = 2 * PIECES; k + NEAR < n_bins && count < room; k++) { /* two periods a piece */
        if (!(power[k] > power[k - 1] && power[k] >= power[k + 1]))
            continue;
        const double around = background(power, n_bins, k);
        if (power[k] > line_power * around && !input_has((const double *const *)u_power, n_inputs, n_bins, k) &&
            judge_line(x, n, dt_s, k, around, &found[count]))
            count++;
    }
    for (size_t i = 0; i < n_inputs; i++)
        free(u_power[i]);
    free(u_power);
    free(power);
    return count;
}

/* Mean of x[n] by a Blackman–Harris window, which a ringing beam does not leak into, and its standard error by bins 5 to 8. */
static double slow_mean(const double *x, size_t n, double *sd)
{
    double *w = bf_alloc(n, sizeof *w), *power = power_spectrum(x, n), top = 0.0, bottom = 0.0, slow = 0.0;
    window_fill(WINDOW_BLACKMAN_HARRIS, n, w);
    for (size_t i = 0; i < n; i++) {
        top += w[i] * x[i];
        bottom += w[i];
    }
    for (size_t k = 5; k <= 8; k++)
        slow += power[k] / 4.0;
    *sd = sqrt(0.5 * slow); /* an amplitude is single-sided, of two components */
    free(w);
    free(power);
    return top / bottom;
}

/* Offset and drift from the means of both halves. */
static size_t find_offset(const double *x, size_t n, struct linearity_added found[], size_t room)
{
    double sd1, sd2;
    const double a1 = slow_mean(x, n / 2, &sd1), a2 = slow_mean(x + n - n / 2, n / 2, &sd2), sd = hypot(sd1, sd2);
    const double mean = 0.5 * (a1 + a2), drift = 2.0 * (a2 - a1);
    size_t count = 0;
    if (fabs(mean) > offset_sds * 0.5 * sd && count < room)
        found[count++] = (struct linearity_added){.amplitude = mean, .sd = 0.5 * sd};
    if (fabs(drift) > offset_sds * 2.0 * sd && count < room)
        found[count++] = (struct linearity_added){.amplitude = drift, .sd = 2.0 * sd, .drift = true};
    return count;
}

size_t linearity_find_added(const double x[], size_t n, double dt_s, const double *const u[], size_t n_inputs,
                            struct linearity_added found[], size_t room)
{
    if (n < LEAST_SAMPLES || !(root_mean_square(x, n) > 0.0))
        return 0;
    const size_t offsets = find_offset(x, n, found, room);
    return offsets + find_lines(x, n, dt_s, u, n_inputs, found + offsets, room - offsets);
}

double linearity_added_at(const struct linearity_added *added, size_t i, size_t n, double dt_s)
{
    if (added->drift)
        return added->amplitude * ((double)i / (double)n - 0.5);
    if (added->frequency_Hz > 0.0)
        return added->amplitude * sin(2.0 * M_PI * added->frequency_Hz * (double)i * dt_s + added->phase_rad);
    return added->amplitude;
}
