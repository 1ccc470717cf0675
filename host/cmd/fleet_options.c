/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fleet_options.h"

#include "response/response.h"

const struct option_row fleet_options[] = {
    {.name = "MANIFEST", .what = "the units, one a line"},
    {'o', 'o', "output", "FILE", NULL,
     "RESULTS, the SQLite file, made when missing; of `report` the page, of `fit` the fitted model"},
    {'d', 0, "diagnose", NULL, NULL, "also say what physics each unit's model lacks"},
    {'p', 0, "processes", "N", NULL,
     "units, or shares of the records of `fit`, at once on this machine, 1 to 256 (default: one a processor)"},
    {'l', 0, "limit", "S", NULL, "end a unit that takes longer, in seconds (default: none is ended)"},
    {'a', 0, "false-alarms", "P", NULL,
     "of `report`: how often a fleet in which nothing stands out has one that does (default 0.05)"},
    {'s', 0, "start", "HOW", "given|near|search", "as of `beamfit fit`"},
    {'n', 0, "no-search", NULL, NULL, "never search, even when the noise floor is missed"},
    OPTION_INTERSAMPLE('i'),
    {'N', 0, "splines", "N[,uniform]", NULL, "elements of the spline space, 5 to 1000 (default 160)"},
    {'k', 0, "key", "FILE", NULL, "of `export` and `download`: the key that the boards share (mode 0600)"},
    {'K', 0, "signing-key", "FILE", NULL,
     "of `download`: the key that signs, where the boards have another one for that; without it --key signs"},
    {'S', 0, "no-store", NULL, NULL, "of `download`: run it only until power off"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace a page or a fitted model even when `fleet` has not made it or somebody has changed it"},
    {OPTION_ALL, 0, "all", NULL, NULL, "of `report`: every unit that borrows from the fleet; of `fit` all columns"},
    OPTIONS_ANSWER,
    {0},
};

static const struct answer_field failed_fields[] = {
    ANSWER_ROW(TEXT, "unit", "as the manifest names it"),
    ANSWER_ROW(TEXT, "reason", "why there is no result"),
    ANSWER_SAY("  {unit}: {reason}"),
    {0},
};

static const struct answer_field board_fields[] = {
    ANSWER_ROW(TEXT, "unit", "as the manifest names it"),
    ANSWER_ROW(TEXT, "status", "runs, signed, unsigned or refused"),
    ANSWER_ROW(TEXT, "place", "port or file"),
    ANSWER_ROW(TEXT, "device", "identity of the board", .flags = ANSWER_MAYBE),
    ANSWER_ROW(COUNT, "counter", "of the image", .flags = ANSWER_MAYBE | ANSWER_NULL),
    ANSWER_ROW(BOOL, "stored", "it is there after the next power-on, too", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "model_sha256", "of the model's text in RESULTS", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "reason", "why it was refused"),
    ANSWER_SAY("[{reason?}{unit}: refused: {reason}]"),
    ANSWER_SAY("[{reason!}{unit}: {place}, {status}[, device {device}][, counter {counter}]]"),
    {0},
};

const struct answer_field fleet_fields[] = {
    ANSWER_ROW(TEXT, "results", "the SQLite file", .flags = ANSWER_MAYBE),
    ANSWER_ROW(COUNT, "units", "of the manifest", .flags = ANSWER_MAYBE),
    ANSWER_ROW(COUNT, "fitted", "by this run", .flags = ANSWER_MAYBE),
    ANSWER_ROW(BOOL, "diagnose", "and diagnosed", .flags = ANSWER_MAYBE),
    ANSWER_ROW(COUNT, "again", "of those, because a file, the settings or the program has changed since",
               .flags = ANSWER_MAYBE),
    ANSWER_ROW(COUNT, "unchanged", "units that were done before", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "seconds", "it took", .flags = ANSWER_MAYBE, .unit = "s", .digits = -1),
    ANSWER_SAY("[{units} units: {fitted} fitted[{diagnose?} and diagnosed] in {seconds}, {unchanged} as they were; "
               "{failed#} without a result[{failed?}:]]"),
    ANSWER_SAY("[{again?}{again} of them again: a file, the settings or the program has changed since]"),
    ANSWER_ROW_OF(LIST, "failed", "units without a result", failed_fields, .flags = ANSWER_MAYBE, .text = ""),
    ANSWER_ROW(COUNT, "refused", "of the boards, or images that could not be made", .flags = ANSWER_MAYBE),
    ANSWER_ROW_OF(LIST, "boards", "what became of each image", board_fields, .flags = ANSWER_MAYBE, .text = ""),
    ANSWER_SAY("[{boards#} {boards#image|images}, {refused} refused]"),
    ANSWER_ROW(TEXT, "page", "that `report` wrote", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "fitted_model", "that `fit` wrote", .flags = ANSWER_MAYBE),
    ANSWER_ROW_OF(OBJECT, "fit", "of one model to many records", fit_shared_fields, .flags = ANSWER_MAYBE, .text = ""),
    ANSWER_ROW_OF(OBJECT, "population", "what `report` says of the fleet", population_fields, .flags = ANSWER_MAYBE,
                  .text = ""),
    {0},
};
