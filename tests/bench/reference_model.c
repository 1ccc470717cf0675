/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "reference_model.h"

#include <cblas.h>
#include <complex.h>
#include <fftw3.h>
#include <lapacke.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const reference_names[PARAMETERS] = {"EI_beam_Nm2",    "EI_patch_Nm2",  "rho_beam_kgpm",
                                                 "rho_patch_kgpm", "cDI_beam_sNm2", "cDI_patch_sNm2",
                                                 "gamma_sNpm2",    "Ks_V",          "KB_NmpV"};

enum { ELEMENTS = 44, DOF = 2 * ELEMENTS };

/* What is measured with the patch as drive, and with the hammer. */
static const enum channel_kind reference_channels[2][CHANNELS] = {{CHANNEL_ACCELERATION, CHANNEL_VELOCITY},
                                                                  {CHANNEL_PIEZO, CHANNEL_NONE}};
static const double length_m = 0.4573, patch_from_m = 0.02535, patch_to_m = 0.08905;
static const double hammer_at_m = 0.0254, accel_at_m = 0.0214, tip_at_m = 0.44;

/* Nodes: 6 elements before the patch, 10 on it, the rest behind. */
static double node_m(int i)
{
    const int before = 6, on = 10, behind = ELEMENTS - before - on;
    if (i <= before)
        return patch_from_m * i / before;
    if (i <= before + on)
        return patch_from_m + (patch_to_m - patch_from_m) * (i - before) / on;
    return patch_to_m + (length_m - patch_to_m) * (i - before - on) / behind;
}

/* Hermite cubics of an element of length h at s in [0, 1]: value or first derivative. */
static void hermite(double s, double h, int derivative, double out[4])
{
    if (derivative == 0) {
        out[0] = 1 - 3 * s * s + 2 * s * s * s;
        out[1] = h * (s - 2 * s * s + s * s * s);
        out[2] = 3 * s * s - 2 * s * s * s;
        out[3] = h * (s * s * s - s * s);
    } else {
        out[0] = (-6 * s + 6 * s * s) / h;
        out[1] = 1 - 4 * s + 3 * s * s;
        out[2] = (6 * s - 6 * s * s) / h;
        out[3] = 3 * s * s - 2 * s;
    }
}

static void point_vector(double x, int derivative, double scale, double v[DOF])
{
    int e = 0;
    while (e < ELEMENTS - 1 && node_m(e + 1) <= x)
        e++;
    double h = node_m(e + 1) - node_m(e), phi[4];
    hermite((x - node_m(e)) / h, h, derivative, phi);
    for (int i = 0; i < 4; i++)
        if (2 * e + i >= 2)
            v[2 * e + i - 2] += scale * phi[i];
}

struct matrices {
    double M[DOF * DOF], K[DOF * DOF], C[DOF * DOF];
};

static void assemble(const double p[PARAMETERS], struct matrices *m)
{
    memset(m, 0, sizeof *m);
    for (int e = 0; e < ELEMENTS; e++) {
        double h = node_m(e + 1) - node_m(e), middle = 0.5 * (node_m(e) + node_m(e + 1));
        int patch = middle > patch_from_m && middle < patch_to_m;
        const double mass[4][4] = {{156, 22 * h, 54, -13 * h},
                                   {22 * h, 4 * h * h, 13 * h, -3 * h * h},
                                   {54, 13 * h, 156, -22 * h},
                                   {-13 * h, -3 * h * h, -22 * h, 4 * h * h}};
        const double stiff[4][4] = {{12, 6 * h, -12, 6 * h},
                                    {6 * h, 4 * h * h, -6 * h, 2 * h * h},
                                    {-12, -6 * h, 12, -6 * h},
                                    {6 * h, 2 * h * h, -6 * h, 4 * h * h}};
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                int row = 2 * e + i - 2, column = 2 * e + j - 2;
                if (row < 0 || column < 0)
                    continue;
                size_t at = (size_t)row * DOF + (size_t)column;
                double mm = mass[i][j] * h / 420, kk = stiff[i][j] / (h * h * h);
                m->M[at] += p[patch ? P_RHO_PATCH : P_RHO_BEAM] * mm;
                m->K[at] += p[patch ? P_EI_PATCH : P_EI_BEAM] * kk;
                m->C[at] += p[patch ? P_CDI_PATCH : P_CDI_BEAM] * kk + p[P_GAMMA] * mm;
            }
    }
}

static void *array(size_t n)
{
    void *x = calloc(n, sizeof(double));
    if (x == NULL) {
        fputs("reference: memory is out\n", stderr);
        exit(1);
    }
    return x;
}

/* x' = A x + B u with x = (ω q, q') in modal coordinates, so that A is balanced; rows of output: y = R x + d u. */
struct state_space {
    double A[STATES * STATES], B[STATES];
    double R[CHANNELS][STATES], d[CHANNELS];
};

static void modal_vector(const double *V, const double v[DOF], double out[MODES])
{
    for (int k = 0; k < MODES; k++)
        out[k] = cblas_ddot(DOF, V + (size_t)k * DOF, 1, v, 1);
}

static void output_rows(const double p[PARAMETERS], int hammer, const double *V, const double *w, struct state_space *s)
{
    for (int c = 0; c < CHANNELS; c++) {
        enum channel_kind kind = reference_channels[hammer][c];
        double v[DOF] = {0}, g[MODES];
        if (kind == CHANNEL_PIEZO) {
            point_vector(patch_to_m, 1, p[P_KS], v);
            point_vector(patch_from_m, 1, -p[P_KS], v);
        } else if (kind != CHANNEL_NONE) {
            point_vector(kind == CHANNEL_VELOCITY ? tip_at_m : accel_at_m, 0, 1, v);
        }
        modal_vector(V, v, g);
        if (kind == CHANNEL_ACCELERATION) { /* row of the acceleration itself */
            cblas_dgemv(CblasRowMajor, CblasTrans, MODES, STATES, 1, s->A + MODES * STATES, STATES, g, 1, 0, s->R[c],
                        1);
            s->d[c] = cblas_ddot(MODES, g, 1, s->B + MODES, 1);
        } else if (kind == CHANNEL_VELOCITY) {
            memcpy(s->R[c] + MODES, g, sizeof g);
        } else {
            for (int k = 0; k < MODES; k++)
                s->R[c][k] = g[k] / w[k];
        }
    }
}

/* Lowest modes: w[MODES] (rad/s), V[MODES][DOF] of unit mass, modal damping. Solved as M v = µ K v with the largest
 * µ = 1/ω², which keeps the low modes to full precision; K v = ω² M v would not. */
static void modes(const double p[PARAMETERS], double w[DOF], double *V, double damping[MODES * MODES])
{
    struct matrices *m = array(sizeof *m / sizeof(double));
    double *CV = array(MODES * DOF);
    lapack_int found, fail[DOF];
    assemble(p, m);
    if (LAPACKE_dsygvx(LAPACK_COL_MAJOR, 1, 'V', 'I', 'U', DOF, m->M, DOF, m->K, DOF, 0, 0, DOF - MODES + 1, DOF, 0,
                       &found, w, V, DOF, fail) != 0) {
        fputs("reference: the stiffness matrix is not positive\n", stderr);
        exit(1);
    }
    for (int k = 0; k < MODES; k++) {
        w[k] = 1 / sqrt(w[k]);
        cblas_dscal(DOF, w[k], V + (size_t)k * DOF, 1); /* vᵀ M v = 1 */
    }
    cblas_dsymm(CblasColMajor, CblasLeft, CblasUpper, DOF, MODES, 1, m->C, DOF, V, DOF, 0, CV, DOF);
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, MODES, MODES, DOF, 1, V, DOF, CV, DOF, 0, damping, MODES);
    free(m);
    free(CV);
}

static void make_state_space(const double p[PARAMETERS], int hammer, const double *w, const double *V,
                             const double damping[MODES * MODES], struct state_space *s)
{
    double load[DOF] = {0};
    memset(s, 0, sizeof *s);
    for (int i = 0; i < MODES; i++) {
        s->A[i * STATES + MODES + i] = w[i];
        s->A[(MODES + i) * STATES + i] = -w[i];
        for (int j = 0; j < MODES; j++)
            s->A[(MODES + i) * STATES + MODES + j] = -damping[i + j * MODES];
    }
    if (hammer) {
        point_vector(hammer_at_m, 0, 1, load);
    } else {
        point_vector(patch_to_m, 1, p[P_KB], load);
        point_vector(patch_from_m, 1, -p[P_KB], load);
    }
    modal_vector(V, load, s->B + MODES);
    output_rows(p, hammer, V, w, s);
}

enum { AUGMENTED = STATES + 2 };

/* exp of the matrix [A B 0; 0 0 1; 0 0 0]·h: the hold's Γ beside Φ. Taylor series with scaling and squaring. */
static void exponential(const struct state_space *s, double h, double E[AUGMENTED * AUGMENTED])
{
    enum { N = AUGMENTED, TERMS = 12 };
    double *X = array(N * N), *T = array(N * N), *next = array(N * N), norm = 0;
    for (int i = 0; i < STATES; i++) {
        double row = fabs(s->B[i]) * h;
        for (int j = 0; j < STATES; j++)
            row += fabs(X[i * N + j] = s->A[i * STATES + j] * h);
        X[i * N + STATES] = s->B[i] * h;
        norm = fmax(norm, row);
    }
    X[STATES * N + STATES + 1] = 1; /* ramp over one interval */
    int squarings = norm > 0.25 ? (int)ceil(log2(norm / 0.25)) : 0;
    cblas_dscal(N * N, ldexp(1, -squarings), X, 1);
    memset(E, 0, sizeof(double) * N * N);
    for (int i = 0; i < N; i++)
        E[i * N + i] = T[i * N + i] = 1;
    for (int k = 1; k <= TERMS; k++) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, N, N, N, 1.0 / k, T, N, X, N, 0, next, N);
        memcpy(T, next, sizeof(double) * N * N);
        cblas_daxpy(N * N, 1, T, 1, E, 1);
    }
    for (int k = 0; k < squarings; k++) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, N, N, N, 1, E, N, E, N, 0, next, N);
        memcpy(E, next, sizeof(double) * N * N);
    }
    free(X);
    free(T);
    free(next);
}

/*
 * One sample: x⁺ = S [x; u_0 … u_P]. One substep is x⁺ = Φx + Γ0 u_0 + Γ1 u_1; twice P substeps are P substeps after P
 * substeps: S_2P = [F F, F G + shifted G], so that log2 P doublings suffice.
 */
static void sample_matrix(const double E[AUGMENTED * AUGMENTED], double S[STATES * WIDTH])
{
    double *next = array(STATES * WIDTH);
    memset(S, 0, sizeof(double) * STATES * WIDTH);
    for (int i = 0; i < STATES; i++) { /* u(t) = u_0 + (u_1 − u_0) t/h */
        double step = E[i * AUGMENTED + STATES], ramp = E[i * AUGMENTED + STATES + 1];
        memcpy(S + i * WIDTH, E + i * AUGMENTED, sizeof(double) * STATES);
        S[i * WIDTH + STATES] = step - ramp;
        S[i * WIDTH + STATES + 1] = ramp;
    }
    for (int p = 1; p < OVERSAMPLE; p *= 2) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, STATES, STATES + p + 1, STATES, 1, S, WIDTH, S, WIDTH, 0,
                    next, WIDTH);
        for (int i = 0; i < STATES; i++)
            for (int j = 0; j <= p; j++)
                next[i * WIDTH + STATES + p + j] += S[i * WIDTH + STATES + j];
        memcpy(S, next, sizeof(double) * STATES * WIDTH);
        memset(next, 0, sizeof(double) * STATES * WIDTH);
    }
    free(next);
}

void reference_prepare(const double p[PARAMETERS], struct reference_system system[2])
{
    double w[DOF], *V = array(MODES * DOF), *damping = array(MODES * MODES), *E = array(AUGMENTED * AUGMENTED);
    struct state_space *s = array(sizeof *s / sizeof(double));
    modes(p, w, V, damping);
    for (int hammer = 0; hammer < 2; hammer++) {
        make_state_space(p, hammer, w, V, damping, s);
        exponential(s, SAMPLE_S / OVERSAMPLE, E);
        sample_matrix(E, system[hammer].S);
        memcpy(system[hammer].R, s->R, sizeof s->R);
        memcpy(system[hammer].d, s->d, sizeof s->d);
    }
    free(V);
    free(damping);
    free(E);
    free(s);
}

void reference_simulate(const struct reference_system *system, const struct reference_record *record, size_t n,
                        double *const y[CHANNELS])
{
    double x[WIDTH] = {0}, next[STATES];
    for (size_t k = 0; k < n; k++) {
        const double *u = record->u + k * OVERSAMPLE;
        for (int c = 0; c < CHANNELS; c++)
            if (record->kind[c] != CHANNEL_NONE)
                y[c][k] = cblas_ddot(STATES, system->R[c], 1, x, 1) + system->d[c] * u[0];
        memcpy(x + STATES, u, sizeof(double) * INPUTS);
        cblas_dgemv(CblasRowMajor, CblasNoTrans, STATES, WIDTH, 1, system->S, WIDTH, x, 1, 0, next, 1);
        memcpy(x, next, sizeof next);
    }
}

/* Band-limited interpolation by zero padding of the spectrum. */
static double *interpolate(const double *u, size_t n)
{
    size_t fine = n * OVERSAMPLE;
    double *out = array(fine + 1), *in = array(n);
    fftw_complex *spectrum = fftw_alloc_complex(fine / 2 + 1);
    fftw_plan forward = fftw_plan_dft_r2c_1d((int)n, in, spectrum, FFTW_ESTIMATE);
    memcpy(in, u, n * sizeof *u);
    fftw_execute(forward);
    for (size_t k = n / 2; k <= fine / 2; k++)
        spectrum[k] = 0;
    fftw_plan back = fftw_plan_dft_c2r_1d((int)fine, spectrum, out, FFTW_ESTIMATE);
    fftw_execute(back);
    cblas_dscal((int)fine, 1.0 / (double)n, out, 1);
    out[fine] = out[fine - 1];
    fftw_destroy_plan(forward);
    fftw_destroy_plan(back);
    fftw_free(spectrum);
    free(in);
    return out;
}

void reference_read(const char *path, struct reference_record *out)
{
    enum { MOST = 1 << 16, LINE = 512 };
    char line[LINE], *end;
    double *column[3] = {array(MOST), array(MOST), array(MOST)}, t = 0;
    memset(out, 0, sizeof *out);
    FILE *file = fopen(path, "r");
    while (file != NULL && fgets(line, LINE, file) != NULL && out->n < MOST) {
        if (line[0] == '#')
            continue;
        if (strncmp(line, "time_s", 6) == 0) {
            out->hammer = strstr(line, "hammer_N") != NULL;
            memcpy(out->kind, reference_channels[out->hammer], sizeof out->kind);
            continue;
        }
        t = strtod(line, &end);
        for (int c = 0; c < (out->hammer ? 2 : 3); c++)
            column[c][out->n] = strtod(end + 1, &end);
        out->n++;
    }
    if (file == NULL || out->n < 2) {
        fprintf(stderr, "reference: cannot read %s\n", path);
        exit(1);
    }
    fclose(file);
    if (fabs(t - SAMPLE_S * (double)(out->n - 1)) > 1e-5) {
        fprintf(stderr, "reference: %s is not sampled at 1/%g s\n", path, 1 / SAMPLE_S);
        exit(1);
    }
    out->u = interpolate(column[0], out->n);
    free(column[0]);
    for (int c = 0; c < CHANNELS; c++) {
        out->z[c] = column[c + 1];
        out->rms[c] = cblas_dnrm2((int)out->n, column[c + 1], 1) / sqrt((double)out->n);
    }
}
