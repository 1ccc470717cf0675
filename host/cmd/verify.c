/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>

#include "commands.h"
#include "image_fields.h"
#include "ground/ground.h"
#include "signing.h"

static const struct answer_field fields[] = {
    TARGET_IMAGE_FIELDS,
    ANSWER_ROW(TEXT, "file", "the image"),
    ANSWER_ROW(BOOL, "fine", "a controller would take it"),
    ANSWER_ROW(COUNT, "fault", "number of what is wrong; 0: nothing"),
    ANSWER_ROW(TEXT, "reason", "the same in words"),
    ANSWER_ROW(BOOL, "code_checked", "a key was given, so that the signature was checked"),
    ANSWER_SAY("{file}: {reason}{code_checked?|; its code was not checked (--key)}"),
    TARGET_IMAGE_LINES,
    {0},
};

static const char help[] =
    "Usage: beamfit verify IMAGE [--key FILE] [--device HEX] [--stored N] [--sample-Hz HZ [--core-MHz MHZ]]\n"
    "                      [--json]\n"
    "\n"
    "Would a controller take this image? Every check that a controller makes, in its order and by its own\n"
    "code: magic, layout, length, CRC-32, device, counter, HMAC, setup, effects, the plan's finite and stable "
    "numbers,\n"
    "sample rate, and the proof run bit for bit. What is not given is not compared. Prints what the image\n"
    "contains.\n";

static const struct option_row options[] = {
    {'k', 0, "key", "FILE", NULL, "the controller's key (mode 0600): the HMAC must be right"},
    {'d', 0, "device", "HEX", NULL, "the image must be for this device"},
    {'s', 0, "stored", "N", NULL, "the image's counter must be above this one"},
    {'r', 0, "sample-Hz", "HZ", NULL, "the controller's sample rate"},
    {'m', 0, "core-MHz", "MHZ", NULL,
     "and its clock: does the step's bound fit its interval? (beamfit info prints both)"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit verify fitted.bfi --key board.key --device 0123456789abcdef01234567\n"
    "\n"
    "Exit status: 0 it is fine; 1 it is not, with the reason; 2 usage; 3 no image, or bad key file.\n";

struct arguments {
    const char *image;
    struct signing signing; /* the counter is the stored one */
    double sample_Hz, core_MHz;
};

static enum bf_status take_stored(const char *text, struct arguments *a, struct bf_error *err)
{
    long n;
    if (options_count("--stored", text, 0, UINT32_MAX, &n, err) != BF_OK)
        return BF_USAGE;
    a->signing.has_counter = true;
    a->signing.counter = (uint32_t)n;
    return BF_OK;
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    enum bf_status status = BF_OK;
    while (status == BF_OK && (code = options_next(argc, argv, options, err)) != -1) {
        if (code == 'k')
            a->signing.key_file = optarg;
        else if (code == 'd')
            status = signing_take_device(&a->signing, optarg, err);
        else if (code == 's')
            status = take_stored(optarg, a, err);
        else if (code == 'r')
            status = options_number("--sample-Hz", optarg, &a->sample_Hz, err);
        else if (code == 'm')
            status = options_positive("--core-MHz", optarg, 4000.0, &a->core_MHz, err);
        else
            status = BF_USAGE;
    }
    if (status != BF_OK)
        return status;
    if (argc - optind != 1)
        return bf_fail(err, BF_USAGE, "give one image: beamfit verify IMAGE");
    a->image = argv[optind];
    if (a->core_MHz > 0.0 && !(a->sample_Hz > 0.0))
        return bf_fail(err, BF_USAGE, "--core-MHz wants --sample-Hz too: an interval has as many cycles as both say");
    return BF_OK;
}

static enum bf_status answer(const struct arguments *a, const struct beam_image_file *file, enum beam_image_fault fault,
                             struct bf_error *err)
{
    const bool fine = fault == BEAM_IMAGE_FINE;
    const char *reason = beam_image_fault_text(fault);
    if (!fine && options_format() == OPTIONS_TEXT)
        return bf_fail(err, BF_NO, "%s: %s", a->image, reason);
    struct json *root = target_image_file_json(file);
    json_put_text(root, "file", a->image);
    json_put_bool(root, "fine", fine);
    json_put_number(root, "fault", (double)fault);
    json_put_text(root, "reason", reason);
    json_put_bool(root, "code_checked", a->signing.key_file != NULL);
    const enum bf_status status = answer_print_and_free(root, fields, err);
    return status != BF_OK || fine ? status : BF_NO;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.image = NULL};
    struct beam_image_file file;
    struct device_key key;
    size_t n = 0;
    enum bf_status status = parse(argc, argv, &a, err);
    if (status == BF_OK)
        status = target_image_load(a.image, &file, &n, err);
    if (status == BF_OK && a.signing.key_file != NULL)
        status = device_key_read(a.signing.key_file, &key, err);
    if (status != BF_OK)
        return status;
    const struct target_controller against = {.key = a.signing.key_file != NULL ? &key : NULL,
                                              .device = a.signing.has_device ? a.signing.device : NULL,
                                              .stored = a.signing.has_counter ? (int64_t)a.signing.counter : -1,
                                              .sample_Hz = a.sample_Hz,
                                              .core_Hz = 1e6 * a.core_MHz};
    enum beam_image_fault fault = target_image_check(&file, &against);
    device_key_wipe(&key);
    if (n != sizeof file && fault != BEAM_IMAGE_BAD_MAGIC && fault != BEAM_IMAGE_BAD_LAYOUT)
        fault = BEAM_IMAGE_BAD_LENGTH;
    return answer(&a, &file, fault, err);
}

const struct command command_verify = {
    .place = 210,
    .name = "verify",
    .summary = "would a controller take this image?",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
