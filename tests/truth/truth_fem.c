/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Hermite cubic beam elements. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TRUTH_BREAKS = 2 * TRUTH_REGIONS + 2 * TRUTH_PORTS + 3 * TRUTH_EFFECTS + 2 };

struct breaks {
    size_t n;
    double x_m[TRUTH_BREAKS];
};

static void add_break(struct breaks *breaks, double x_m, double length_m, double apart_m)
{
    if (!(x_m >= 0 && x_m <= length_m))
        return;
    for (size_t i = 0; i < breaks->n; i++)
        if (fabs(breaks->x_m[i] - x_m) <= apart_m)
            return;
    breaks->x_m[breaks->n++] = x_m;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* A pair of moments bends nothing but the span between them: inside an element the slope is a parabola and cannot do that. */
static void add_span_of_crack(struct breaks *breaks, const struct truth_spec *spec, const struct truth_effect *effect,
                              double apart_m)
{
    double at_m;
    if (effect->kind != TRUTH_BILINEAR_STIFFNESS || !truth_effect_place(spec, effect, &at_m))
        return;
    const double half_m = effect->parameter[2] / 2;
    add_break(breaks, at_m - half_m, spec->length_m, apart_m);
    add_break(breaks, at_m + half_m, spec->length_m, apart_m);
}

/* Region edges and the span of a crack always get a node. Points of ports and effects get one unless a node is near: an
 * element of 50 µm beside one of 5 mm costs the low frequencies their digits, and inside an element the modes are smooth
 * cubics. */
static void find_breaks(const struct truth_spec *spec, double size_m, struct breaks *breaks)
{
    double length = spec->length_m;
    breaks->n = 0;
    add_break(breaks, 0, length, 0);
    add_break(breaks, length, length, 0);
    for (size_t r = 0; r < spec->n_regions; r++) {
        add_break(breaks, spec->region[r].from_m, length, 1e-9 * length);
        add_break(breaks, spec->region[r].to_m, length, 1e-9 * length);
    }
    double apart = 0.3 * size_m;
    for (size_t i = 0; i < spec->n_effects; i++)
        add_span_of_crack(breaks, spec, &spec->effect[i], 0.02 * size_m);
    for (size_t i = 0; i < spec->n_effects; i++) {
        double at_m;
        if (truth_effect_place(spec, &spec->effect[i], &at_m))
            add_break(breaks, at_m, length, apart);
    }
    for (size_t i = 0; i < spec->n_inputs; i++)
        add_break(breaks, spec->input[i].at_m, length, apart);
    for (size_t i = 0; i < spec->n_outputs; i++)
        add_break(breaks, spec->output[i].at_m, length, apart);
    qsort(breaks->x_m, breaks->n, sizeof breaks->x_m[0], ascending);
}

static void fill_properties(const struct truth_spec *spec, struct truth_mesh *mesh)
{
    size_t n = mesh->n_elements;
    mesh->EI = truth_array(n);
    mesh->rho = truth_array(n);
    mesh->cDI = truth_array(n);
    mesh->rho_gyration2 = truth_array(n);
    mesh->in_patch = truth_array(n);
    for (size_t e = 0; e < n; e++) {
        double middle = (mesh->x_m[e] + mesh->x_m[e + 1]) / 2;
        for (size_t r = 0; r < spec->n_regions; r++) {
            const struct truth_region *region = &spec->region[r];
            if (middle < region->from_m || middle > region->to_m)
                continue;
            mesh->EI[e] = region->EI_Nm2;
            mesh->rho[e] = region->rho_kgpm;
            mesh->cDI[e] = region->cDI_sNm2;
            mesh->rho_gyration2[e] = region->rho_kgpm * region->gyration2_m2;
        }
        mesh->in_patch[e] = middle > mesh->patch_from_m && middle < mesh->patch_to_m ? 1 : 0;
    }
}

void truth_mesh_make(const struct truth_spec *spec, struct truth_mesh *mesh)
{
    double size = spec->length_m / (double)spec->elements;
    struct breaks breaks;
    find_breaks(spec, size, &breaks);
    const struct truth_region *patch = &spec->region[spec->n_regions > 1 ? 1 : 0];
    *mesh = (struct truth_mesh){.patch_from_m = patch->from_m, .patch_to_m = patch->to_m};

    mesh->x_m = truth_array(2 * spec->elements + 2 * TRUTH_BREAKS);
    for (size_t i = 0; i + 1 < breaks.n; i++) {
        double span = breaks.x_m[i + 1] - breaks.x_m[i];
        size_t pieces = (size_t)ceil(span / size - 1e-9);
        pieces = pieces < 1 ? 1 : pieces;
        for (size_t k = 0; k < pieces; k++)
            mesh->x_m[mesh->n_elements++] = breaks.x_m[i] + span * (double)k / (double)pieces;
    }
    mesh->x_m[mesh->n_elements] = spec->length_m;
    mesh->n_dof = 2 * (mesh->n_elements + 1);
    fill_properties(spec, mesh);
}

void truth_mesh_free(struct truth_mesh *mesh)
{
    free(mesh->x_m);
    free(mesh->EI);
    free(mesh->rho);
    free(mesh->cDI);
    free(mesh->rho_gyration2);
    free(mesh->in_patch);
    *mesh = (struct truth_mesh){0};
}

/* Derivative d of the four cubics on an element of length h at s in [0, 1]; unknowns y0, y0', y1, y1'. */
static void hermite(double h, double s, int d, double N[4])
{
    switch (d) {
    case 0:
        N[0] = 1 - 3 * s * s + 2 * s * s * s;
        N[1] = h * s * (1 - s) * (1 - s);
        N[2] = 3 * s * s - 2 * s * s * s;
        N[3] = h * s * s * (s - 1);
        break;
    case 1:
        N[0] = 6 * s * (s - 1) / h;
        N[1] = 1 - 4 * s + 3 * s * s;
        N[2] = -N[0];
        N[3] = 3 * s * s - 2 * s;
        break;
    default:
        N[0] = (12 * s - 6) / (h * h);
        N[1] = (6 * s - 4) / h;
        N[2] = -N[0];
        N[3] = (6 * s - 2) / h;
    }
}

void truth_mesh_integrate(const struct truth_mesh *mesh, int derivative, const double *weight, double scale,
                          double *matrix)
{
    /* four Gauss points: exact to degree 7; φφ has degree 6 */
    static const double point[4] = {0.06943184420297371, 0.33000947820757187, 0.66999052179242813, 0.93056815579702629};
    static const double share[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693};
    for (size_t e = 0; e < mesh->n_elements; e++) {
        double h = mesh->x_m[e + 1] - mesh->x_m[e];
        double factor = scale * h * (weight ? weight[e] : 1);
        for (int g = 0; g < 4; g++) {
            double N[4];
            hermite(h, point[g], derivative, N);
            for (size_t i = 0; i < 4; i++)
                for (size_t j = 0; j < 4; j++)
                    matrix[(2 * e + i) * mesh->n_dof + 2 * e + j] += factor * share[g] * N[i] * N[j];
        }
    }
}

void truth_mesh_row(const struct truth_mesh *mesh, double x_m, int derivative, double *row)
{
    size_t e = 0;
    while (e + 1 < mesh->n_elements && x_m > mesh->x_m[e + 1])
        e++;
    double h = mesh->x_m[e + 1] - mesh->x_m[e];
    memset(row, 0, mesh->n_dof * sizeof *row);
    hermite(h, (x_m - mesh->x_m[e]) / h, derivative, row + 2 * e);
}
