/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"
#include "identifiability.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"

static const double rounding = 1e-9;     /* singular values below this share of the largest are zero */
static const double unknown = 1e-3;      /* … and those that mean a standard error of 1000 × 100 % */
static const double shown_weight = 0.02; /* smaller weights are left out of the words */

/* Singular values and right vectors of the triangle R stacked on the prior rows, both by x/extent. */
static enum bf_status decompose(size_t n, const double R[], const double prior_precision[], const double extent[],
                                double inflation, double s[], double V[], struct bf_error *err)
{
    double *A = bf_alloc(2 * n * n, sizeof *A);
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++)
            A[i + j * 2 * n] = R[i + j * n] * extent[j] / inflation;
        A[n + j + j * 2 * n] = prior_precision ? sqrt(prior_precision[j]) * extent[j] : 0.0;
    }
    const enum bf_status status = dense_svd(2 * n, n, A, NULL, s, V, err);
    free(A);
    return status;
}

static enum bf_status triangle(size_t n_rows, size_t n, const double J[], double R[], struct bf_error *err)
{
    if (n_rows >= n)
        return dense_qr_triangle(n_rows, n, J, R, err);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            R[i + j * n] = i < n_rows ? J[i + j * n_rows] : 0.0;
    return BF_OK;
}

static bool is_null(double s, double largest)
{
    return s < 1.0 || s < rounding * largest;
}

/* Makes a basis of null directions readable: each gets a parameter of its own (reduced echelon form, by pivoting). */
static void make_sparse(size_t n, size_t k, double V[])
{
    bool *used = bf_alloc(n, sizeof *used);
    for (size_t a = 0; a < k && k > 1; a++) {
        size_t pivot = n;
        for (size_t i = 0; i < n; i++)
            if (!used[i] && (pivot == n || fabs(V[i + a * n]) > fabs(V[pivot + a * n])))
                pivot = i;
        used[pivot] = true;
        for (size_t b = 0; b < k; b++) {
            if (b == a)
                continue;
            const double factor = V[pivot + b * n] / V[pivot + a * n];
            for (size_t i = 0; i < n; i++)
                V[i + b * n] -= factor * V[i + a * n];
        }
    }
    for (size_t a = 0; a < k; a++) {
        double largest = 0.0;
        for (size_t i = 0; i < n; i++)
            if (fabs(V[i + a * n]) > fabs(largest) * (1.0 + 1e-9))
                largest = V[i + a * n];
        const double norm = dense_norm(n, V + a * n) * (largest < 0.0 ? -1.0 : 1.0);
        for (size_t i = 0; i < n; i++)
            V[i + a * n] /= norm;
    }
    free(used);
}

/* Does data and prior together determine the direction v (in x/extent)? ‖A v‖ ≥ 1 with A = S Vᵀ. */
static bool pinned(size_t n, const double s[], const double V[], const double v[])
{
    double square = 0.0;
    for (size_t j = 0; j < n; j++)
        square += pow(s[j] * dense_dot(n, V + j * n, v), 2.0);
    return square >= 1.0;
}

static void collect_null(struct identifiability *out, const double V[])
{
    const size_t n = out->n;
    size_t first = n;
    while (first > 0 && is_null(out->singular[first - 1], out->singular[0]))
        first--;
    out->n_null = n - first;
    out->null = bf_alloc(out->n_null, sizeof *out->null);
    double *basis = bf_alloc(n * out->n_null, sizeof *basis);
    memcpy(basis, V + first * n, n * out->n_null * sizeof *basis);
    make_sparse(n, out->n_null, basis);
    for (size_t a = 0; a < out->n_null; a++) {
        struct null_direction *d = &out->null[a];
        d->ratio = out->singular[0] > 0.0 ? out->singular[first + a] / out->singular[0] : 0.0;
        d->weight = bf_alloc(n, sizeof *d->weight);
        memcpy(d->weight, basis + a * n, n * sizeof *basis);
        d->pinned = pinned(n, out->posterior, out->V, d->weight);
    }
    free(basis);
}

/* Own standard error of every unknown, rounding counted as an (enormous) uncertainty. */
static void find_determined(struct identifiability *out)
{
    const size_t n = out->n;
    const double largest = out->posterior[0];
    out->kept = 0;
    while (out->kept < n && out->posterior[out->kept] > fmax(rounding * largest, unknown))
        out->kept++;
    for (size_t i = 0; i < n; i++) {
        double variance = 0.0;
        for (size_t j = 0; j < n; j++)
            variance += pow(out->V[i + j * n] / fmax(out->posterior[j], rounding * unknown), 2.0);
        out->determined[i] = variance <= 1.0;
    }
}

enum bf_status identifiability_compute(size_t n_rows, size_t n, const double J[], const double prior_precision[],
                                       const double extent[], double inflation, struct identifiability *out,
                                       struct bf_error *err)
{
    *out = (struct identifiability){.n = n};
    if (n == 0)
        return BF_OK;
    out->singular = bf_alloc(n, sizeof(double)), out->posterior = bf_alloc(n, sizeof(double));
    out->V = bf_alloc(n * n, sizeof(double)), out->determined = bf_alloc(n, sizeof(bool));
    double *R = bf_alloc(n * n, sizeof *R), *V = bf_alloc(n * n, sizeof *V);
    enum bf_status status = triangle(n_rows, n, J, R, err);
    if (!status)
        status = decompose(n, R, NULL, extent, inflation, out->singular, V, err);
    if (!status)
        status = decompose(n, R, prior_precision, extent, inflation, out->posterior, out->V, err);
    if (!status) {
        collect_null(out, V);
        find_determined(out);
    }
    free(R), free(V);
    if (status)
        identifiability_free(out);
    return status;
}

void identifiability_free(struct identifiability *identifiability)
{
    for (size_t a = 0; a < identifiability->n_null; a++)
        free(identifiability->null[a].weight);
    free(identifiability->singular), free(identifiability->posterior), free(identifiability->V);
    free(identifiability->determined), free(identifiability->null);
    *identifiability = (struct identifiability){0};
}

/* ---- Words ---- */

static size_t print_group(FILE *out, size_t n, const char *const labels[], const double weight[], double sign,
                          double largest)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        const double relative = sign * weight[i] / largest;
        if (relative < shown_weight)
            continue;
        fprintf(out, "%s%s", count ? ", " : "", labels[i]);
        if (fabs(relative - 1.0) > 0.05)
            fprintf(out, "^%.2g", relative);
        count++;
    }
    return count;
}

static size_t count_group(size_t n, const double weight[], double sign, double largest)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        count += sign * weight[i] / largest >= shown_weight;
    return count;
}

static void print_remedy(FILE *out, size_t n, const char *const labels[], const double weight[])
{
    bool mass = false, gain = false;
    for (size_t i = 0; i < n; i++) {
        if (fabs(weight[i]) < shown_weight)
            continue;
        mass = mass || strncmp(labels[i], "rho_", 4) == 0;
        gain = gain || strncmp(labels[i], "Ks_", 3) == 0 || strncmp(labels[i], "KB_", 3) == 0;
    }
    if (mass && gain)
        fprintf(out, "to fix it, weigh the beam (a prior on rho) or calibrate a channel (hold Ks or KB)");
    else if (mass)
        fprintf(out, "to fix it, weigh the beam (a prior on rho)");
    else if (gain)
        fprintf(out, "to fix it, calibrate the channel (hold Ks or KB)");
    else
        fprintf(out, "to fix it, give one of them a prior or hold it, or add a record that excites it");
}

char *identifiability_text(size_t n, const char *const labels[], const struct null_direction *direction)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return bf_strdup("a combination of parameters is not determined");
    double largest = 0.0;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(direction->weight[i]));
    const size_t up = count_group(n, direction->weight, 1.0, largest);
    const size_t down = count_group(n, direction->weight, -1.0, largest);
    if (up + down == 1) {
        print_group(out, n, labels, direction->weight, 1.0, largest);
        fprintf(out, " has no influence on these records that rises above the noise");
    } else if (down == 0) {
        print_group(out, n, labels, direction->weight, 1.0, largest);
        fprintf(out,
                " scale together by one common factor that the records do not determine: only their ratios are known");
    } else {
        print_group(out, n, labels, direction->weight, 1.0, largest);
        fprintf(out, " can grow by a common factor while ");
        print_group(out, n, labels, direction->weight, -1.0, largest);
        fprintf(out, " shrink%s by it: only the product%s known", down == 1 ? "s" : "",
                up + down == 2 ? " is" : "s are");
    }
    fprintf(out, "; ");
    print_remedy(out, n, labels, direction->weight);
    if (direction->pinned)
        fprintf(out, ". Here a prior fixes it: the values are as good as that prior");
    fclose(out);
    return text;
}
