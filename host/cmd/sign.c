/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>

#include "commands.h"
#include "image_fields.h"
#include "ground/ground.h"
#include "signing.h"

static const struct answer_field fields[] = {
    TARGET_IMAGE_FIELDS,
    ANSWER_ROW_OF(LIST, "uses", "effects that run in the step", target_image_use_fields),
    ANSWER_ROW_OF(LIST, "poles", "of the step", target_image_pole_fields),
    ANSWER_ROW(TEXT, "file", "the image"),
    ANSWER_SAY("{file}: signed for device {device}, counter {counter}"),
    {0},
};

static const char help[] =
    "Usage: beamfit sign IMAGE --key FILE --device HEX --counter N -o SIGNED [--json]\n"
    "\n"
    "Addresses an image to one controller and signs it: HMAC-SHA256 with that controller's key over everything\n"
    "else in the image, its device and counter included. A controller refuses an image that is not signed with\n"
    "its key, is for another device, or whose counter is not above the one it has stored. An image may be signed\n"
    "again.\n";

static const struct option_row options[] = {
    {'k', 0, "key", "FILE", NULL,
     "64 hexadecimal digits or 32 bytes; mode 0600, your own. To make one: (umask 077; head -c 32 "
     "/dev/urandom > board.key)"},
    {'d', 0, "device", "HEX", NULL, "identity of the controller, 24 hexadecimal digits (beamfit info prints them)"},
    {'c', 0, "counter", "N", NULL, "1 to 4294967295, above the stored one (beamfit info)"},
    {'o', 'o', "output", "SIGNED", NULL, "the signed image"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace SIGNED even when it is IMAGE itself, or no image"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit sign fitted.bfi --key board.key --device 0123456789abcdef01234567 --counter 8 -o signed.bfi\n"
    "\n"
    "Exit status: 0 done; 1 the image is damaged and was not signed; 2 usage; 3 bad image or key file, or SIGNED\n"
    "not writable.\n";

struct arguments {
    const char *image, *output;
    struct signing signing;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    enum bf_status status = BF_OK;
    while (status == BF_OK && (code = options_next(argc, argv, options, err)) != -1) {
        if (code == 'o')
            a->output = optarg;
        else if (code == 'k')
            a->signing.key_file = optarg;
        else if (code == 'd')
            status = signing_take_device(&a->signing, optarg, err);
        else if (code == 'c')
            status = signing_take_counter(&a->signing, optarg, err);
        else
            status = BF_USAGE;
    }
    if (status != BF_OK)
        return status;
    if (argc - optind != 1 || a->output == NULL)
        return bf_fail(err, BF_USAGE, "give an image and an output: beamfit sign IMAGE ... -o SIGNED");
    a->image = argv[optind];
    return signing_complete(&a->signing, false, err);
}

static enum bf_status answer(const struct arguments *a, const struct beam_image_file *file, struct bf_error *err)
{
    struct json *root = target_image_file_json(file);
    json_put_text(root, "file", a->output);
    answer_next(root, "beamfit", "download", a->output, "--port", "PORT", "--key", "FILE", NULL);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.image = NULL};
    struct beam_image_file file;
    enum bf_status status = parse(argc, argv, &a, err);
    if (status == BF_OK)
        status = target_image_read(a.image, &file, err);
    if (status != BF_OK)
        return status;
    const struct target_controller any = {.stored = -1};
    const enum beam_image_fault fault = target_image_check(&file, &any);
    if (fault != BEAM_IMAGE_FINE)
        return bf_fail(err, BF_NO, "%s: %s", a.image, beam_image_fault_text(fault));
    status = atomic_check_file(a.output, err);
    if (status == BF_OK)
        status = signing_sign(&a.signing, &file, err);
    if (status == BF_OK)
        status = target_image_write(a.output, &file, err);
    return status == BF_OK ? answer(&a, &file, err) : status;
}

const struct command command_sign = {
    .place = 200,
    .name = "sign",
    .summary = "address an image to a controller and sign it",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
