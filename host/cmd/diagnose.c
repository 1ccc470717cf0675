/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "explain/explain.h"
#include "ground/ground.h"
#include "record_sets.h"
#include "show/show.h"

static const char help[] =
    "Usage: beamfit diagnose MODEL RECORD... [--check RECORD...] [options]\n"
    "\n"
    "Says whether physics is missing from a model, where it shows, which effect of the catalogue it is, how sure that "
    "is,\n"
    "how much of the misfit it explains, and what remains. The model is fitted first (its values are the start), then\n"
    "effects are added and everything is fitted again, from the model as given and from the fitted one, one by one and "
    "in\n"
    "pairs. What stands out of the others, in held-out records too, is named with its probability.\n"
    "\n"
    "  --check RECORD...     records that are held out: predicted, never fitted (all names up to the next option). "
    "With\n"
    "                        them the answer is far safer: give excitations unlike those fitted. Without them and "
    "with\n"
    "                        two or more records each record is left out in turn and predicted by a fit to the "
    "others.\n"
    "  --without ID,ID...    effects that are not considered\n"
    "  --effects N           effects in one explanation, at most (1 to 3, default 3)\n"
    "  -o, --output NEW      writes the model with the named effects at the values found; the fitted model when none "
    "is "
    "named\n"
    "  --plot DIR            pictures: misfit before and after, ranking, frequency and damping against amplitude, the\n"
    "                        missing force\n"
    "  --everything          fit every candidate, short-listed or not (slow; for comparison)\n"
    "  --intersample HOW     what inputs do between samples: bl (band-limited, default), foh (linear), zoh (held)\n"
    "  --splines N[,uniform] elements of the spline space, 5 to 1000 (default 160), and\n"
    "  --oversample N        steps a sample of nonlinear effects, 1 to 64 (default: the model's steps_per_sample, "
    "else\n"
    "                        8 for forces at a point and 4 over the span, and more where the best laws need them)\n"
    "  --threads N           default: one a processor\n"
    "  --json                the answer as JSON on standard output, and nothing else: {\"verdict\", \"effects\",\n"
    "                        \"probability\" (that they are the cause), \"explained\" (share of the misfit's power "
    "above the\n"
    "                        noise, of held-out records where there are any), \"nrmse_before\", \"nrmse_after\",\n"
    "                        \"noise_ratio_before\", \"noise_ratio_after\", \"check_nrmse_before\", "
    "\"check_nrmse_after\",\n"
    "                        \"check_kind\" (\"records\" held out, \"cross-validation\" or \"none\"), \"where\": "
    "[{\"file\",\n"
    "                        \"channel\", \"from_Hz\", \"to_Hz\", \"share\", \"amplitude\"}], \"remains\": "
    "{\"noise_ratio\", \"nrmse\",\n"
    "                        \"where\", \"text\"}, \"candidates\": [{\"effects\", \"channels\", \"probability\", "
    "\"explained\",\n"
    "                        \"held_out_explained\", \"p_value\", \"bic_gain\", \"nrmse_after\", "
    "\"check_nrmse_after\",\n"
    "                        \"parameters\", \"other_at_m\" (another place that does as well, or null)}], "
    "\"decision\":\n"
    "                        [{\"effects\": [[ID...]...], \"probability\", \"features\"}] (the best explanation, the "
    "best two...),\n"
    "                        \"rig\": {\"free\", \"channels\"} (places and gains, fitted although held),\n"
    "                        \"numerics\": {\"change_over_noise\", \"file\", \"channel\", \"converged\", \"fine\"} "
    "(twice as fine\n"
    "                        a computation), \"attainable\": {\"nrmse\", \"noise_ratio\", \"modes\", \"poles\"} (what "
    "the best\n"
    "                        linear model with as many modes leaves; null: not known), \"next\": [COMMAND...], "
    "\"text\",\n"
    "                        \"seconds\", ...}\n"
    "\n"
    "Verdicts: complete (nothing is missing that the records could show), missing (one explanation stands out), "
    "ambiguous\n"
    "(the cause is probably among the listed ones), unknown (something is missing and no effect stands out).\n"
    "Ctrl-C ends the search: what is known so far is reported, nothing is named (unknown, \"interrupted\": true), and "
    "no\n"
    "picture is drawn. A second Ctrl-C ends the program at once.\n"
    "\n"
    "Example:\n"
    "  beamfit diagnose fitted.yaml hit1.csv chirp1.csv --check hit2.csv --plot pictures\n"
    "\n"
    "Exit status: 0 done, whatever the verdict, or interrupted; 2 usage; 3 bad model or record; 4 the model cannot be "
    "evaluated.\n";

struct arguments {
    struct record_sets sets;
    char *without_text;
    const char **without; /* n_without of the options */
    const char *plot, *output;
    bool json;
    struct diagnose_options options;
};

static enum bf_status take_without(struct arguments *a, const char *text, struct bf_error *err)
{
    free(a->without_text);
    a->without_text = bf_strdup(text);
    a->options.n_without = 0;
    char *rest = NULL;
    for (char *id = strtok_r(a->without_text, ",", &rest); id != NULL; id = strtok_r(NULL, ",", &rest)) {
        if (effect_find(id, err) == NULL)
            return BF_USAGE;
        a->without = bf_grow(a->without, a->options.n_without + 1, sizeof *a->without);
        a->without[a->options.n_without++] = id;
    }
    a->options.without = a->without;
    return BF_OK;
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    enum { MOST_THREADS = 256, MOST_STEPS = 64 };
    long count = 0;
    enum bf_status status = BF_OK;
    switch (code) {
    case 'w':
        return take_without(a, optarg, err);
    case 'e':
        status = options_count("--effects", optarg, 1, DIAGNOSE_EFFECTS, &count, err);
        a->options.most_effects = (size_t)count;
        return status;
    case 't':
        status = options_count("--threads", optarg, 1, MOST_THREADS, &count, err);
        a->options.threads = (int)count;
        return status;
    case 'n':
        status = options_count("--oversample", optarg, 1, MOST_STEPS, &count, err);
        a->options.predict.oversample = (int)count;
        return status;
    case 's':
        return splines_from_text(optarg, &a->options.predict, err);
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'p':
        a->plot = optarg;
        return BF_OK;
    case 'a':
        a->options.everything = true;
        return BF_OK;
    case 'i':
        return intersample_from_text(optarg, &a->options.predict.intersample, err);
    case 'j':
        a->json = true;
        return BF_OK;
    default:
        return BF_USAGE;
    }
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    static const struct option options[] = {
        RECORD_SETS_CHECK,
        {"without", required_argument, NULL, 'w'},
        {"effects", required_argument, NULL, 'e'},
        {"plot", required_argument, NULL, 'p'},
        {"output", required_argument, NULL, 'o'},
        {"everything", no_argument, NULL, 'a'},
        {"intersample", required_argument, NULL, 'i'},
        {"splines", required_argument, NULL, 's'},
        {"oversample", required_argument, NULL, 'n'},
        {"threads", required_argument, NULL, 't'},
        {"json", no_argument, NULL, 'j'},
        {0},
    };
    int code;
    while ((code = record_sets_next(&a->sets, argc, argv, "-:o:", options, err)) != -1)
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    if (a->sets.fitted.n_names < 1)
        return bf_fail(err, BF_USAGE, "give a model and at least one record: beamfit diagnose MODEL RECORD...");
    return BF_OK;
}

static enum bf_status write_found(const struct arguments *a, const struct diagnosis *diagnosis, struct bf_error *err)
{
    struct model found;
    enum bf_status status = diagnose_found(diagnosis, &found, err);
    if (!status)
        status = model_write(a->output, &found, err);
    model_free(&found);
    return status;
}

static enum bf_status answer(const struct arguments *a, const struct model *model, struct diagnosis *diagnosis,
                             struct bf_error *err)
{
    const struct record_list *fitted = &a->sets.fitted, *held_out = &a->sets.held_out;
    progress_catch_interrupts();
    enum bf_status status =
        diagnose_run(model, fitted->records, fitted->n, held_out->records, held_out->n, &a->options, diagnosis, err);
    if (status)
        return status;
    if (a->output && !diagnosis->interrupted)
        status = write_found(a, diagnosis, err);
    if (!status && a->json)
        status = json_print_and_free(diagnose_json(diagnosis, a->output), stdout, err);
    else if (!status)
        diagnose_print(stdout, diagnosis, a->output);
    if (!status && a->plot)
        status = diagnose_plot(diagnosis, &a->options.predict, a->plot, err);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct model model = {0};
    struct diagnosis diagnosis = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    if (!status)
        status = model_read(a.sets.model, &model, err);
    if (!status)
        status = record_sets_read(&a.sets, err);
    if (!status)
        status = answer(&a, &model, &diagnosis, err);
    diagnose_free(&diagnosis);
    model_free(&model);
    record_sets_free(&a.sets);
    free(a.without), free(a.without_text);
    return status;
}

const struct command command_diagnose = {
    .place = 60,
    .name = "diagnose",
    .summary = "what physics the model lacks, where it shows, how sure that is",
    .help = help,
    .run = run,
};
