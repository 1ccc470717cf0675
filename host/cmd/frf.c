/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "ground/ground.h"
#include "maths/maths.h"
#include "record/record.h"
#include "response/response.h"
#include "show/show.h"

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(COUNT, "lines", "of each response"),
    ANSWER_ROW(NUMBER, "first_Hz", "frequency of the first line"),
    ANSWER_ROW(NUMBER, "step_Hz", "distance of the lines"),
    ANSWER_ROW(NUMBER, "last_Hz", "frequency of the last line"),
    ANSWER_SAY("{file}: {lines} lines, {first_Hz} to {last_Hz}"),
    ANSWER_ROW(TEXTS, "responses", "OUTPUT/INPUT, as they stand in the file", .flags = ANSWER_VERBATIM, .text = ""),
    {0},
};

static const char help[] =
    "Usage: beamfit frf MODEL -o OUT.uff [--to HZ] [--step HZ] [--json]\n"
    "\n"
    "Writes the frequency responses of a model, every output over every input, as a Universal File Format 58\n"
    "(text, complex, double precision), for other programs to draw over measured ones. Sensors, filters and gains\n"
    "are in them. `import` reads the file back.\n";

static const struct option_row options[] = {
    {'o', 'o', "output", "OUT", NULL, "the file to write"},
    {'t', 0, "to", "HZ", NULL, "highest frequency (default: some 1.2 times the fifth mode)"},
    {'s', 0, "step", "HZ", NULL, "distance of the lines (default: a thousandth of the highest)"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace OUT even when `frf` has not made it or somebody has changed it"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit frf fitted.yaml --to 500 --step 0.5 -o fitted.uff\n"
    "\n"
    "Exit status: 0 done; 2 usage, or a model that is not linear; 3 bad model file or OUT not writable; 4 the\n"
    "model cannot be evaluated.\n";

enum { MOST_LINES = 1 << 18, DEFAULT_LINES = 1000, DEFAULT_MODES = 5 };
static const double above_the_last = 1.2;

struct arguments {
    const char *model, *output;
    double to_Hz, step_Hz;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        enum bf_status status = BF_OK;
        switch (code) {
        case 'o':
            a->output = optarg;
            break;
        case 't':
            status = options_number("--to", optarg, &a->to_Hz, err);
            break;
        case 's':
            status = options_number("--step", optarg, &a->step_Hz, err);
            break;
        default:
            status = BF_USAGE;
        }
        if (status != BF_OK)
            return status;
    }
    if (optind + 1 != argc || a->output == NULL)
        return bf_fail(err, BF_USAGE, "say MODEL -o OUT.uff; beamfit frf --help explains");
    a->model = argv[optind];
    return options_one_answer(a->output, err);
}

/* Where none were asked for: up to above the fifth mode, in a thousand lines. */
static enum bf_status choose_lines(struct arguments *a, const struct model *model, size_t *lines, struct bf_error *err)
{
    double modes_Hz[DEFAULT_MODES];
    if (!(a->to_Hz > 0.0)) {
        const enum bf_status status = modes_frequencies(model, 0, false, DEFAULT_MODES, modes_Hz, err);
        if (status != BF_OK)
            return status;
        const double top_Hz = above_the_last * modes_Hz[DEFAULT_MODES - 1],
                     digit = pow(10.0, floor(log10(top_Hz)) - 1.0);
        a->to_Hz = digit * ceil(top_Hz / digit); /* two digits, as the file states six of a step */
    }
    if (!(a->step_Hz > 0.0))
        a->step_Hz = a->to_Hz / DEFAULT_LINES;
    const double n = floor(a->to_Hz / a->step_Hz * (1.0 + 1e-9));
    if (!(n >= 2.0 && n <= MOST_LINES))
        return bf_fail(err, BF_USAGE, "%.4g lines of %.6g Hz up to %.6g Hz; between 2 and %d can be written", n,
                       a->step_Hz, a->to_Hz, MOST_LINES);
    *lines = (size_t)n;
    return BF_OK;
}

/* One period with an impulse in one input: its answers are the responses' transforms. */
static void make_record(const struct model *model, size_t input, size_t n, double dt_s, struct record *out)
{
    double *x = bf_alloc(n, sizeof *x);
    *out = (struct record){.path = bf_strdup("impulse"), .n = n, .dt_s = dt_s};
    for (size_t o = 0; o < model->n_outputs; o++)
        record_add_column(out, model->outputs[o].name, x);
    x[0] = 1.0;
    record_add_column(out, model->inputs[input].name, x);
    record_add_meta(out, "excitation", "periodic");
    free(x);
}

/* H[n_outputs][lines + 1], the line at 0 Hz first. */
static enum bf_status respond(const struct model *model, size_t input, const struct arguments *a, size_t lines,
                              double complex H[], struct bf_error *err)
{
    const size_t n = fft_good_size(2 * (lines + 1));
    const struct predict_options how = {.quiet = true};
    struct record record;
    struct predictor *predictor = NULL;
    struct prediction y;
    struct parameter_ref *refs = NULL;
    const struct fft *plan;
    make_record(model, input, n, 1.0 / (a->step_Hz * (double)n), &record);
    const char *name = record_base_name(&record);
    enum bf_status status = fft_get(n, &plan, err);
    if (status == BF_OK)
        status = predictor_new(model, &record, 1, &how, &predictor, err);
    const size_t n_refs = model_parameters(model, &name, 1, &refs);
    double *theta = bf_alloc(n_refs, sizeof *theta);
    for (size_t i = 0; i < n_refs; i++)
        theta[i] = refs[i].value;
    if (status == BF_OK)
        status = predictor_run(predictor, theta, NULL, &y, err);
    double complex *Y = bf_alloc(n / 2 + 1, sizeof *Y);
    for (size_t o = 0; o < model->n_outputs && status == BF_OK; o++) {
        fft_forward(plan, y.y + o * n, Y);
        memcpy(H + o * (lines + 1), Y, (lines + 1) * sizeof *Y);
    }
    free(Y), free(theta), free(refs);
    predictor_free(predictor);
    record_free(&record);
    return status;
}

static struct uff_response describe(const struct model *model, size_t output, size_t input)
{
    static const struct {
        enum uff_quantity quantity;
        const char *unit;
    } of_output[] = {[OUTPUT_DISPLACEMENT] = {UFF_DISPLACEMENT, "m"},
                     [OUTPUT_VELOCITY] = {UFF_VELOCITY, "m/s"},
                     [OUTPUT_ACCELERATION] = {UFF_ACCELERATION, "m/s^2"},
                     [OUTPUT_PATCH_STRAIN] = {UFF_UNKNOWN, "V"}};
    const bool force = model->inputs[input].kind == INPUT_POINT_FORCE;
    return (struct uff_response){.output = model->outputs[output].name,
                                 .input = model->inputs[input].name,
                                 .output_node = model->n_inputs + output + 1,
                                 .input_node = input + 1,
                                 .output_quantity = of_output[model->outputs[output].kind].quantity,
                                 .output_unit = of_output[model->outputs[output].kind].unit,
                                 .input_quantity = force ? UFF_FORCE : UFF_UNKNOWN,
                                 .input_unit = force ? "N" : "V"};
}

static enum bf_status write_all(const struct arguments *a, const struct model *model, size_t lines,
                                struct bf_error *err)
{
    struct atomic_file out;
    char comment[81];
    enum bf_status status = atomic_open(a->output, &out, err);
    if (status != BF_OK)
        return status;
    (void)snprintf(comment, sizeof comment, "beamfit frf, model %.55s", text_base_name(a->model));
    double complex *H = bf_alloc(model->n_outputs * (lines + 1), sizeof *H);
    for (size_t i = 0; i < model->n_inputs && status == BF_OK; i++) {
        status = respond(model, i, a, lines, H, err);
        for (size_t o = 0; o < model->n_outputs && status == BF_OK; o++) {
            struct uff_response r = describe(model, o, i);
            r.first_Hz = r.step_Hz = a->step_Hz;
            r.n = lines;
            r.H = H + o * (lines + 1) + 1;
            response_write_uff(out.f, &r, comment);
        }
    }
    free(H);
    if (status == BF_OK) {
        outputs_mark(&out, "", "\n"); /* outside of datasets, where readers look for the next one */
        return atomic_commit(&out, err);
    }
    atomic_abort(&out);
    return status;
}

static enum bf_status answer(const struct arguments *a, const struct model *model, size_t lines, struct bf_error *err)
{
    char name[2 * MODEL_NAME + 2];
    struct json *root = json_new_object();
    json_put_text(root, "file", a->output);
    json_put_number(root, "lines", (double)lines);
    json_put_number(root, "first_Hz", a->step_Hz);
    json_put_number(root, "step_Hz", a->step_Hz);
    json_put_number(root, "last_Hz", a->step_Hz * (double)lines);
    struct json *list = json_put(root, "responses", json_new_array());
    for (size_t i = 0; i < model->n_inputs; i++)
        for (size_t o = 0; o < model->n_outputs; o++) {
            (void)snprintf(name, sizeof name, "%s/%s", model->outputs[o].name, model->inputs[i].name);
            json_push_text(list, name);
        }
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct model model;
    size_t lines = 0;
    if (parse(argc, argv, &a, err) != BF_OK)
        return BF_USAGE;
    enum bf_status status = model_read(a.model, &model, err);
    if (status != BF_OK)
        return status;
    status = atomic_check(a.output, err);
    if (status == BF_OK && (model.n_inputs == 0 || model.n_outputs == 0))
        status = bf_fail_at(err, a.model, 0, "a frequency response needs an input and an output; the model lacks one");
    if (status == BF_OK)
        status = choose_lines(&a, &model, &lines, err);
    if (status == BF_OK)
        status = write_all(&a, &model, lines, err);
    if (status == BF_OK && strcmp(a.output, "-") != 0)
        status = answer(&a, &model, lines, err);
    model_free(&model);
    return status;
}

const struct command command_frf = {
    .place = 35,
    .name = "frf",
    .summary = "a model's frequency responses as UFF 58, for other programs",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
