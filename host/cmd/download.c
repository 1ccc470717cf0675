/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "board_give.h"
#include "board_options.h"
#include "commands.h"
#include "ground/ground.h"
#include "board/board.h"

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the image that was given to the board"),
    ANSWER_ROW(TEXT, "port", "of the board"),
    ANSWER_ROW(TEXT, "device", "identity of the board, 24 hexadecimal digits"),
    ANSWER_ROW(COUNT, "counter", "of the image on the board"),
    ANSWER_ROW(BOOL, "signed_here", "this command has signed it"),
    ANSWER_ROW(COUNT, "bytes", "of the image"),
    ANSWER_ROW(BOOL, "was_running", "the board ran it already"),
    ANSWER_ROW(BOOL, "stored", "it is there after the next power-on, too"),
    ANSWER_ROW(NUMBER, "seconds", "the transfer took", .unit = "s", .digits = -2),
    ANSWER_SAY("{file}: {was_running?ran already|runs} on board {device} as counter {counter}[{signed_here?}, signed "
               "here], {stored?stored|not stored} ({seconds})"),
    {0},
};

static const char help[] =
    "Usage: beamfit download IMAGE --port PORT --key FILE [--no-store] [--sign] [--json]\n"
    "\n"
    "Gives the board a new model while it runs, without missing a sample. The image goes to a spare page; the\n"
    "board checks all of it (length, CRC-32, identity, counter, signature, stability, a proof run) and only then\n"
    "switches to it, between two samples. It is read back, compared byte by byte, and stored for the next\n"
    "power-on. Whenever that is interrupted, by Ctrl-C, a cable or power, the board runs and keeps the model it\n"
    "had, or has the new one whole; repeat the command.\n";

static const struct option_row options[] = {
    {.name = "IMAGE",
     .what = "written by `beamfit export`. One without a signature is signed on the way, for this board, with the "
             "next counter; the file is not changed"},
    BOARD_OPTIONS,
    {'k', 0, "key", "FILE", NULL, "the board's secret key: 64 hexadecimal digits, or 32 bytes, in a file of mode 0600"},
    {'K', 0, "signing-key", "FILE", NULL,
     "the key that signs, where the board has another one for that; without it --key signs, and a signed image needs "
     "none"},
    {'s', 0, "sign", NULL, NULL, "sign it anew even if it is signed, e.g. to go back to an older model"},
    {'n', 0, "no-store", NULL, NULL, "run it only until power off"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit export fitted.yaml -o fitted.img\n"
    "  beamfit download fitted.img --port /dev/ttyUSB0 --key board.key\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 the image or the key file is bad; 5 no port, no answer, or the board refused\n"
    "the key or the image.\n";

struct arguments {
    struct board_options board;
    const char *image, *key, *signing_key;
    bool no_store, sign;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == 'k')
            a->key = optarg;
        else if (code == 'K')
            a->signing_key = optarg;
        else if (code == 'n')
            a->no_store = true;
        else if (code == 's')
            a->sign = true;
        else if (board_take_option(code, &a->board, err) != BF_OK)
            return BF_USAGE;
    }
    if (optind + 1 != argc)
        return bf_fail(err, BF_USAGE, "give one image: beamfit download IMAGE --port PORT --key FILE");
    a->image = argv[optind];
    if (a->key == NULL)
        return bf_fail(err, BF_USAGE, "a board takes a model only from who has its key: --key FILE");
    return board_check_options(&a->board, "download", err);
}

static enum bf_status print(const struct arguments *a, const struct link *link, const struct beam_image_file *image,
                            bool signed_here, const struct link_download *done, struct bf_error *err)
{
    char device[DEVICE_ID_TEXT];
    device_id_print(link->info.device, device);
    const unsigned counter = (unsigned)image->front.header.counter;
    const bool stored = link->info.stored == counter;
    struct json *root = json_new_object();
    json_put_text(root, "file", a->image);
    json_put_text(root, "port", a->board.port);
    json_put_text(root, "device", device);
    json_put_number(root, "counter", counter);
    json_put_bool(root, "signed_here", signed_here);
    json_put_number(root, "bytes", BEAM_IMAGE_BYTES);
    json_put_bool(root, "was_running", done->was_running);
    json_put_bool(root, "stored", stored);
    json_put_number(root, "seconds", done->seconds);
    answer_next(root, "beamfit", "monitor", "--port", a->board.port, NULL);
    return answer_print_and_free(root, fields, err);
}

/* A board may have one key for sessions and one for images: who has the first alone cannot judge a code. */
static enum bf_status download(const struct arguments *a, struct link *link, const struct device_key *key,
                               const struct device_key *signing, struct beam_image_file *image, struct bf_error *err)
{
    struct link_download done = {.no_store = a->no_store};
    const bool sign = a->sign || !target_image_is_signed(image);
    const struct device_key *judge = sign || a->signing_key != NULL ? signing : NULL;
    if (board_give(link, key, a->key, judge, a->image, sign, image, &done, err) != BF_OK)
        return err->status;
    return print(a, link, image, sign, &done, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct beam_image_file image;
    struct device_key key, signing;
    struct link link;
    if (parse(argc, argv, &a, err) != BF_OK || target_image_read(a.image, &image, err) != BF_OK ||
        device_key_read(a.signing_key != NULL ? a.signing_key : a.key, &signing, err) != BF_OK ||
        device_key_read(a.key, &key, err) != BF_OK)
        return err->status;
    progress_catch_interrupts();
    const struct target_controller any = {.stored = -1};
    enum bf_status status = board_check_image(a.image, &image, &any, err);
    if (status == BF_OK)
        status = board_open(&a.board, &link, err);
    if (status == BF_OK) {
        status = download(&a, &link, &key, &signing, &image, err);
        link_close(&link);
    }
    device_key_wipe(&key);
    device_key_wipe(&signing);
    return status;
}

const struct command command_download = {
    .place = 170,
    .name = "download",
    .summary = "give the board a new model, while it runs",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
