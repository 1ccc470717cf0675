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
    ANSWER_ROW(NUMBER, "frequency_Hz", "natural frequency without damping"),
    ANSWER_ROW(NUMBER, "damped_pole_Hz", "of the damped oscillation"),
    ANSWER_ROW(NUMBER, "damping_ratio", "share of critical damping"),
    ANSWER_ROW(NUMBER, "uniform_relative_error", "frequency error of the seed paper's 10 equidistant splines"),
    {0},
};

static const struct answer_field deployed_fields[] = {
    ANSWER_ROW(COUNT, "dimension", "of the space for the target"),
    ANSWER_ROW(TEXT, "basis", "what spans it"),
    ANSWER_ROW(NUMBERS, "relative_error", "frequency error in it, one for each mode in band"),
    {0},
};

static const struct answer_field convergence_fields[] = {
    ANSWER_ROW(COUNT, "elements", "cubic splines over the span"),
    ANSWER_ROW(NUMBERS, "knots_on_edges", "relative frequency error, one for each mode"),
    ANSWER_ROW(NUMBERS, "equidistant", "the same for evenly spaced knots"),
    {0},
};

static const struct answer_field measured_fields[] = {
    ANSWER_ROW(NUMBER, "frequency_Hz", "measured"),
    ANSWER_ROW(NUMBER, "sd_Hz", "its standard error, as the list says"),
    ANSWER_ROW(NUMBER, "damping_ratio", "measured"),
    {ANSWER_COUNT, "mode", "of the model, 1 the lowest; null: it has none there", NULL, ANSWER_NULL, NULL},
    ANSWER_ROW(NUMBER, "model_Hz", "of that mode"),
    ANSWER_ROW(NUMBER, "ratio", "measured over the model's"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW_OF(LIST, "modes", "lowest first", mode_fields),
    ANSWER_ROW_OF(OBJECT, "deployed", "the space that would go on the target", deployed_fields),
    ANSWER_ROW(NUMBER, "spline_doubling_relative_change", "of the frequencies, at most"),
    {ANSWER_LIST, "convergence", "with --convergence", convergence_fields, ANSWER_MAYBE, NULL},
    {ANSWER_LIST, "measured", "with --measured, as the list has them", measured_fields, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "common_factor", "with --measured: by which all are off", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "spread", "with --measured: of the factors, relative", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_TEXT, "text", "with --measured: what that says", NULL, ANSWER_MAYBE, NULL},
    {0},
};

static const char help[] =
    "Usage: beamfit modes MODEL [-n COUNT] [--band HZ] [--shapes FILE] [--measured LIST] [--convergence] [--plot DIR] "
    "[--json]\n"
    "\n"
    "Natural frequencies, damping ratios and shapes of a model, linear effects included, from a converged spline "
    "model;\n"
    "and the frequency errors of the 10-dimensional space that would go on the target (lowest modes and static\n"
    "responses to inputs and outputs) and of the seed paper's 10 equidistant cubic splines.\n";

static const struct option_row options[] = {
    {'n', 'n', "count", "COUNT", NULL, "modes to print (default 5, at most 24)"},
    {'b', 0, "band", "HZ", NULL, "modes up to this frequency must be right on the target (default: all it spans)"},
    {'s', 0, "shapes", "FILE", NULL, "mode shapes as CSV: x_m, then one column a mode, largest deflection 1"},
    {'m', 0, "measured", "LIST", NULL,
     "beside frequencies that were measured: a file with a mode a line, frequency_Hz[, sd_Hz[, damping_ratio]]; says "
     "which mode each is, whether all are off by one factor, and which is no mode of the model"},
    {'c', 0, "convergence", NULL, NULL,
     "also the error of each mode against the number of elements, for equidistant knots and for double "
     "knots on the region edges"},
    {'p', 0, "plot", "DIR", NULL, "shapes, and with --convergence the errors, as PNG and PDF in DIR"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace outputs even when `modes` has not made them or somebody has changed them"},
    {'A', 0, "all", NULL, NULL, "all columns: the errors on the target and of the seed paper's splines, too"},
    OPTIONS_ANSWER('j'),
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
    bool json, convergence, all, counted;
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
        case 'A':
            a->all = true;
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
        case 'j':
            a->json = true;
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

static void print_convergence(const struct convergence *c, size_t n)
{
    size_t shown = n < 5 ? n : 5;
    for (int uniform = 1; uniform >= 0; uniform--) {
        (void)printf("\nRelative frequency error, %s\n elements",
                     uniform ? "equidistant knots (C²; the seed paper's space)" : "double knots on the region edges");
        for (size_t k = 0; k < shown; k++)
            (void)printf("    mode %zu", k + 1);
        for (int i = 0; i < SIZES; i++) {
            (void)printf("\n  %7zu", elements[i]);
            for (size_t k = 0; k < shown; k++)
                (void)printf("  %8.1e", uniform ? c->uniform[i][k] : c->edges[i][k]);
        }
        (void)printf("\n");
    }
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

static void print_errors(const struct mode *mode)
{
    if (isnan(mode->deployed_error))
        (void)printf("%14s", "-");
    else
        (void)printf("%+14.1e", mode->deployed_error);
    if (isnan(mode->uniform_error))
        (void)printf("%17s", "-");
    else
        (void)printf("%+15.4f %%", 100.0 * mode->uniform_error);
}

static void print_table(const struct modes *m, bool all)
{
    (void)printf("mode   frequency    damping ratio%s\n", all ? "   on the target   of 10 splines" : "");
    for (size_t k = 0; k < m->n; k++) {
        const struct mode *mode = &m->mode[k];
        (void)printf("%4zu  %10.5f Hz   %.6f", k + 1, mode->undamped_Hz, mode->damping_ratio);
        if (all)
            print_errors(mode);
        (void)putchar('\n');
    }
    if (all) {
        text_say(
            stdout, "\n", 0,
            "Errors of the frequency: in the target's space of dimension %zu (%zu modes, %zu static responses; modes "
            "in band: %zu), and in the space of the seed paper's 10 equidistant splines. Doubling the splines moves "
            "these frequencies by %.1e at most.",
            m->deployed_modes + m->deployed_statics, m->deployed_modes, m->deployed_statics, m->in_band,
            m->convergence);
    }
}

static struct json *make_json(const struct arguments *a, const struct modes *m, const struct convergence *c)
{
    struct json *root = json_new_object(), *list = json_put(root, "modes", json_new_array());
    for (size_t k = 0; k < m->n; k++) {
        struct json *one = json_push(list, json_new_object());
        json_put_number(one, "frequency_Hz", m->mode[k].undamped_Hz);
        json_put_number(one, "damped_pole_Hz", m->mode[k].frequency_Hz);
        json_put_number(one, "damping_ratio", m->mode[k].damping_ratio);
        json_put_number(one, "uniform_relative_error", m->mode[k].uniform_error);
    }
    struct json *deployed = json_put(root, "deployed", json_new_object());
    json_put_number(deployed, "dimension", (double)(m->deployed_modes + m->deployed_statics));
    json_put_text(deployed, "basis", "modes and static responses");
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
    if (status == BF_OK && a->json) {
        struct json *root = make_json(a, m, c);
        if (a->measured != NULL)
            pole_table_json(root, table);
        status = answer_print_and_free(root, fields, err);
    } else if (status == BF_OK) {
        if (a->measured != NULL)
            pole_table_print(stdout, table, m);
        else
            print_table(m, a->all);
        if (a->convergence)
            print_convergence(c, m->n);
    }
    if (status == BF_OK && a->plot != NULL)
        status = plot_shapes(a, m, err);
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
    return status;
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
    if (a.plot != NULL)
        (void)plot_can_draw(a.plot);
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
