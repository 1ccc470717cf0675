/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "board/board.h"
#include "commands.h"
#include "image_fields.h"
#include "ground/ground.h"
#include "signing.h"

static const char help[] =
    "Usage: beamfit export MODEL -o IMAGE [--key FILE --device HEX --counter N] [options]\n"
    "\n"
    "Makes the image that a controller runs: MODEL in ten dimensions with the drive as input and the sensor as\n"
    "output, its exact step in 24-bit numbers, the board's scales, the expected noise, and a proof run that the\n"
    "controller repeats bit for bit before it takes the image. The model file says what the controller is wired\n"
    "to, where a value is (code - zero_code) x per_code:\n"
    "\n"
    "  board:\n"
    "    sample_Hz: 1024\n"
    "    core_MHz: 168           # clock of its processor (the default)\n"
    "    sensor: {output: piezo_V, per_code: 0.001, zero_code: 2048}   # A/D\n"
    "    drive: {input: drive_V, per_code: 0.02, zero_code: 2048}      # D/A\n"
    "    noise_rms: 0.002        # sensor's unit; absent: of the last fit\n"
    "    alarm_ratio: 3          # the alarm goes on above 3 times the noise,\n"
    "    clear_ratio: 2          # and off below 2 times\n"
    "    averaging_s: 1          # of the running mean and rms\n"
    "    quiet_ratio: 0.2        # sensor fault below 0.2 of the noise,\n"
    "    offset_ratio: 1         # offset: residual's mean above the noise\n";

enum board_option {
    SAMPLE = 256,
    CORE,
    SENSOR,
    SENSOR_PER_CODE,
    SENSOR_ZERO,
    DRIVE,
    DRIVE_PER_CODE,
    DRIVE_ZERO,
    NOISE,
    ALARM,
    CLEAR,
    AVERAGING,
    QUIET,
    OFFSET
};

static const struct option_row options[] = {
    {'o', 'o', "output", "IMAGE", NULL, "the image"},
    {'k', 0, "key", "FILE", NULL,
     "sign it with this key (64 hexadecimal digits or 32 bytes, mode 0600); needs --device and --counter. "
     "Without a key the image is unsigned and no controller takes it"},
    {'d', 0, "device", "HEX", NULL, "identity of the controller, 24 hexadecimal digits (beamfit info prints them)"},
    {'c', 0, "counter", "N", NULL, "1 to 4294967295, above the one stored in the controller (beamfit info)"},
    {'h', 0, "hold", "HOW", "zoh|foh",
     "what the drive does between samples: held, as after a D/A (default), or linear"},
    {'p', 0, "plain", NULL, NULL,
     "the ten-dimensional model alone. Without it two more blocks of the step answer for what is faster "
     "than the model's modes (62 instructions): a tenth of the error under a held drive"},
    {'t', 0, "track", NULL, NULL,
     "the board follows frequency, damping and gain of the lowest modes, three at most, beside the model, which stays "
     "as it "
     "is (beamfit monitor shows them)"},
    {'w', 0, "without", "ID", NULL, "leave this effect out of the image; again for more"},
    {'a', 0, "a2l", "FILE", NULL, "also write the A2L description for measurement and calibration tools"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace a file even when `export` has not made it or somebody has changed it"},
    OPTIONS_ANSWER,
    {.what = "Instead of what the model's board block says:"},
    {SAMPLE, 0, "sample-Hz", "HZ", NULL, "samples a second"},
    {CORE, 0, "core-MHz", "MHZ", NULL, "clock of the processor"},
    {SENSOR, 0, "sensor", "OUTPUT", NULL, "the model's output on the A/D"},
    {SENSOR_PER_CODE, 0, "sensor-per-code", "K", NULL, "its unit per code"},
    {SENSOR_ZERO, 0, "sensor-zero-code", "CODE", NULL, "the code that is 0"},
    {DRIVE, 0, "drive", "INPUT", NULL, "the model's input on the D/A"},
    {DRIVE_PER_CODE, 0, "drive-per-code", "K", NULL, "its unit per code"},
    {DRIVE_ZERO, 0, "drive-zero-code", "CODE", NULL, "the code that is 0"},
    {NOISE, 0, "noise-rms", "X", NULL, "noise of the sensor, its unit"},
    {ALARM, 0, "alarm-ratio", "R", NULL, "the alarm goes on above so many times the noise"},
    {CLEAR, 0, "clear-ratio", "R", NULL, "and off below"},
    {AVERAGING, 0, "averaging-s", "S", NULL, "time constant of mean and rms"},
    {QUIET, 0, "quiet-ratio", "R", NULL, "sensor fault below so many times the noise"},
    {OFFSET, 0, "offset-ratio", "R", NULL, "offset above so many times the noise"},
    {0},
};

static const char closing[] =
    "A bound of the step's instructions is computed from the plan, every law with all its evaluations, and must\n"
    "fit the interval at the board's rate and clock: laws get fewer than 16 evaluations where that helps (4 at\n"
    "least), else there is no image. The board computes the bound again, and refuses what does not fit.\n"
    "\n"
    "Effects of the structure are inside the matrices; laws, filters, maps and drives run in the step. Effects\n"
    "whose time or phase begins with a recording (mains_hum, base_motion, thermal_drift) and large_rotation\n"
    "cannot run on a controller: export says so.\n"
    "\n"
    "Example:\n"
    "  beamfit export fitted.yaml -o fitted.bfi --key board.key --device 0123456789abcdef01234567 --counter 7\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad model or key file, or IMAGE not writable; 4 no step can be made.\n";

struct arguments {
    const char *model, *output, *a2l;
    struct signing signing;
    struct target_options target;
    const char **without;
};

static enum bf_status take_name(const char *option, char out[MODEL_NAME], struct bf_error *err)
{
    if (!optarg[0] || strlen(optarg) >= MODEL_NAME)
        return bf_fail(err, BF_USAGE, "%s %.80s: the model has no such channel", option, optarg);
    memcpy(out, optarg, strlen(optarg) + 1);
    return BF_OK;
}

static enum bf_status take_number(const char *option, bool positive, double *out, struct bf_error *err)
{
    return positive ? options_positive(option, optarg, INFINITY, out, err) : options_number(option, optarg, out, err);
}

static enum bf_status take_board(struct target_options *t, int code, struct bf_error *err)
{
    struct model_board *b = &t->board;
    switch (code) {
    case SAMPLE:
        return take_number("--sample-Hz", true, &b->sample_Hz, err);
    case CORE:
        return options_positive("--core-MHz", optarg, 4000.0, &b->core_MHz, err);
    case SENSOR:
        return take_name("--sensor", b->sensor, err);
    case SENSOR_PER_CODE:
        return take_number("--sensor-per-code", false, &b->sensor_per_code, err);
    case SENSOR_ZERO:
        t->sensor_zero = true;
        return take_number("--sensor-zero-code", false, &b->sensor_zero_code, err);
    case DRIVE:
        return take_name("--drive", b->drive, err);
    case DRIVE_PER_CODE:
        return take_number("--drive-per-code", false, &b->drive_per_code, err);
    case DRIVE_ZERO:
        t->drive_zero = true;
        return take_number("--drive-zero-code", false, &b->drive_zero_code, err);
    case NOISE:
        return take_number("--noise-rms", true, &b->noise_rms, err);
    case ALARM:
        return take_number("--alarm-ratio", true, &b->alarm_ratio, err);
    case CLEAR:
        return take_number("--clear-ratio", true, &b->clear_ratio, err);
    case AVERAGING:
        return take_number("--averaging-s", true, &b->averaging_s, err);
    case QUIET:
        return options_positive("--quiet-ratio", optarg, 1.0, &b->quiet_ratio, err);
    case OFFSET:
        return take_number("--offset-ratio", true, &b->offset_ratio, err);
    default:
        return BF_USAGE; /* options_next() has said why */
    }
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    static const char *const holds[] = {"zoh", "foh"};
    size_t chosen = 0;
    switch (code) {
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'k':
        a->signing.key_file = optarg;
        return BF_OK;
    case 'd':
        return signing_take_device(&a->signing, optarg, err);
    case 'c':
        return signing_take_counter(&a->signing, optarg, err);
    case 'h':
        if (options_choice("--hold", optarg, holds, 2, &chosen, err) != BF_OK)
            return BF_USAGE;
        a->target.hold = chosen == 0 ? BEAM_HOLD_ZERO_ORDER : BEAM_HOLD_FIRST_ORDER;
        return BF_OK;
    case 'w':
        a->without = bf_grow(a->without, a->target.n_without + 1, sizeof *a->without);
        a->without[a->target.n_without++] = optarg;
        return BF_OK;
    case 't':
        a->target.tracks = true;
        return BF_OK;
    case 'p':
        a->target.plain = true;
        return BF_OK;
    case 'a':
        a->a2l = optarg;
        return BF_OK;
    default:
        return take_board(&a->target, code, err);
    }
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    a->target.hold = BEAM_HOLD_ZERO_ORDER;
    while ((code = options_next(argc, argv, options, err)) != -1)
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    if (argc - optind != 1 || a->output == NULL)
        return bf_fail(err, BF_USAGE, "give a model and an output: beamfit export MODEL -o IMAGE");
    if (a->a2l != NULL && strcmp(a->a2l, a->output) == 0)
        return bf_fail(err, BF_USAGE, "-o and --a2l name the same file; choose another name for one");
    a->model = argv[optind];
    a->target.without = a->without;
    return signing_complete(&a->signing, true, err);
}

static enum bf_status answer(const struct arguments *a, const struct target_image *image, struct bf_error *err)
{
    struct json *root = target_image_json(image);
    json_put_text(root, "file", a->output);
    if (a->a2l != NULL)
        json_put_text(root, "a2l", a->a2l);
    if (target_image_is_signed(&image->file))
        answer_next(root, "beamfit", "verify", a->output, "--key", "FILE", NULL);
    answer_next(root, "beamfit", "download", a->output, "--port", "PORT", "--key", "FILE", NULL);
    return answer_print_and_free(root, target_image_fields, err);
}

static enum bf_status make(const struct arguments *a, const struct model *model, struct bf_error *err)
{
    struct target_image *image = bf_alloc(1, sizeof *image);
    enum bf_status status = atomic_check_file(a->output, err);
    if (status == BF_OK)
        status = atomic_check_file(a->a2l, err);
    if (status == BF_OK)
        status = target_image_make(model, &a->target, image, err);
    if (status == BF_OK && a->signing.key_file != NULL)
        status = signing_sign(&a->signing, &image->file, err);
    if (status == BF_OK)
        status = target_image_write(a->output, &image->file, err);
    if (status == BF_OK && a->a2l != NULL)
        status = a2l_write(a->a2l, image, err);
    if (status == BF_OK)
        status = answer(a, image, err);
    target_image_free(image);
    free(image);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.model = NULL};
    struct model model;
    enum bf_status status = parse(argc, argv, &a, err);
    if (status == BF_OK)
        status = model_read(a.model, &model, err);
    if (status == BF_OK) {
        status = make(&a, &model, err);
        model_free(&model);
    }
    free(a.without);
    return status;
}

const struct command command_export = {
    .place = 190,
    .name = "export",
    .summary = "the image of a model for a controller",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = target_image_fields,
    .run = run,
};
