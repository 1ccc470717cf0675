/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>

#include "board_options.h"
#include "commands.h"
#include "ground/ground.h"
#include "board/board.h"

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(TEXT, "port", "of the board"),
    ANSWER_ROW(TEXT, "device", "identity of the board, 24 hexadecimal digits"),
    ANSWER_ROW(COUNT, "counter", "of the image"),
    ANSWER_ROW(TEXT, "page", "active or staging: which page of the board"),
    ANSWER_ROW(BOOL, "signed", "it carries a signature"),
    ANSWER_ROW(COUNT, "bytes", "of the image"),
    ANSWER_SAY("{file}: the {page} page of board {device}, counter {counter}, {bytes} bytes"),
    {0},
};

static const char help[] =
    "Usage: beamfit upload --port PORT -o IMAGE [--staging] [--json]\n"
    "\n"
    "Reads the model that the board runs into an image file, every byte compared by CRC-32. `beamfit verify`\n"
    "tells what is in it; `beamfit download --sign` gives it to the board again later. No key is needed: a model\n"
    "is no secret.\n";

static const struct option_row options[] = {
    BOARD_OPTIONS,
    {'o', 'o', "output", "IMAGE", NULL, "the file to write"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace IMAGE even when `upload` has not made it or somebody has changed it"},
    {'s', 0, "staging", NULL, NULL, "the spare page instead: what was written last, whole or not, or the model before"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] = "Example:\n"
                              "  beamfit upload --port /dev/ttyUSB0 -o now.img\n"
                              "\n"
                              "Exit status: 0 done; 2 usage; 3 IMAGE not writable; 5 no port or no answer.\n";

struct arguments {
    struct board_options board;
    const char *output;
    bool staging;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == 'o')
            a->output = optarg;
        else if (code == 's')
            a->staging = true;
        else if (board_take_option(code, &a->board, err) != BF_OK)
            return BF_USAGE;
    }
    if (optind < argc || a->output == NULL)
        return bf_fail(err, BF_USAGE, "give one file to write: beamfit upload --port PORT -o IMAGE");
    return board_check_options(&a->board, "upload", err);
}

static enum bf_status print(const struct arguments *a, const struct link *link, const struct beam_image_file *image,
                            struct bf_error *err)
{
    char device[DEVICE_ID_TEXT];
    const unsigned counter = (unsigned)image->front.header.counter;
    device_id_print(link->info.device, device);
    struct json *root = json_new_object();
    json_put_text(root, "file", a->output);
    json_put_text(root, "port", a->board.port);
    json_put_text(root, "device", device);
    json_put_number(root, "counter", counter);
    json_put_text(root, "page", a->staging ? "staging" : "active");
    json_put_bool(root, "signed", target_image_is_signed(image));
    json_put_number(root, "bytes", BEAM_IMAGE_BYTES);
    answer_next(root, "beamfit", "verify", a->output, NULL);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct beam_image_file image;
    struct link link;
    if (parse(argc, argv, &a, err) != BF_OK)
        return err->status;
    if (atomic_check_file(a.output, err) != BF_OK)
        return err->status;
    progress_catch_interrupts();
    if (board_open(&a.board, &link, err) != BF_OK)
        return err->status;
    enum bf_status status = link_upload(&link, a.staging ? BEAM_WIRE_PAGE_STAGING : BEAM_WIRE_PAGE_ACTIVE, &image, err);
    if (status == BF_OK)
        status = target_image_write(a.output, &image, err);
    if (status == BF_OK)
        status = print(&a, &link, &image, err);
    link_close(&link);
    return status;
}

const struct command command_upload = {
    .place = 160,
    .name = "upload",
    .summary = "read the board's model into an image file",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
