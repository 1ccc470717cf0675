/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The reduced basis: lowest normal modes, and static vectors that answer for the modes left out. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double *keep_free(const struct truth_assembly *fe, const double *full)
{
    double *small = truth_array(fe->kept * fe->kept);
    size_t k = 0;
    for (size_t i = 0; i < fe->n; i++)
        for (size_t j = 0; !fe->fixed[i] && j < fe->n; j++)
            if (!fe->fixed[j])
                small[k++] = full[i * fe->n + j];
    return small;
}

/* Static responses (K + σM)⁻¹ φ^(d) of the places where something pulls or listens, appended as columns `first`… of
 * basis [kept × columns]: with them the modes that are left out still answer slow forces. Returns the columns filled. */
static size_t add_static(const struct truth_assembly *fe, const struct truth_spec *spec, const double *K,
                         const double *M, size_t columns, size_t first, double *basis)
{
    struct place {
        double at_m;
        int derivative;
        double less_at_m; /* > 0: the value there is taken off */
    } places[TRUTH_STATIC];
    size_t n_places = 0;
    places[n_places++] = (struct place){fe->mesh.patch_to_m, 1, 0};
    places[n_places++] = (struct place){fe->mesh.patch_from_m, 1, 0};
    for (size_t i = 0; i < spec->n_inputs; i++)
        if (spec->input[i].kind == TRUTH_POINT_FORCE)
            places[n_places++] = (struct place){spec->input[i].at_m, 0, 0};
    for (size_t i = 0; i < spec->n_outputs; i++)
        if (spec->output[i].kind != TRUTH_PATCH_STRAIN)
            places[n_places++] = (struct place){spec->output[i].at_m, 0, 0};
    for (size_t i = 0; i < spec->n_effects; i++) {
        const struct truth_effect *effect = &spec->effect[i];
        const double half_m = effect->parameter[2] / 2; /* of a crack's span: it pulls with a pair of moments */
        double at_m;
        if (truth_effect_place(spec, effect, &at_m))
            places[n_places++] = effect->kind == TRUTH_BILINEAR_STIFFNESS
                                     ? (struct place){at_m + half_m, 1, at_m - half_m}
                                     : (struct place){at_m, 0, 0};
    }
    double *row = truth_array(fe->n), *less = truth_array(fe->n), *load = truth_array(fe->kept),
           *S = truth_array(fe->kept * fe->kept);
    size_t filled = 0;
    for (size_t k = 0; k < n_places && first + filled < columns; k++) {
        truth_mesh_row(&fe->mesh, places[k].at_m, places[k].derivative, row);
        if (places[k].less_at_m > 0)
            truth_mesh_row(&fe->mesh, places[k].less_at_m, places[k].derivative, less);
        for (size_t i = 0, j = 0; i < fe->n; i++)
            if (!fe->fixed[i])
                load[j++] = places[k].less_at_m > 0 ? row[i] - less[i] : row[i];
        for (size_t i = 0; i < fe->kept * fe->kept; i++)
            S[i] = K[i] + M[i];
        if (truth_solve_spd(fe->kept, S, load) != 0)
            continue;
        for (size_t i = 0; i < fe->kept; i++)
            basis[i * columns + first + filled] = load[i];
        filled++;
    }
    free(row);
    free(less);
    free(load);
    free(S);
    return filled;
}

/* basis_aᵀ M basis_b, M of bandwidth 3 as a beam's matrices are */
static double banded_product(size_t n, size_t columns, const double *M, const double *basis, size_t a, size_t b)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        double part = 0;
        for (size_t j = i > 3 ? i - 3 : 0; j < n && j <= i + 3; j++)
            part += M[i * n + j] * basis[j * columns + b];
        sum += basis[i * columns + a] * part;
    }
    return sum;
}

/* M-orthonormalises columns first… by Gram–Schmidt, twice; a column that is nothing new is dropped. Returns the
 * columns left. */
static size_t orthonormalise(size_t n, size_t columns, const double *M, size_t first, size_t last, double *basis)
{
    for (size_t k = first; k < last;) {
        double before = sqrt(banded_product(n, columns, M, basis, k, k));
        for (int pass = 0; pass < 2; pass++)
            for (size_t j = 0; j < k; j++) {
                double share = banded_product(n, columns, M, basis, j, k);
                for (size_t i = 0; i < n; i++)
                    basis[i * columns + k] -= share * basis[i * columns + j];
            }
        double norm = sqrt(banded_product(n, columns, M, basis, k, k));
        bool new = norm > 1e-9 * before;
        for (size_t i = 0; i < n; i++)
            basis[i * columns + k] = new ? basis[i * columns + k] / norm : basis[i * columns + last - 1];
        if (new)
            k++;
        else
            last--;
    }
    return last;
}

/* Kᵣ φ = ω² Mᵣ φ in the span of the first n_modes columns of basis; fe->shape and omega [n_modes] from it. */
static int ritz(struct truth_assembly *fe, const double *K, const double *M, size_t columns, const double *basis,
                double *omega, char message[TRUTH_MESSAGE])
{
    size_t m = fe->n_modes;
    double *Kr = truth_array(m * m), *Mr = truth_array(m * m), *small = truth_array(m * m);
    for (size_t a = 0; a < m; a++)
        for (size_t b = 0; b < m; b++) {
            Kr[a * m + b] = banded_product(fe->kept, columns, K, basis, a, b);
            Mr[a * m + b] = banded_product(fe->kept, columns, M, basis, a, b);
        }
    int status = truth_normal_modes(m, Kr, Mr, m, omega, small, message);
    fe->shape = truth_array(fe->n * m);
    for (size_t i = 0, k = 0; i < fe->n; i++) {
        if (fe->fixed[i])
            continue;
        for (size_t b = 0; b < m; b++)
            for (size_t j = 0; j < m; j++)
                fe->shape[i * m + j] += basis[k * columns + b] * small[b * m + j];
        k++;
    }
    free(Kr);
    free(Mr);
    free(small);
    return status;
}

/* The lowest modes, then as many static vectors as there are places; Rayleigh–Ritz makes modes of them all. */
int truth_basis_make(struct truth_assembly *fe, const struct truth_spec *spec, double *omega,
                     char message[TRUTH_MESSAGE])
{
    double *K = keep_free(fe, fe->K), *M = keep_free(fe, fe->M);
    size_t n = fe->kept, spare = spec->static_vectors ? TRUTH_STATIC : 0, columns = spec->modes + spare;
    columns = columns < n ? columns : n;
    double *low = truth_array(n * spec->modes), *basis = truth_array(n * columns);
    int status = truth_normal_modes(n, K, M, spec->modes, omega, low, message);
    size_t used = spec->modes;
    for (size_t i = 0; i < n; i++)
        memcpy(basis + i * columns, low + i * spec->modes, spec->modes * sizeof *basis);
    if (status == 0 && spare > 0) {
        used += add_static(fe, spec, K, M, columns, used, basis);
        used = orthonormalise(n, columns, M, spec->modes, used, basis);
    }
    fe->n_modes = used;
    if (status == 0)
        status = ritz(fe, K, M, columns, basis, omega, message);
    free(K);
    free(M);
    free(low);
    free(basis);
    return status;
}
