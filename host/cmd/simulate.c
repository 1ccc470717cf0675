/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "ground/ground.h"
#include "response/response.h"
#include "simulate_stream.h"

static const struct answer_field output_fields[] = {
    ANSWER_ROW(TEXT, "name", "of the column", .text = "output"),
    ANSWER_ROW(NUMBER, "rms", "of the output, in its unit", .digits = 4, .text = "rms"),
    ANSWER_ROW(NUMBER, "step_error",
               "relative change when the steps of nonlinear effects are halved; null: it has none", .digits = 2,
               .text = "relative change with half the step of nonlinear effects"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(COUNT, "samples", "of the record"),
    ANSWER_ROW(NUMBER, "dt_s", "sampling interval"),
    ANSWER_ROW(TEXT, "intersample", "what inputs do between samples"),
    ANSWER_SAY("{file}: {samples} samples of {dt_s}, inputs {intersample} between samples"),
    ANSWER_ROW_OF(LIST, "outputs", "one each of the model", output_fields, .flags = ANSWER_TABLE, .text = ""),
    {0},
};

static const char help[] =
    "Usage: beamfit simulate MODEL --input RECORD -o OUT [options]\n"
    "\n"
    "Runs a model on the inputs of a record, from rest, and writes time, the inputs and every output of the model\n"
    "as a record. Outputs that RECORD also holds are not used.\n";

static const struct option_row options[] = {
    {'i', 'i', "input", "RECORD", NULL,
     "the record whose columns named like the model's inputs drive the model; inputs that it does not hold "
     "are zero"},
    {'o', 'o', "output", "OUT", NULL, "the record to write (CSV, SI units as in the model)"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace OUT even when `simulate` has not made it or somebody has changed it"},
    OPTION_INTERSAMPLE('h'),
    {'n', 0, "oversample", "N", NULL,
     "steps a sample for nonlinear effects (default: the model's steps_per_sample, else 8 for forces at a "
     "point, 4 over the span)"},
    {'d', 0, "digits", "N", NULL, "significant digits (default 9, at most 17)"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit simulate fitted.yaml --input tap1.csv -o predicted.csv\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad model or record, or OUT not writable; 4 the model cannot be simulated.\n";

struct arguments {
    const char *model, *input, *output;
    struct predict_options predict;
    int digits;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    long count = 0;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        enum bf_status status = BF_OK;
        switch (code) {
        case 'i':
            a->input = optarg;
            break;
        case 'o':
            a->output = optarg;
            break;
        case 'h':
            status = intersample_from_text(optarg, &a->predict.intersample, err);
            break;
        case 'n':
            status = options_count("--oversample", optarg, 1, 64, &count, err);
            a->predict.oversample = (int)count;
            break;
        case 'd':
            status = options_count("--digits", optarg, 1, 17, &count, err);
            a->digits = (int)count;
            break;
        default:
            status = BF_USAGE;
        }
        if (status != BF_OK)
            return status;
    }
    if (optind + 1 != argc || a->input == NULL || a->output == NULL)
        return bf_fail(err, BF_USAGE, "say MODEL --input RECORD -o OUT; beamfit simulate --help explains");
    a->model = argv[optind];
    return options_one_answer(a->output, err);
}

/* A column of samples that are not this record's; NULL: zeros, which take no memory as long as nobody writes them. */
static void add_borrowed(struct record *record, const char *name, const double *x)
{
    const size_t n = record->n;
    record->n = 0;
    record_add_column(record, name, NULL);
    record->n = n;
    struct record_column *column = &record->columns[record->n_columns - 1];
    free(column->x);
    column->x = x != NULL ? (double *)x : bf_alloc(n, sizeof *column->x);
}

/* A record with the inputs of `from`, which keeps their samples, and a column of zeros for every output, which the predictor binds to. */
static void make_stage(const struct model *model, const struct record *from, struct record *out)
{
    const char *filter = record_meta(from, RECORD_FILTER);
    *out = (struct record){.path = bf_strdup(from->path), .n = from->n, .t0_s = from->t0_s, .dt_s = from->dt_s};
    for (size_t i = 0; i < model->n_inputs; i++) {
        const double *u = record_column(from, model->inputs[i].name);
        if (u != NULL)
            add_borrowed(out, model->inputs[i].name, u);
    }
    for (size_t o = 0; o < model->n_outputs; o++)
        add_borrowed(out, model->outputs[o].name, NULL);
    if (filter != NULL)
        record_add_meta(out, RECORD_FILTER, filter);
}

/* The first n columns are others'. */
static void free_borrowed(struct record *record, size_t n)
{
    for (size_t i = 0; i < n; i++)
        record->columns[i].x = NULL;
    record_free(record);
}

/* y[n_outputs][n] at the model's parameters; *steps: what the nonlinear grid was. */
static enum bf_status predict(const struct model *model, const struct record *stage, const struct predict_options *how,
                              double y[], struct bf_error *err)
{
    struct predictor *predictor;
    struct prediction prediction;
    struct parameter_ref *refs;
    const char *name = record_base_name(stage);
    struct predict_options pieces = *how;
    pieces.pieces = true;
    enum bf_status status = predictor_new(model, stage, 1, &pieces, &predictor, err);
    if (status != BF_OK)
        return status;
    size_t n = model_parameters(model, &name, 1, &refs);
    double *theta = bf_alloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    status = predictor_run(predictor, theta, NULL, &prediction, err);
    if (status == BF_OK)
        memcpy(y, prediction.y, prediction.n_rows * sizeof *y);
    free(theta);
    free(refs);
    predictor_free(predictor);
    return status;
}

static double rms(size_t n, const double x[])
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum / (double)n);
}

static bool has_law(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect->law != NULL)
            return true;
    return false;
}

/* Relative change of each output when the nonlinear step is halved. */
static enum bf_status step_errors(const struct model *model, const struct record *stage,
                                  const struct predict_options *how, const double y[], double error[],
                                  struct bf_error *err)
{
    if (!has_law(model))
        return BF_OK;
    struct predict_options finer = *how;
    double *z = bf_alloc(model->n_outputs * stage->n, sizeof *z);
    finer.oversample = 2 * predict_steps(model, how);
    enum bf_status status = predict(model, stage, &finer, z, err);
    for (size_t o = 0; status == BF_OK && o < model->n_outputs; o++) {
        double *row = z + o * stage->n, scale = rms(stage->n, row);
        for (size_t k = 0; k < stage->n; k++)
            row[k] -= y[o * stage->n + k];
        error[o] = scale > 0.0 ? rms(stage->n, row) / scale : 0.0;
    }
    free(z);
    return status;
}

static enum bf_status answer(const struct arguments *a, const struct model *model, const struct record *record,
                             const double size[], const double error[], struct bf_error *err)
{
    static const char *const holds[] = {"band-limited", "zero-order hold", "first-order hold"};
    struct json *root = json_new_object();
    json_put_text(root, "file", a->output);
    json_put_number(root, "samples", (double)record->n);
    json_put_number(root, "dt_s", record->dt_s);
    json_put_text(root, "intersample", holds[a->predict.intersample]);
    struct json *list = json_put(root, "outputs", json_new_array());
    for (size_t o = 0; o < model->n_outputs; o++) {
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "name", model->outputs[o].name);
        json_put_number(one, "rms", size[o]);
        json_put_number(one, "step_error", has_law(model) ? error[o] : nan(""));
    }
    answer_next(root, "beamfit", "compare", a->model, a->output, NULL);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status write_result(const struct simulation *s, const struct record *stage, const double y[],
                                   struct bf_error *err)
{
    struct record head;
    struct record_writer file;
    simulation_head(s, stage, &head);
    const double **x = bf_alloc(head.n_columns, sizeof *x);
    for (size_t i = 0; i < head.n_columns - s->model->n_outputs; i++)
        x[i] = record_column(stage, head.columns[i].name);
    for (size_t o = 0; o < s->model->n_outputs; o++)
        x[head.n_columns - s->model->n_outputs + o] = y + o * stage->n;
    enum bf_status status = record_writer_open(s->output, &head, s->digits, &file, err);
    if (status == BF_OK)
        status = record_writer_add(&file, head.n, x, err);
    if (status == BF_OK)
        status = record_writer_commit(&file, err);
    record_writer_abort(&file);
    free(x);
    record_free(&head);
    return status;
}

/* In memory: with laws, drives, or a short record. size, error: [n_outputs]. */
static enum bf_status simulate_whole(const struct simulation *s, const struct record *input, double size[],
                                     double error[], struct bf_error *err)
{
    const struct model *model = s->model;
    struct record stage;
    make_stage(model, input, &stage);
    double *y = bf_alloc(model->n_outputs * stage.n, sizeof *y);
    enum bf_status status = predict(model, &stage, &s->predict, y, err);
    if (status == BF_OK)
        status = step_errors(model, &stage, &s->predict, y, error, err);
    if (status == BF_OK)
        status = write_result(s, &stage, y, err);
    for (size_t o = 0; o < model->n_outputs; o++)
        size[o] = rms(stage.n, y + o * stage.n);
    free(y);
    free_borrowed(&stage, stage.n_columns - model->n_outputs);
    return status;
}

static enum bf_status simulate(const struct arguments *a, const struct model *model, struct record_spool *input,
                               struct bf_error *err)
{
    const struct simulation s = {.model = model,
                                 .model_path = a->model,
                                 .input = a->input,
                                 .output = a->output,
                                 .predict = a->predict,
                                 .digits = a->digits};
    double *size = bf_alloc(model->n_outputs, sizeof *size), *error = bf_alloc(model->n_outputs, sizeof *error);
    bool done = false;
    enum bf_status status = input->in_file ? simulate_streamed(&s, input, size, &done, err) : BF_OK;
    if (status == BF_OK && !done)
        status = record_spool_load(input, err);
    if (status == BF_OK && !done)
        status = simulate_whole(&s, &input->record, size, error, err);
    if (status == BF_OK && strcmp(a->output, "-") != 0)
        status = answer(a, model, &input->record, size, error, err);
    free(size);
    free(error);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.digits = 9};
    struct model model;
    struct record_spool input;
    if (parse(argc, argv, &a, err) != BF_OK)
        return BF_USAGE;
    enum bf_status status = model_read(a.model, &model, err);
    if (status != BF_OK)
        return status;
    outputs_note_input(a.input);
    status = atomic_check(a.output, err);
    if (status == BF_OK)
        status = record_spool_read(a.input, a.output, &input, err);
    if (status == BF_OK) {
        status = simulate(&a, &model, &input, err);
        record_spool_close(&input);
    }
    model_free(&model);
    return status;
}

const struct command command_simulate = {
    .place = 30,
    .name = "simulate",
    .summary = "run a model on the inputs of a record",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
