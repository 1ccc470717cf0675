/* SPDX-License-Identifier: GPL-3.0-or-later */
/* target_image_tracking.c — the modes that a controller follows: which, and how the sensor hears them. firmware/track.h follows them. */
#include "deployment.h"

#include <complex.h>
#include <math.h>
#include <string.h>

/* Parameters may wander by their first uncertainty within so many averaging_s. */
static const double wander_shares = 2000.0;

static double complex pole_of(const beam_real psi[4])
{
    const double half = 0.5 * (psi[0] + psi[3]);
    return CMPLX(1.0 + half, sqrt(psi[0] * psi[3] - psi[1] * psi[2] - half * half));
}

/* What a filter of the sensor makes of a motion that turns by `pole` a sample; maps and signals let it pass. */
static double complex link_response(const struct beam_plan *plan, int c, double complex pole)
{
    const struct beam_link *link = &plan->n.link[0][c];
    double complex sum = 0.0, delayed = cpow(pole, -link->wait);
    if (link->n_taps == 0)
        return 1.0;
    for (int i = 0; i < link->n_taps; i++, delayed /= pole)
        sum += plan->x.taps[link->tap + i] * delayed;
    return sum + plan->x.link_gamma[0][c] * delayed / (1.0 - (1.0 + plan->x.link_phi[0][c]) / pole);
}

/* The block's complex amplitude is the one whose real part is its first coordinate. */
static double complex heard(const struct beam_plan *plan, int b)
{
    const beam_real *psi = plan->x.phi[b], *row = &plan->x.row[0][2 * b];
    const double complex pole = pole_of(psi);
    const double half = 0.5 * (psi[0] + psi[3]);
    double complex all = CMPLX(row[0] + row[1] * (half - psi[0]) / psi[1], row[1] * cimag(pole) / psi[1]);
    for (int c = 0; c < plan->n.n_links[0]; c++)
        all *= link_response(plan, c, pole);
    return all * cpow(pole, 1 - plan->n.output_ring[0].length);
}

/*
 * The observed blocks that are the beam's lowest modes. Others of the space stand for what is faster; they oscillate too, strongly damped.
 * A mode's block is the one whose pole is nearest to i ω of it, and nearer than this part of ω.
 */
static const double mode_reach = 0.3;

static size_t choose(const struct target_image *image, int blocks[BEAM_TRACKED])
{
    size_t n = 0;
    uint32_t left = image->file.front.observer.blocks;
    for (size_t k = 0; k < image->in_band && k < image->n_modes && n < BEAM_TRACKED; k++) {
        const double complex wanted = CMPLX(0.0, 2.0 * acos(-1.0) * image->frequency_Hz[k]);
        double least = mode_reach;
        int nearest = -1;
        for (int b = 0; b < BEAM_BLOCKS; b++) {
            const double off = (left >> b & 1u) != 0
                                   ? cabs(clog(pole_of(image->plan.x.phi[b])) / (image->dt_s * wanted) - 1.0)
                                   : 2.0 * mode_reach;
            if (off < least) {
                least = off;
                nearest = b;
            }
        }
        if (nearest < 0)
            continue;
        blocks[n++] = nearest;
        left &= ~(1u << nearest);
    }
    return n;
}

enum bf_status deploy_tracking(struct target_image *image, struct bf_error *err)
{
    struct beam_image_tracking *out = &image->file.front.tracking;
    int blocks[BEAM_TRACKED];
    const size_t n = choose(image, blocks);
    if (n == 0)
        return bf_fail(err, BF_BAD_FILE, "there is no mode to track: none oscillates below 0.45 of the sample rate");
    for (size_t i = 0; i < n; i++)
        out->blocks |= 1u << blocks[i];
    size_t at = 0;
    for (int b = 0; b < BEAM_BLOCKS; b++)
        if ((out->blocks >> b & 1u) != 0) {
            const double complex h = heard(&image->plan, b);
            out->heard[at][0] = (float)creal(h);
            out->heard[at++][1] = (float)cimag(h);
        }
    out->wander_s = (float)(wander_shares * image->board.averaging_s);
    out->kappa = (float)fmin(2.0 * image->dt_s / image->observer_s, 0.5);
    image->n_tracked = n;
    return BF_OK;
}
