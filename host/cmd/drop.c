/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "commands.h"
#include "ground/ground.h"
#include "model/model.h"

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(TEXT, "effect", "the id that was taken out"),
    ANSWER_ROW(TEXTS, "effects", "ids that remain"),
    ANSWER_SAY("{file}: without {effect}[; left: {effects}][{effects!}; no effect is left]"),
    {0},
};

static const char help[] =
    "Usage: beamfit drop MODEL ID -o NEW\n"
    "\n"
    "Takes an effect out of a model (every use of it). Comments and order of the rest of the file are kept;\n"
    "standard errors and the results of the last fit are left out, because they do not describe the new model.\n";

static const struct option_row options[] = {
    {'o', 'o', "output", "NEW", NULL, "the file to write; - is standard output"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace NEW even when `drop` has not made it or somebody has changed it"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit drop fitted.yaml mains_hum -o without_hum.yaml\n"
    "\n"
    "Exit status: 0 done; 2 usage, or the model has no such effect; 3 bad model file or NEW not writable.\n";

static enum bf_status answer(const char *output, const char *id, const struct model *model, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "file", output);
    json_put_text(root, "effect", id);
    struct json *left = json_put(root, "effects", json_new_array());
    for (size_t i = 0; i < model->n_effects; i++)
        json_push_text(left, model->effects[i].effect->id);
    answer_next(root, "beamfit", "fit", output, "RECORD...", "-o", "FITTED", NULL);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    const char *output = NULL;
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == '?')
            return BF_USAGE;
        output = optarg;
    }
    if (argc - optind != 2 || !output)
        return bf_fail(err, BF_USAGE, "give a model, an effect and an output: beamfit drop MODEL ID -o NEW");
    bool to_stdout = strcmp(output, "-") == 0;
    if (options_one_answer(output, err) != BF_OK)
        return BF_USAGE;
    const char *path = argv[optind], *id = argv[optind + 1];
    struct model model;
    enum bf_status status = model_read(path, &model, err);
    if (status != BF_OK)
        return status;
    status = model_drop_effect(&model, id, err);
    if (status == BF_OK)
        status = model_write(output, &model, err);
    if (status == BF_OK && !to_stdout)
        status = answer(output, id, &model, err);
    model_free(&model);
    return status;
}

const struct command command_drop = {
    .place = 90,
    .name = "drop",
    .summary = "take an effect out of a model",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
