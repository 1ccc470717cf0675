/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_fields.c — what each name in the answer of diagnose is, and how it reads as text. */
#include "diagnose_answer.h"
#include "show.h"

static const struct answer_field localisation_fields[] = {
    ANSWER_ROW(TEXT, "file", "the record"),
    ANSWER_ROW(TEXT, "channel", "of it"),
    ANSWER_ROW(NUMBER, "from_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "to_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "share", "of the misfit's power"),
    ANSWER_ROW(TEXT, "amplitude", "all, large or small: at which size of the motion"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over noise there"),
    ANSWER_ROW(NUMBER, "relative", "misfit over signal there"),
    ANSWER_ROW(NUMBER, "late_share", "of it in the later half"),
    {0},
};

static const struct answer_field parameter_fields[] = {
    ANSWER_ROW(NUMBER, "value", "in SI units"),
    ANSWER_ROW(NUMBER, "sd", "standard error"),
    ANSWER_ROW(NUMBERS, "ci95", "interval of 95 %: from, to", .flags = ANSWER_MAYBE),
    {0},
};

static const struct answer_field candidate_fields[] = {
    ANSWER_ROW(TEXT, "name", "effects with their places and channels", .text = "added and refitted"),
    ANSWER_ROW(TEXTS, "effects", "ids"),
    ANSWER_ROW(TEXTS, "channels", "on which each sits; empty: on the beam"),
    ANSWER_ROW(NUMBER, "p_value", "of the improvement by chance"),
    ANSWER_ROW(NUMBER, "bic_gain", "evidence"),
    ANSWER_ROW(NUMBER, "nrmse_after", "error with it"),
    ANSWER_ROW(NUMBER, "check_nrmse_after", "of held-out records"),
    ANSWER_ROW(NUMBER, "noise_ratio_after", "in units of the noise", .digits = -3, .text = "× noise"),
    ANSWER_ROW(NUMBER, "check_noise_ratio_after", "of held-out records", .digits = -3, .text = "held out"),
    ANSWER_ROW(NUMBER, "score", "by which candidates are ranked"),
    ANSWER_ROW(NUMBER, "explained", "share of the misfit's power above the noise", .flags = ANSWER_PERCENT,
               .digits = -2, .text = "explained"),
    ANSWER_ROW(NUMBER, "held_out_explained", "the same of held-out records", .flags = ANSWER_PERCENT, .digits = -2,
               .text = "held out"),
    ANSWER_ROW(NUMBER, "probability", "that it is the cause", .digits = -2, .text = "probability"),
    ANSWER_ROW(BOOL, "explains", "nothing that matters is left"),
    ANSWER_ROW(BOOL, "open_values", "held-out errors are with values fitted to all records"),
    ANSWER_ROW(BOOL, "rival", "as good as the best"),
    ANSWER_ROW(BOOL, "converged", "its fit did"),
    ANSWER_CELL("", "{rival?rival|}{converged?|*}"),
    ANSWER_ROW(NUMBER, "other_at_m", "another place that does as well; null: none"),
    ANSWER_ROW(NUMBER, "seconds", "its fit took", .unit = "s"),
    ANSWER_ROW_OF(MAP, "parameters", "of its effects, by name", parameter_fields),
    {0},
};

static const struct answer_field by_record_fields[] = {
    ANSWER_ROW(TEXT, "effect", "its id"),
    ANSWER_ROW(TEXT, "parameter", "that has a value of its own in each record"),
    ANSWER_ROW(TEXT, "unit", "of the values"),
    ANSWER_ROW(NUMBER, "noise_ratio_after", "what it leaves, in units of the noise"),
    ANSWER_ROW(NUMBER, "check_noise_ratio_after", "of held-out records, each with a value of its own, too; null: none",
               .flags = ANSWER_NULL),
    ANSWER_ROW(NUMBER, "explained", "share of the misfit's power"),
    ANSWER_ROW(NUMBER_MAP, "values", "in SI units, by record"),
    {0},
};

static const struct answer_field decision_fields[] = {
    ANSWER_ROW(TEXTS, "effects", "one of these is there"),
    ANSWER_ROW(TEXTS, "beside", "if these are, and the probability that they are is in its own"),
    ANSWER_ROW(TEXTS, "with", "the best explanation with one"),
    ANSWER_ROW(TEXTS, "without", "and without"),
    ANSWER_ROW(NUMBER, "probability", "that one is there"),
    ANSWER_ROW(NUMBER_MAP, "features", "from which the probability is computed (docs/diagnose.md, How sure)"),
    {0},
};

static const struct answer_field remains_fields[] = {
    ANSWER_ROW(NUMBER, "noise_ratio", "in units of the noise"),
    ANSWER_ROW(NUMBER, "nrmse", "error"),
    ANSWER_ROW_OF(LIST, "where", "bands of channels", localisation_fields),
    ANSWER_ROW(TEXT, "text", "in words"),
    {0},
};

static const struct answer_field linearity_fields[] = {
    ANSWER_ROW(TEXT, "verdict", "of the records alone"),
    ANSWER_ROW(NUMBER, "ratio", "of the pair that shows most"),
    ANSWER_ROW(TEXT, "text", "in words"),
    {0},
};

static const struct answer_field rig_channel_fields[] = {
    ANSWER_ROW(TEXT, "channel", "of the model"),      ANSWER_ROW(NUMBER, "at_m", "found"),
    ANSWER_ROW(NUMBER, "stated_at_m", "in the file"), ANSWER_ROW(NUMBER, "gain", "found"),
    ANSWER_ROW(NUMBER, "stated_gain", "in the file"), {0},
};

static const struct answer_field rig_fields[] = {
    ANSWER_ROW(BOOL, "free", "places and gains were fitted although the file holds them"),
    ANSWER_ROW_OF(LIST, "channels", "with what was found", rig_channel_fields),
    {0},
};

static const struct answer_field numerics_fields[] = {
    ANSWER_ROW(NUMBER, "change_over_noise", "of a computation twice as fine", .digits = 1),
    ANSWER_ROW(TEXT, "file", "the record where it is largest"),
    ANSWER_ROW(TEXT, "channel", "of it"),
    ANSWER_ROW(BOOL, "converged", "the change does not matter"),
    ANSWER_ROW(BOOL, "fine", "the finer computation was taken"),
    {0},
};

static const struct answer_field reconstruction_fields[] = {
    ANSWER_ROW(TEXT, "place", "point, patch or spread"),
    ANSWER_ROW(NUMBER, "at_m", "of a point"),
    ANSWER_ROW(BOOL, "located", "the place is certain"),
    ANSWER_ROW(NUMBER, "unexplained", "share of the misfit that such a force leaves"),
    ANSWER_ROW(NUMBER, "linear", "share of the force"),
    ANSWER_ROW(NUMBER, "elastic_odd", "share of the force"),
    ANSWER_ROW(NUMBER, "elastic_even", "share of the force"),
    ANSWER_ROW(NUMBER, "dissipative", "share of the force"),
    ANSWER_ROW(NUMBER, "memory", "share of the force"),
    ANSWER_ROW(NUMBER, "amplitude_power", "with which it grows"),
    ANSWER_ROW(NUMBER, "frequency_Hz", "of its resonance"),
    ANSWER_ROW(BOOL, "resonant", "it has one"),
    ANSWER_ROW(BOOL, "sensor_like", "it is rather in the sensor"),
    ANSWER_ROW(TEXT, "text", "in words"),
    {0},
};

const struct answer_field diagnose_fields[] = {
    ANSWER_ROW_OF(LIST, "record_findings", "what is wrong with records before any model", record_finding_fields,
                  .text = "In the records:"),
    ANSWER_SAY("[{record_findings?}\n]"),
    ANSWER_ROW_OF(LIST, "channel_factors", "wrong signs and units of channels", channel_factor_fields,
                  .text = "First of all:"),
    ANSWER_ROW_OF(LIST, "repeatability", "how well repeated records agree, free of any model", repeatability_fields,
                  .text = ""),
    ANSWER_SAY("[{channel_factors?}What follows is the diagnosis of the model with that changed.]"),
    ANSWER_SAY("[{channel_factors?}\n]"),
    ANSWER_ROW(TEXT, "verdict", "complete, missing, ambiguous or unknown"),
    ANSWER_ROW(TEXTS, "effects", "that are named"),
    ANSWER_ROW(BOOL, "interrupted", "by Ctrl-C"),
    ANSWER_SAY("Verdict: {verdict}{interrupted? (interrupted)|}[: {effects}]"),
    ANSWER_ROW(TEXT, "text", "the answer in a paragraph"),
    ANSWER_SAY("\n{text}"),
    ANSWER_ROW(NUMBER, "probability", "that they are the cause"),
    ANSWER_ROW(NUMBER, "explained",
               "share of the misfit's power above the noise, of held-out records where there are any"),
    ANSWER_ROW(NUMBER, "nrmse_before", "error of the fitted model"),
    ANSWER_ROW(NUMBER, "nrmse_after", "with the best explanation"),
    ANSWER_ROW(NUMBER, "noise_ratio_before", "in units of the noise", .digits = 4),
    ANSWER_ROW(NUMBER, "noise_ratio_after", "in units of the noise"),
    ANSWER_ROW(NUMBER, "check_nrmse_before", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_nrmse_after", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_noise_ratio_before", "of held-out records", .digits = 4),
    ANSWER_ROW(NUMBER, "check_noise_ratio_after", "of held-out records"),
    ANSWER_ROW_OF(OBJECT, "rig", "the rig", rig_fields),
    ANSWER_ROW(TEXT, "check_kind", "records, cross-validation or none: what held-out numbers are of"),
    ANSWER_ROW(TEXT, "where_text", "where the model as it is fails, in words"),
    ANSWER_SAY("[\nWhere the model as it is fails:{where_text?}]"),
    ANSWER_SAY("[  {where_text}]"),
    ANSWER_ROW_OF(LIST, "where", "the misfit is", localisation_fields),
    ANSWER_ROW_OF(OBJECT, "linearity", "of the beam, from the records alone", linearity_fields),
    ANSWER_SAY("[\nLinearity: \t{linearity.text}]"),
    ANSWER_ROW_OF(OBJECT, "attainable", "what the best linear model with as many modes leaves; null: not known",
                  attainable_fields, .flags = ANSWER_NULL, .text = "\n"),
    ANSWER_ROW_OF(OBJECT, "numerics", "how far the computation can be trusted", numerics_fields),
    ANSWER_SAY("[{numerics.fine?}\nComputation: twice as fine, the prediction changes by "
               "{numerics.change_over_noise} of the noise.]"),
    ANSWER_SAY("[{candidates?}\nThe model as it is: {noise_ratio_before} times the noise[ (held out: "
               "{check_noise_ratio_before})]]"),
    ANSWER_ROW_OF(LIST, "candidates", "best first", candidate_fields, .flags = ANSWER_TABLE, .most = DIAGNOSE_LISTED,
                  .text = "\n"),
    ANSWER_ROW(TEXT, "check_text", "how numbers of held-out records came about; empty: as it says"),
    ANSWER_ROW(BOOL, "all_converged", "the fits of the listed candidates did"),
    ANSWER_SAY("[{all_converged!}*: its fit has not converged]"),
    ANSWER_SAY("{check_text}"),
    ANSWER_ROW_OF(LIST, "by_record",
                  "if something was changed between the records: single effects that would explain most, best first",
                  by_record_fields),
    ANSWER_ROW_OF(LIST, "decision", "effects that are there, each with its probability", decision_fields),
    ANSWER_ROW_OF(OBJECT, "remains", "what the best answer leaves", remains_fields),
    ANSWER_ROW_OF(OBJECT, "reconstruction", "the missing force", reconstruction_fields, .flags = ANSWER_MAYBE),
    ANSWER_ROW(BOOL, "converged", "the computation is fine enough"),
    ANSWER_ROW(TEXTS, "notes", "on what looks ordinary", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXTS, "next", "commands that go on from here", .flags = ANSWER_VERBATIM, .text = "\nNext:"),
    ANSWER_ROW(COUNT, "evaluations", "of models"),
    ANSWER_ROW(COUNT, "refits_failed", "refits that found no value, and count for nothing"),
    ANSWER_ROW(NUMBER, "seconds", "it took", .unit = "s", .digits = -1),
    ANSWER_SAY("\n{seconds}, {evaluations} evaluations of a model[{refits_failed?}; {refits_failed} "
               "{refits_failed#refit|refits} found no value]"),
    {0},
};
