/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * galerkin_tables.c — prints lib/beam_tables.h's tables as C source.
 *
 *     galerkin_tables [length_m patch_from_m patch_to_m] > galerkin_tables.c
 *
 * Cubic B-splines (Cox, de Boor); integrands are polynomials of degree ≤ 6 between breakpoints (knots and patch
 * edges), so four Gauss points a piece are exact.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = 10, DEGREE = 3, SPLINES = N + 2, KNOTS = SPLINES + DEGREE + 1, INNER = KNOTS - 2 * (DEGREE + 1) };

static const double gauss_x[4] = {-0.861136311594052575224, -0.339981043584856264803, 0.339981043584856264803,
                                  0.861136311594052575224};
static const double gauss_w[4] = {0.347854845137453857373, 0.652145154862546142627, 0.652145154862546142627,
                                  0.347854845137453857373};

struct geometry {
    double length, from, to;
};

static void knots_uniform(const struct geometry *g, double t[KNOTS])
{
    for (int i = 0; i < INNER; i++)
        t[DEGREE + 1 + i] = g->length * (i + 1) / (INNER + 1);
}

/* Double knots on the patch edges; the remaining four equidistant between patch and free end. */
static void knots_patch(const struct geometry *g, double t[KNOTS])
{
    double *inner = t + DEGREE + 1;
    inner[0] = inner[1] = g->from;
    inner[2] = inner[3] = g->to;
    for (int i = 4; i < INNER; i++)
        inner[i] = g->to + (g->length - g->to) * (i - 3) / (INNER - 3);
}

/* All splines of this degree at x in [t[j], t[j+1]). */
static void splines(const double t[KNOTS], int degree, double x, double b[KNOTS])
{
    memset(b, 0, KNOTS * sizeof *b);
    int j = DEGREE;
    while (j < SPLINES - 1 && x >= t[j + 1])
        j++;
    b[j] = 1.0;
    for (int d = 1; d <= degree; d++)
        for (int i = j - d; i <= j; i++) {
            const double left = t[i + d] > t[i] ? (x - t[i]) / (t[i + d] - t[i]) * b[i] : 0.0;
            const double right =
                t[i + d + 1] > t[i + 1] ? (t[i + d + 1] - x) / (t[i + d + 1] - t[i + 1]) * b[i + 1] : 0.0;
            b[i] = left + right;
        }
}

/* derivative-th derivative of the N splines that satisfy φ(0) = φ'(0) = 0. */
static void shape(const double t[KNOTS], double x, int derivative, double out[N])
{
    double b[KNOTS + 1] = {0};
    splines(t, DEGREE - derivative, x, b);
    for (int d = DEGREE - derivative + 1; d <= DEGREE; d++)
        for (int i = 0; i + d + 1 < KNOTS + 1 && i < KNOTS - d - 1; i++) {
            const double a = t[i + d] > t[i] ? b[i] / (t[i + d] - t[i]) : 0.0;
            const double c = t[i + d + 1] > t[i + 1] ? b[i + 1] / (t[i + d + 1] - t[i + 1]) : 0.0;
            b[i] = d * (a - c);
        }
    memcpy(out, b + 2, N * sizeof *out);
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* out[region][i][j] = ∫ of the products of derivative-th derivatives; load (derivative 0 only): ∫ φ. */
static void integrate(const struct geometry *g, const double t[KNOTS], int derivative, double out[2][N][N],
                      double load[2][N])
{
    double edge[KNOTS + 2];
    memcpy(edge, t, KNOTS * sizeof *edge);
    edge[KNOTS] = g->from;
    edge[KNOTS + 1] = g->to;
    qsort(edge, KNOTS + 2, sizeof *edge, by_value);
    memset(out, 0, 2 * sizeof *out);
    memset(load, 0, 2 * sizeof *load);
    for (int e = 0; e + 1 < KNOTS + 2; e++) {
        const double a = edge[e], b = edge[e + 1], middle = 0.5 * (a + b);
        const int region = middle > g->from && middle < g->to;
        for (int q = 0; q < 4 && b > a; q++) {
            double phi[N];
            const double w = 0.5 * (b - a) * gauss_w[q];
            shape(t, middle + 0.5 * (b - a) * gauss_x[q], derivative, phi);
            for (int i = 0; i < N; i++) {
                load[region][i] += w * phi[i];
                for (int j = 0; j < N; j++)
                    out[region][i][j] += w * phi[i] * phi[j];
            }
        }
    }
}

static void print_number(double x)
{
    char text[40];
    snprintf(text, sizeof text, "%.17g", x);
    printf("BEAM_K(%s%s), ", text, strpbrk(text, ".e") ? "" : ".0");
}

static void print_scalar(const char *name, double x)
{
    printf("    .%s = ", name);
    print_number(x);
    printf("\n");
}

static void print_list(const char *name, const double *x, int n)
{
    printf("    .%s = {", name);
    for (int i = 0; i < n; i++)
        print_number(x[i]);
    printf("},\n");
}

static void print_bands(const char *name, double x[2][N][N])
{
    printf("    .%s = {", name);
    for (int r = 0; r < 2; r++) {
        printf("{\n");
        for (int i = 0; i < N; i++) {
            printf("        {");
            for (int d = 0; d <= DEGREE; d++)
                print_number(i + d < N ? x[r][i][i + d] : 0.0);
            printf("},\n");
        }
        printf("    }, ");
    }
    printf("},\n");
}

static void print_table(const struct geometry *g, void (*place)(const struct geometry *, double *))
{
    double t[KNOTS], form[2][N][N], load[2][N], unused[2][N];
    for (int i = 0; i <= DEGREE; i++) {
        t[i] = 0.0;
        t[KNOTS - 1 - i] = g->length;
    }
    place(g, t);
    printf("    {\n");
    print_list("knots", t, KNOTS);
    integrate(g, t, 0, form, load);
    print_bands("mass", form);
    integrate(g, t, 1, form, unused);
    print_bands("slope", form);
    integrate(g, t, 2, form, unused);
    print_bands("curvature", form);
    printf("    .load = {");
    for (int r = 0; r < 2; r++) {
        printf("{");
        for (int i = 0; i < N; i++)
            print_number(load[r][i]);
        printf("}, ");
    }
    printf("}},\n");
}

/* Quadrature for laws: 1 point from clamp to patch, 2 on the patch, 5 from patch to free end. */
static void print_geometry(const struct geometry *g)
{
    static const double x1[1] = {0.0}, w1[1] = {2.0};
    static const double x2[2] = {-0.577350269189625764509, 0.577350269189625764509}, w2[2] = {1.0, 1.0};
    static const double x5[5] = {-0.906179845938663992798, -0.538469310105683091036, 0.0, 0.538469310105683091036,
                                 0.906179845938663992798};
    static const double w5[5] = {0.236926885056189087514, 0.478628670499366468041, 0.568888888888888888889,
                                 0.478628670499366468041, 0.236926885056189087514};
    const struct {
        double a, b;
        int n;
        const double *x, *w;
    } piece[3] = {{0.0, g->from, 1, x1, w1}, {g->from, g->to, 2, x2, w2}, {g->to, g->length, 5, x5, w5}};
    double at[8], weight[8];
    int n = 0;
    for (int p = 0; p < 3; p++)
        for (int q = 0; q < piece[p].n; q++, n++) {
            at[n] = 0.5 * (piece[p].a + piece[p].b) + 0.5 * (piece[p].b - piece[p].a) * piece[p].x[q];
            weight[n] = 0.5 * (piece[p].b - piece[p].a) * piece[p].w[q];
        }
    printf("const struct beam_span beam_geometry_table = {\n");
    print_scalar("length_m", g->length);
    print_scalar("patch_from_m", g->from);
    print_scalar("patch_to_m", g->to);
    print_list("span_at_m", at, n);
    print_list("span_weight_m", weight, n);
    printf("    .span_region = {0, 1, 1, 0, 0, 0, 0, 0},\n};\n");
}

int main(int argc, char **argv)
{
    struct geometry g = {0.4573, 0.02535, 0.08905};
    double *const part[3] = {&g.length, &g.from, &g.to};
    int readable = argc == 1 || argc == 4;
    for (int i = 0; readable && i < argc - 1; i++) {
        char *end;
        *part[i] = strtod(argv[i + 1], &end);
        readable = end != argv[i + 1] && *end == 0;
    }
    if (!readable || !(g.from > 0.0 && g.to > g.from && g.length > g.to && g.length < 1e6)) {
        fprintf(stderr, "usage: galerkin_tables [length_m patch_from_m patch_to_m], 0 < from < to < length\n");
        return 2;
    }
    printf("/* Made by: galerkin_tables %.17g %.17g %.17g; do not edit. */\n", g.length, g.from, g.to);
    printf("#include \"beam_tables.h\"\n\n");
    printf("const struct beam_table beam_tables[2] = {\n");
    print_table(&g, knots_uniform);
    print_table(&g, knots_patch);
    printf("};\n");
    print_geometry(&g);
    return fflush(stdout) != 0 || ferror(stdout);
}
