/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "ground/ground.h"
#include "beam/beam.h"
#include "show/show.h"
#include "record/record.h"

static const struct answer_field mode_fields[] = {
    ANSWER_CELL("mode", "{@}"),
    ANSWER_ROW(NUMBER, "frequency_Hz", "natural frequency without damping", .digits = -5, .text = "frequency"),
    ANSWER_ROW(NUMBER, "damped_pole_Hz", "of the damped oscillation"),
    ANSWER_ROW(NUMBER, "damping_ratio", "share of critical damping", .digits = -6, .text = "damping ratio"),
    ANSWER_ROW(NUMBER, "deployed_relative_error", "frequency error in the space for the target; null: beyond it",
               .digits = 2, .flags = ANSWER_ALL, .text = "on the target"),
    ANSWER_ROW(NUMBER, "uniform_relative_error", "frequency error of the seed paper's 10 equidistant splines",
               .digits = -4, .flags = ANSWER_ALL | ANSWER_PERCENT, .text = "of 10 splines"),
    {0},
};

static const struct answer_field deployed_fields[] = {
    ANSWER_ROW(COUNT, "dimension", "of the space for the target"),
    ANSWER_ROW(TEXT, "basis", "what spans it"),
    ANSWER_ROW(NUMBERS, "relative_error", "frequency error in it, one for each mode in band"),
    ANSWER_SAY(
        "\nErrors of the frequency: in the target's space of dimension {dimension} ({basis}), and in the space of "
        "the seed paper's 10 equidistant splines. Doubling the splines moves these frequencies by "
        "{spline_doubling_relative_change} at most.",
        .flags = ANSWER_ALL),
    {0},
};

/* A row of the errors of the first five modes. */
#define CONVERGENCE(errors)                                                                                            \
    ANSWER_CELL("elements", "{elements}"), ANSWER_CELL("mode 1", "[{" errors ".0}]"),                                  \
        ANSWER_CELL("mode 2", "[{" errors ".1}]"), ANSWER_CELL("mode 3", "[{" errors ".2}]"),                          \
        ANSWER_CELL("mode 4", "[{" errors ".3}]"), ANSWER_CELL("mode 5", "[{" errors ".4}]")

static const struct answer_field convergence_fields[] = {
    ANSWER_ROW(COUNT, "elements", "cubic splines over the span"),
    ANSWER_ROW(NUMBERS, "knots_on_edges", "relative frequency error, one for each mode", .digits = 2),
    ANSWER_ROW(NUMBERS, "equidistant", "the same for evenly spaced knots", .digits = 2),
    CONVERGENCE("equidistant"),
    {0},
};

/* The same list again, with the other knots. */
static const struct answer_field edges_fields[] = {
    ANSWER_ROW(COUNT, "elements", ""),
    ANSWER_ROW(NUMBERS, "knots_on_edges", "", .digits = 2),
    CONVERGENCE("knots_on_edges"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW_OF(LIST, "modes", "lowest first", mode_fields, .flags = ANSWER_TABLE, .text = ""),
    ANSWER_ROW_OF(OBJECT, "deployed", "the space that would go on the target", deployed_fields, .text = ""),
    ANSWER_ROW(NUMBER, "spline_doubling_relative_change", "of the frequencies, at most", .digits = 2),
    ANSWER_ROW_OF(LIST, "convergence", "with --convergence", convergence_fields, .flags = ANSWER_MAYBE | ANSWER_TABLE,
                  .text = "\nRelative frequency error, equidistant knots (C²; the seed paper's space)"),
    ANSWER_ROW_OF(LIST, "convergence", "", edges_fields, .flags = ANSWER_AGAIN | ANSWER_TABLE,
                  .text = "\nRelative frequency error, double knots on the region edges"),
    ANSWER_ROW_OF(LIST, "measured", "with --measured, as the list has them", pole_table_fields,
                  .flags = ANSWER_MAYBE | ANSWER_TABLE, .text = "\nMeasured frequencies beside them"),
    ANSWER_ROW(NUMBER, "common_factor", "with --measured: by which all are off", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "spread", "with --measured: of the factors, relative", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "text", "with --measured: what that says", .flags = ANSWER_MAYBE),
    ANSWER_SAY("[\n{text}]"),
    {0},
};

static const char help[] =
    "Usage: beamfit modes MODEL [-n COUNT] [--band HZ] [--shapes FILE] [--measured LIST] [--convergence] [--plot DIR] "
    "[--json]\n"
    "\n"
    "Natural frequencies, damping ratios and shapes of a model, linear effects included, from a converged spline\n"
    "model; and the frequency errors of the 10-dimensional space that would go on the target (lowest modes and\n"
    "static responses to inputs and outputs) and of the seed paper's 10 equidistant cubic splines.\n";

static const struct option_row options[] = {
    {'n', 'n', "count", "COUNT", NULL, "modes to print (default 5, at most 24)"},
    {'b', 0, "band", "HZ", NULL, "modes up to this frequency must be right on the target (default: all it spans)"},
    {'s', 0, "shapes", "FILE", NULL, "mode shapes as CSV: x_m, then one column a mode, largest deflection 1"},
    {'m', 0, "measured", "LIST", NULL,
     "beside frequencies that were measured: a file with a mode a line, frequency_Hz[, sd_Hz[, damping_ratio]], or a "
     "first line of names (docs/records.md); says "
     "which mode each is, whether all are off by one factor, and which is no mode of the model"},
    {'c', 0, "convergence", NULL, NULL,
     "also the error of each mode against the number of elements, for equidistant knots and for double "
     "knots on the region edges"},
    {'p', 0, "plot", "DIR", NULL, "shapes, and with --convergence the errors, as PNG and PDF in DIR"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace outputs even when `modes` has not made them or somebody has changed them"},
    {OPTION_ALL, 'A', "all", NULL, NULL, "all columns: the errors on the target and of the seed paper's splines, too"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit modes data/paper/b1tapih.yaml --convergence\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad model file or FILE not writable; 4 the model has no such modes.\n";

enum { MOST_MODES = 24, SHAPE_POINTS = 201, SIZES = 5, REFERENCE = 320 };
static const size_t elements[SIZES] = {9, 18, 36, 72, 144}; /* equidistant: dimension = elements + 1 */

struct arguments {
    const char *model, *shapes, *plot, *measured;
    size_t count;
    double band_Hz;
    bool convergence, counted;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    long count;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        switch (code) {
        case 'n':
            if (options_count("--count", optarg, 1, MOST_MODES, &count, err) != BF_OK)
                return BF_USAGE;
            a->count = (size_t)count;
            a->counted = true;
            break;
        case 'b':
            if (options_number("--band", optarg, &a->band_Hz, err) != BF_OK)
                return BF_USAGE;
            break;
        case 's':
            a->shapes = optarg;
            break;
        case 'c':
            a->convergence = true;
            break;
        case 'p':
            a->plot = optarg;
            break;
        case 'm':
            a->measured = optarg;
            break;
        default:
            return BF_USAGE;
        }
    }
    if (optind + 1 != argc)
        return bf_fail(err, BF_USAGE, "modes takes one model file; beamfit modes --help explains");
    a->model = argv[optind];
    return BF_OK;
}

/* ---- Shapes ---- */

/* A record is uniform columns over a uniform axis; here the axis is x, so the file is written under its own header. */
static enum bf_status write_shapes(const struct arguments *a, const struct modes *m, struct bf_error *err)
{
    struct record record = {.n = m->n_points, .t0_s = 0.0, .dt_s = 1.0};
    char name[32];
    record_add_meta(&record, "contents", "mode shapes; time_s is only the row number, x_m is the place");
    record_add_column(&record, "x_m", m->x_m);
    for (size_t k = 0; k < m->n; k++) {
        (void)snprintf(name, sizeof name, "mode_%zu", k + 1);
        record_add_column(&record, name, m->shape + k * m->n_points);
    }
    enum bf_status status = record_write(a->shapes, &record, 9, err);
    record_free(&record);
    return status;
}

static enum bf_status plot_shapes(const struct arguments *a, const struct modes *m, struct bf_error *err)
{
    size_t n = m->n < 5 ? m->n : 5;
    char legend[5][48];
    struct plot_line lines[5];
    for (size_t k = 0; k < n; k++) {
        (void)snprintf(legend[k], sizeof legend[k], "mode %zu, %.4g Hz", k + 1, m->mode[k].undamped_Hz);
        lines[k] = (struct plot_line){legend[k], m->n_points, m->x_m, m->shape + k * m->n_points};
    }
    struct plot_convergence plot = {.directory = a->plot,
                                    .stem = "shapes",
                                    .title = "Mode shapes",
                                    .x_label = "distance from the clamp (m)",
                                    .y_label = "deflection (largest 1)",
                                    .n_lines = n,
                                    .lines = lines,
                                    .linear_x = true,
                                    .linear_y = true};
    return plot_convergence(&plot, err);
}

/* ---- Convergence ---- */

struct convergence {
    double edges[SIZES][MOST_MODES], uniform[SIZES][MOST_MODES]; /* relative errors */
};

static enum bf_status converge(const struct model *model, size_t n, struct convergence *out, struct bf_error *err)
{
    double exact[MOST_MODES], f[MOST_MODES];
    enum bf_status status = modes_frequencies(model, REFERENCE, false, n, exact, err);
    for (int i = 0; status == BF_OK && i < SIZES; i++) {
        size_t possible = n + 2 < elements[i] ? n : elements[i] - 2;
        for (int uniform = 0; status == BF_OK && uniform < 2; uniform++) {
            double *error = uniform ? out->uniform[i] : out->edges[i];
            status = modes_frequencies(model, elements[i], uniform == 1, possible, f, err);
            for (size_t k = 0; k < n; k++)
                error[k] = k < possible ? fabs(f[k] / exact[k] - 1.0) : (double)NAN;
        }
    }
    return status;
}

static enum bf_status plot_errors(const struct arguments *a, const struct convergence *c, size_t n,
                                  struct bf_error *err)
{
    double x[SIZES], y[6][SIZES];
    char legend[6][64];
    struct plot_line lines[6];
    size_t shown = n < 3 ? n : 3, count = 0;
    for (int uniform = 1; uniform >= 0; uniform--) {
        for (size_t k = 0; k < shown; k++, count++) {
            (void)snprintf(legend[count], sizeof legend[count], "mode %zu, %s", k + 1,
                           uniform ? "equidistant knots" : "knots on the edges");
            for (int i = 0; i < SIZES; i++) {
                x[i] = (double)elements[i];
                y[count][i] = uniform ? c->uniform[i][k] : c->edges[i][k];
            }
            lines[count] = (struct plot_line){legend[count], SIZES, x, y[count]};
        }
    }
    struct plot_convergence plot = {.directory = a->plot,
                                    .stem = "convergence",
                                    .title = "Convergence of frequencies",
                                    .x_label = "cubic spline elements (equidistant knots: dimension less one)",
                                    .y_label = "relative frequency error",
                                    .n_lines = count,
                                    .lines = lines};
    return plot_convergence(&plot, err);
}

/* ---- Answers ---- */

static struct json *make_json(const struct arguments *a, const struct modes *m, const struct convergence *c)
{
    char basis[80];
    struct json *root = json_new_object(), *list = json_put(root, "modes", json_new_array());
    for (size_t k = 0; k < m->n; k++) {
        struct json *one = json_push(list, json_new_object());
        json_put_number(one, "frequency_Hz", m->mode[k].undamped_Hz);
        json_put_number(one, "damped_pole_Hz", m->mode[k].frequency_Hz);
        json_put_number(one, "damping_ratio", m->mode[k].damping_ratio);
        json_put_number(one, "deployed_relative_error", m->mode[k].deployed_error);
        json_put_number(one, "uniform_relative_error", m->mode[k].uniform_error);
    }
    struct json *deployed = json_put(root, "deployed", json_new_object());
    json_put_number(deployed, "dimension", (double)(m->deployed_modes + m->deployed_statics));
    (void)snprintf(basis, sizeof basis, "%zu modes and %zu static responses", m->deployed_modes, m->deployed_statics);
    json_put_text(deployed, "basis", basis);
    struct json *errors = json_put(deployed, "relative_error", json_new_array());
    for (size_t k = 0; k < m->in_band; k++)
        json_push_number(errors, m->mode[k].deployed_error);
    json_put_number(root, "spline_doubling_relative_change", m->convergence);
    if (a->convergence) {
        struct json *rows = json_put(root, "convergence", json_new_array());
        for (int i = 0; i < SIZES; i++) {
            struct json *row = json_push(rows, json_new_object());
            json_put_number(row, "elements", (double)elements[i]);
            struct json *edges = json_put(row, "knots_on_edges", json_new_array());
            struct json *uniform = json_put(row, "equidistant", json_new_array());
            for (size_t k = 0; k < m->n; k++) {
                json_push_number(edges, c->edges[i][k]);
                json_push_number(uniform, c->uniform[i][k]);
            }
        }
    }
    return root;
}

static enum bf_status answer(const struct arguments *a, const struct model *model, const struct modes *m,
                             const struct pole_table *table, struct bf_error *err)
{
    struct convergence *c = bf_alloc(1, sizeof *c);
    enum bf_status status = a->convergence ? converge(model, m->n, c, err) : BF_OK;
    if (status == BF_OK && a->shapes != NULL)
        status = write_shapes(a, m, err);
    if (status == BF_OK) {
        struct json *root = make_json(a, m, c);
        if (a->measured != NULL)
            pole_table_json(root, table);
        status = answer_print_and_free(root, fields, err);
    }
    if (status == BF_OK && a->plot != NULL)
        status = plot_shapes(a, m, err);
    if (status == BF_OK && a->plot != NULL && table->n_pairs > 0)
        status = pole_table_plot(table, text_base_name(a->measured), a->plot, err);
    if (status == BF_OK && a->plot != NULL && a->convergence)
        status = plot_errors(a, c, m->n, err);
    free(c);
    return status;
}

/* As many modes as the list has, and some above, unless --count says. */
static enum bf_status compute(struct arguments *a, const struct frequency_list *measured, const struct model *model,
                              struct modes *modes, struct pole_table *table, struct bf_error *err)
{
    double model_Hz[MOST_MODES];
    if (measured->n > 0 && !a->counted)
        a->count = measured->n + 4 < MOST_MODES ? measured->n + 4 : MOST_MODES;
    const enum bf_status status = modes_compute(model, a->count, a->band_Hz, SHAPE_POINTS, modes, err);
    for (size_t k = 0; status == BF_OK && k < modes->n; k++)
        model_Hz[k] = modes->mode[k].undamped_Hz;
    if (status == BF_OK && measured->n > 0)
        pole_table_make(measured, model_Hz, modes->n, table);
    if (status == BF_OK) {
        pole_table_damping(table, modes);
        pole_table_shapes(table, measured, modes);
    }
    return status;
}

/* What may not be replaced is said before the work. */
static enum bf_status prepare(const struct arguments *a, struct bf_error *err)
{
    char poles[PLOT_STEM];
    const char *stems[3] = {"shapes"};
    size_t n = 1;
    if (a->convergence)
        stems[n++] = "convergence";
    if (a->measured != NULL) {
        pole_table_stem(text_base_name(a->measured), poles);
        stems[n++] = poles;
    }
    const enum bf_status status = atomic_check_file(a->shapes, err);
    return status == BF_OK ? plot_prepare(a->plot, stems, n, err) : status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.count = 5};
    struct model model;
    struct modes modes;
    struct frequency_list measured = {0};
    struct pole_table table = {0};
    if (parse(argc, argv, &a, err) != BF_OK)
        return BF_USAGE;
    enum bf_status status = a.measured != NULL ? frequency_list_read(a.measured, &measured, err) : BF_OK;
    if (status == BF_OK && (status = model_read(a.model, &model, err)) != BF_OK)
        frequency_list_free(&measured);
    if (status != BF_OK)
        return status;
    status = prepare(&a, err);
    if (status == BF_OK)
        status = compute(&a, &measured, &model, &modes, &table, err);
    if (status == BF_OK) {
        status = answer(&a, &model, &modes, &table, err);
        modes_free(&modes);
    }
    pole_table_free(&table);
    frequency_list_free(&measured);
    model_free(&model);
    return status;
}

const struct command command_modes = {
    .place = 20,
    .name = "modes",
    .summary = "natural frequencies, damping, shapes; errors on the target",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
