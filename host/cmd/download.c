/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

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
    {ANSWER_NUMBER, "seconds", "the transfer took", NULL, 0, "s"},
    {0},
};

static const char help[] =
    "Usage: beamfit download IMAGE --port PORT --key FILE [--no-store] [--sign] [--json]\n"
    "\n"
    "Gives the board a new model while it runs, without missing a sample. The image goes to a spare page; the board "
    "checks\n"
    "all of it (length, CRC-32, identity, counter, signature, stability, a proof run) and only then switches to it,\n"
    "between two samples. It is read back, compared byte by byte, and stored for the next power-on. Whenever that is\n"
    "interrupted, by Ctrl-C, a cable or power, the board runs and keeps the model it had, or has the new one whole;\n"
    "repeat the command.\n";

static const struct option_row options[] = {
    {.name = "IMAGE",
     .what = "written by `beamfit export`. One without a signature is signed on the way, for this board, with the "
             "next counter; the file is not changed"},
    BOARD_OPTIONS,
    {'k', 0, "key", "FILE", NULL, "the board's secret key: 64 hexadecimal digits, or 32 bytes, in a file of mode 0600"},
    {'s', 0, "sign", NULL, NULL, "sign it anew even if it is signed, e.g. to go back to an older model"},
    {'n', 0, "no-store", NULL, NULL, "run it only until power off"},
    OPTIONS_ANSWER('j'),
    {0},
};

static const char closing[] = "Example:\n"
                              "  beamfit export fitted.yaml -o fitted.img\n"
                              "  beamfit download fitted.img --port /dev/ttyUSB0 --key board.key\n"
                              "\n"
                              "Exit status: 0 done; 2 usage; 3 the image or the key file is bad; 5 no port, no answer, "
                              "or the board refused the key\n"
                              "or the image.\n";

struct arguments {
    struct board_options board;
    const char *image, *key;
    bool no_store, sign, json;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == 'k')
            a->key = optarg;
        else if (code == 'n')
            a->no_store = true;
        else if (code == 's')
            a->sign = true;
        else if (code == 'j')
            a->json = true;
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

/* What a board would say of it, said before anything is sent. The counter is judged where the board's is known. */
static enum bf_status check(const char *path, const struct beam_image_file *image,
                            const struct target_controller *board, struct bf_error *err)
{
    const enum beam_image_fault fault = target_image_check(image, board);
    if (fault == BEAM_IMAGE_FINE)
        return BF_OK;
    return bf_fail_at(err, path, 0, "the board would refuse this image: %s", beam_image_fault_text(fault));
}

static enum bf_status print(const struct arguments *a, const struct link *link, const struct beam_image_file *image,
                            bool signed_here, const struct link_download *done, struct bf_error *err)
{
    char device[DEVICE_ID_TEXT];
    device_id_print(link->info.device, device);
    const unsigned counter = (unsigned)image->front.header.counter;
    const bool stored = link->info.stored == counter;
    if (!a->json) {
        (void)printf("%s: %s on board %s as counter %u%s, %s (%.2f s)\n", a->image,
                     done->was_running ? "ran already" : "runs", device, counter, signed_here ? ", signed here" : "",
                     done->was_stored ? "was stored already"
                     : stored         ? "stored"
                                      : "not stored",
                     done->seconds);
        return BF_OK;
    }
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

static enum bf_status download(const struct arguments *a, struct link *link, const struct device_key *key,
                               struct beam_image_file *image, struct bf_error *err)
{
    struct link_download done = {.no_store = a->no_store};
    const bool sign = a->sign || !target_image_is_signed(image);
    if (sign) {
        const uint32_t seen = link->info.stored > link->info.counter ? link->info.stored : link->info.counter;
        if (seen == UINT32_MAX)
            return bf_fail(err, BF_DEVICE, "%s: the board's counter is at its end; it takes no further model",
                           a->board.port);
        target_image_sign(image, key, link->info.device, seen + 1);
    }
    const struct target_controller board = {.key = key,
                                            .device = link->info.device,
                                            .stored = -1,
                                            .sample_Hz = 1e-3 * (double)link->info.sample_mHz,
                                            .core_Hz = (double)link->info.core_Hz};
    if (check(a->image, image, &board, err) != BF_OK || link_unlock(link, key, a->key, err) != BF_OK ||
        link_download(link, image, &done, err) != BF_OK)
        return err->status;
    return print(a, link, image, sign, &done, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct beam_image_file image;
    struct device_key key;
    struct link link;
    if (parse(argc, argv, &a, err) != BF_OK || target_image_read(a.image, &image, err) != BF_OK ||
        device_key_read(a.key, &key, err) != BF_OK)
        return err->status;
    progress_catch_interrupts();
    const struct target_controller any = {.stored = -1};
    enum bf_status status = check(a.image, &image, &any, err);
    if (status == BF_OK)
        status = board_open(&a.board, &link, err);
    if (status == BF_OK) {
        status = download(&a, &link, &key, &image, err);
        link_close(&link);
    }
    device_key_wipe(&key);
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
