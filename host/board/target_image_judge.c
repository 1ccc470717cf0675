/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * target_image_judge.c — the ten-dimensional space compared with a converged one, and what it lacks under a held drive.
 *
 * A drive that jumps in every sample shakes modes far above half the sample rate too; what they do appears folded among
 * the samples, and the static responses in the space describe it badly: a per cent or so of the pulse response from
 * drive to sensor is missing. Two blocks correct it: the mode that is missed most, with its own pole, and the first two
 * samples of all that is left (faster modes have decayed by the third). Both lead from the drive to the sensor only: they
 * take no force from the laws.
 */
#include "deployment.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REFERENCE_MODES = 40, PULSE = 8192, FIRST = 2 };

/* Drive and sensor on the poles of one system; h[PULSE] from the sample after a pulse of one interval's length. */
struct path {
    const struct system *system;
    double complex *start; /* [n_poles] α β p^(d−1) (e^(p dt) − 1), twice for a pair */
    double *h;
};

static void path_free(struct path *path)
{
    free(path->start);
    free(path->h);
}

static void path_new(const struct model *model, const struct system *system, double dt_s, struct path *out)
{
    static const int orders[] = {
        [OUTPUT_DISPLACEMENT] = 0, [OUTPUT_VELOCITY] = 1, [OUTPUT_ACCELERATION] = 2, [OUTPUT_PATCH_STRAIN] = 0};
    double *g = bf_alloc(system->n, sizeof *g);
    double complex *alpha = bf_alloc(2 * system->n_poles, sizeof *alpha), *beta = alpha + system->n_poles;
    *out = (struct path){.system = system, .start = bf_alloc(system->n_poles, sizeof *out->start)};
    out->h = bf_alloc(PULSE, sizeof *out->h);
    reduced_output(system->reduced, &model->outputs[0], g);
    system_functional(system, g, alpha);
    reduced_input(system->reduced, &model->inputs[0], g);
    system_functional(system, g, beta);
    free(g);
    for (size_t k = 0; k < system->n_poles; k++) {
        const double complex p = system->p[k], turn = cexp(p * dt_s);
        const double complex held =
            cabs(p * dt_s) > 1e-9 ? (turn - 1.0) / p : dt_s; /* a free beam's own motion: p = 0 */
        double complex z = alpha[k] * beta[k] * held * (k < system->n_pairs ? 2.0 : 1.0);
        for (int i = 0; i < orders[model->outputs[0].kind]; i++)
            z *= p;
        out->start[k] = z;
        for (int j = 0; j < PULSE; j++, z *= turn)
            out->h[j] += creal(z);
    }
    free(alpha);
}

static double square_from(int first, const double x[PULSE])
{
    double sum = 0.0;
    for (int j = first; j < PULSE; j++)
        sum += x[j] * x[j];
    return sum;
}

/* ---- What the space lacks ---- */

/* lack[PULSE] less the part of one pole pair. */
static void take_pair(const struct path *reference, size_t k, double dt_s, double lack[PULSE])
{
    const double complex turn = cexp(reference->system->p[k] * dt_s);
    double complex z = reference->start[k];
    for (int j = 0; j < PULSE; j++, z *= turn)
        lack[j] -= creal(z);
}

/* The pair that leaves least behind the first samples; false when none improves. */
static bool find_pair(const struct path *reference, double dt_s, const double lack[PULSE], size_t *best)
{
    double *rest = bf_alloc(PULSE, sizeof *rest), least = square_from(FIRST, lack);
    bool found = false;
    for (size_t k = 0; k < reference->system->n_pairs; k++) {
        memcpy(rest, lack, PULSE * sizeof *rest);
        take_pair(reference, k, dt_s, rest);
        const double left = square_from(FIRST, rest);
        if (!(left < least))
            continue;
        least = left;
        *best = k;
        found = true;
    }
    free(rest);
    return found;
}

/* Blocks that the ten-dimensional model takes. */
static int blocks_of(const struct system *s)
{
    return (int)(s->n_pairs + (s->n_poles - s->n_pairs + 1) / 2);
}

static void mend(const struct path *reference, double dt_s, int room, double lack[PULSE], struct deployment *d)
{
    size_t k;
    if (room > 1 && find_pair(reference, dt_s, lack, &k)) {
        const double complex turn = cexp(reference->system->p[k] * dt_s), start = reference->start[k];
        take_pair(reference, k, dt_s, lack);
        d->beside[d->n_beside++] =
            (struct beside){.phi = {creal(turn) - 1.0, -cimag(turn), cimag(turn), creal(turn) - 1.0},
                            .row = {creal(start), -cimag(start)}};
    }
    if (room > 0) { /* x₀ is the drive a sample ago, x₁ two samples ago */
        d->beside[d->n_beside++] = (struct beside){.phi = {-1.0, 0.0, 1.0, -1.0}, .row = {lack[0], lack[1]}};
        memset(lack, 0, FIRST * sizeof *lack);
    }
}

/* Gains of the patch, which the paths leave out. */
static void scale_rows(struct deployment *d)
{
    const double gain = model_input_gain(&d->model, 0) * model_output_gain(&d->model, 0);
    for (int i = 0; i < d->n_beside; i++) {
        d->beside[i].row[0] *= gain;
        d->beside[i].row[1] *= gain;
    }
}

/* ---- Judgement ---- */

static void judge_paths(struct deployment *d, const struct system *reference_system, bool mending,
                        struct target_image *image)
{
    const double dt_s = image->dt_s;
    struct path deployed, reference;
    path_new(&d->model, d->system, dt_s, &deployed);
    path_new(&d->model, reference_system, dt_s, &reference);
    double *lack = bf_alloc(PULSE, sizeof *lack);
    for (int j = 0; j < PULSE; j++)
        lack[j] = reference.h[j] - deployed.h[j];
    const double whole = square_from(0, reference.h), off = square_from(0, lack);
    if (mending && isfinite(whole) && isfinite(off))
        mend(&reference, dt_s, BEAM_BLOCKS - blocks_of(d->system), lack, d);
    scale_rows(d);
    image->held_error = whole > 0.0 ? sqrt(square_from(0, lack) / whole) : (double)NAN;
    free(lack);
    path_free(&deployed);
    path_free(&reference);
}

enum bf_status deploy_judge(struct deployment *d, bool mending, struct target_image *image, struct bf_error *err)
{
    const double two_pi = 2.0 * acos(-1.0), top_rad = 0.5 * two_pi * image->board.sample_Hz;
    const struct reduced_options options = {
        .top_rad = 4.0 * top_rad, .min_modes = BEAM_N + 6, .max_modes = REFERENCE_MODES, .statics = 2};
    struct reduced reduced;
    struct system *reference = NULL;
    enum bf_status status = reduced_new(&d->model, &options, &reduced, err);
    if (status != BF_OK)
        return status;
    status = system_new(&d->model, &reduced, &d->map, &reference, err);
    if (status == BF_OK)
        status = system_evaluate(reference, d->theta, NULL, err);
    image->in_band = 0;
    for (size_t k = 0; status == BF_OK && k < BEAM_N; k++) {
        image->frequency_Hz[k] = d->system->omega_rad[k] / two_pi;
        const bool rigid =
            reference->omega_rad[k] < 1e-6 * reference->omega_rad[BEAM_N - 1]; /* a free beam's own motion */
        image->relative_error[k] = rigid ? (double)NAN : d->system->omega_rad[k] / reference->omega_rad[k] - 1.0;
        image->in_band += reference->omega_rad[k] < top_rad;
    }
    if (status == BF_OK) {
        image->band_is_wider = image->n_modes < BEAM_N && reference->omega_rad[image->n_modes] < top_rad;
        judge_paths(d, reference, mending && d->model.outputs[0].kind != OUTPUT_ACCELERATION, image);
    }
    system_free(reference);
    reduced_free(&reduced);
    return status;
}
