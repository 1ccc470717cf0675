/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>

#include "commands.h"
#include "ground/ground.h"
#include "board/board.h"

static const struct answer_field difference_fields[] = {
    ANSWER_ROW(TEXT, "what", "differs"),
    ANSWER_ROW(COUNT, "line", "of the recording"),
    ANSWER_ROW(COUNT, "sequence", "the board's number of the sample"),
    ANSWER_ROW(COUNT, "step", "of the model"),
    ANSWER_ROW(NUMBER, "recorded", "by the board"),
    ANSWER_ROW(NUMBER, "computed", "here"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the recording"),
    ANSWER_ROW(COUNT, "rows", "of the recording"),
    ANSWER_ROW(COUNT, "compared", "samples that were compared"),
    ANSWER_ROW(BOOL, "equal", "all of them, bit for bit"),
    ANSWER_ROW(COUNT, "before_rest", "samples before the model was put to rest"),
    ANSWER_ROW(COUNT, "after_gap", "samples after a hole, up to the next rest"),
    ANSWER_ROW(COUNT, "gaps", "holes"),
    ANSWER_ROW(COUNT, "rests", "times that the model was put to rest"),
    ANSWER_ROW(COUNT, "resets", "times that the board began anew"),
    ANSWER_ROW(COUNT, "other_image", "samples of another image"),
    ANSWER_SAY("{file}: {compared} of {rows} samples compared, {equal?all equal bit for bit|they differ}"),
    ANSWER_SAY("[{before_rest?}  {before_rest} {before_rest#sample|samples} before the model was at rest]"),
    ANSWER_SAY("[{after_gap?}  {after_gap} {after_gap#sample|samples} between a lost one and the next rest]"),
    ANSWER_SAY("[{gaps?}  {gaps} {gaps#gap|gaps}]"),
    ANSWER_SAY("[{resets?}  {resets} {resets#sample|samples} in which the state was reset]"),
    ANSWER_SAY("[{other_image?}  {other_image} {other_image#sample|samples} of another image]"),
    ANSWER_ROW_OF(OBJECT, "first_difference", "null: none", difference_fields, .flags = ANSWER_NULL | ANSWER_MAYBE),
    {0},
};

static const char help[] =
    "Usage: beamfit replay RECORDING --image IMAGE [--json]\n"
    "\n"
    "Proves that the controller computed what this machine computes. RECORDING is what `beamfit record` \n"
    "wrote: with each sample come the drive's code and the controller's prediction. The image is stepped here, by the\n"
    "library that the controller runs, from the sample in which the model was put to rest (step 0); every\n"
    "prediction must be equal bit for bit. After a lost sample the state is not known until the model is at rest\n"
    "again; what lies between is not compared, and counted. A recording with --prescale above 1 is lost samples\n"
    "all over and cannot be compared.\n";

static const struct option_row options[] = {
    {'i', 'i', "image", "IMAGE", NULL, "the image that ran (beamfit upload reads it back)"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit replay live.csv --image fitted.bfi\n"
    "\n"
    "Exit status: 0 all compared samples are equal; 1 one differs, or the image is damaged; 2 usage; 3 no such\n"
    "recording, or nothing in it can be compared (it says why).\n";

static const char *what_differs(enum replay_difference difference)
{
    static const char *const names[] = {[REPLAY_EQUAL] = "nothing",
                                        [REPLAY_INPUT] = "input",
                                        [REPLAY_PREDICTED] = "predicted",
                                        [REPLAY_STATUS] = "status"};
    return names[difference];
}

static enum bf_status print(const char *recording, const struct replay *r, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "file", recording);
    json_put_number(root, "rows", (double)r->rows);
    json_put_number(root, "compared", (double)r->compared);
    json_put_bool(root, "equal", r->difference == REPLAY_EQUAL);
    json_put_number(root, "before_rest", (double)r->before_rest);
    json_put_number(root, "after_gap", (double)r->after_gap);
    json_put_number(root, "gaps", (double)r->gaps);
    json_put_number(root, "rests", (double)r->rests);
    json_put_number(root, "resets", (double)r->resets);
    json_put_number(root, "other_image", (double)r->other_image);
    if (r->difference != REPLAY_EQUAL) {
        struct json *first = json_put(root, "first_difference", json_new_object());
        json_put_text(first, "what", what_differs(r->difference));
        json_put_number(first, "line", (double)r->line);
        json_put_number(first, "sequence", (double)r->sequence);
        json_put_number(first, "step", (double)r->step);
        json_put_number(first, "recorded", (double)r->recorded);
        json_put_number(first, "computed", (double)r->computed);
    }
    return answer_print_and_free(root, fields, err);
}

static enum bf_status answer(const char *recording, const struct replay *r, struct bf_error *err)
{
    const enum bf_status status = print(recording, r, err);
    if (status != BF_OK || r->difference == REPLAY_EQUAL)
        return status;
    if (r->difference == REPLAY_INPUT)
        return bf_fail(err, BF_NO,
                       "%s:%ld: input is %.9g, but the image makes %.9g of the drive's code; another image ran, or the "
                       "recording was edited",
                       recording, r->line, (double)r->recorded, (double)r->computed);
    return bf_fail(err, BF_NO,
                   "%s:%ld: sample %lu, step %lu: %s is %.9g there and %.9g here; compare the versions of firmware and "
                   "program, or another image ran",
                   recording, r->line, (unsigned long)r->sequence, (unsigned long)r->step, what_differs(r->difference),
                   (double)r->recorded, (double)r->computed);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    const char *image = NULL;
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == '?')
            return BF_USAGE;
        image = optarg;
    }
    if (argc - optind != 1 || image == NULL)
        return bf_fail(err, BF_USAGE,
                       "give a recording and the image that ran: beamfit replay RECORDING --image IMAGE");
    const char *recording = argv[optind];
    struct beam_image_file file;
    struct replay replay;
    enum bf_status status = target_image_read(image, &file, err);
    if (status != BF_OK)
        return status;
    const struct target_controller any = {.stored = -1};
    const enum beam_image_fault fault = target_image_check(&file, &any);
    if (fault != BEAM_IMAGE_FINE)
        return bf_fail(err, BF_NO, "%s: %s", image, beam_image_fault_text(fault));
    status = replay_run(recording, &file, &replay, err);
    return status == BF_OK ? answer(recording, &replay, err) : status;
}

const struct command command_replay = {
    .place = 220,
    .name = "replay",
    .summary = "did the controller compute what this machine computes?",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
