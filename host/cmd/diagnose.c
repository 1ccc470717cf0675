/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "diagnose.h"
#include "options.h"
#include "progress.h"

static const char help[] =
    "Usage: beamfit diagnose MODEL RECORD... [--check RECORD...] [options]\n"
    "\n"
    "Says whether physics is missing from a model, where it shows, which effect of the catalogue it is, how sure that "
    "is\n"
    "and what would settle a doubt. The model is fitted first (its values are the start), then every effect that "
    "could\n"
    "act is scored, the promising ones are added and everything is fitted again, one by one and in pairs; what "
    "predicts\n"
    "the held-out records down to their noise is named.\n"
    "\n"
    "  --check RECORD...     records that are held out: predicted, never fitted (all names up to the next option). "
    "With\n"
    "                        them the answer is far safer: give excitations unlike those fitted. Two or three\n"
    "                        effects together are named only when such records confirm them\n"
    "  --without ID,ID...    effects that are not considered\n"
    "  --effects N           effects in one explanation, at most (1 to 3, default 3)\n"
    "  --plot DIR            pictures: misfit before and after, ranking, frequency and damping against amplitude, the\n"
    "                        missing force\n"
    "  --everything          fit every candidate, short-listed or not (slow; for comparison)\n"
    "  --intersample HOW     what inputs do between samples: bl (band-limited, default), foh (linear), zoh (held)\n"
    "  --threads N           default: one a processor\n"
    "  --json                the answer as JSON on standard output, and nothing else: {\"verdict\", \"effects\",\n"
    "                        \"nrmse_before\", \"nrmse_after\", \"noise_ratio_before\", \"noise_ratio_after\",\n"
    "                        \"check_nrmse_before\", \"check_nrmse_after\", \"where\": [{\"file\", \"channel\",\n"
    "                        \"from_Hz\", \"to_Hz\", \"share\", \"amplitude\"}], \"candidates\": [{\"effects\",\n"
    "                        \"channels\", \"p_value\", \"bic_gain\", \"nrmse_after\", \"check_nrmse_after\", "
    "\"parameters\"}],\n"
    "                        \"text\", \"seconds\", ...}\n"
    "\n"
    "Verdicts: complete (nothing significant is left), missing (one explanation, named), ambiguous (these records "
    "cannot\n"
    "tell the listed ones apart), unknown (something is missing and nothing in the catalogue explains it).\n"
    "Ctrl-C ends the search; what is known so far is reported.\n"
    "\n"
    "Example:\n"
    "  beamfit diagnose fitted.yaml hit1.csv chirp1.csv --check hit2.csv --plot pictures\n"
    "\n"
    "Exit status: 0 done, whatever the verdict; 2 usage; 3 bad model or record; 4 the model cannot be evaluated.\n";

struct names {
    size_t n;
    const char **list;
};

struct arguments {
    struct names fitted, held_out, without; /* fitted.list[0] is the model */
    char *without_text;
    const char *plot;
    bool json;
    struct diagnose_options options;
};

static void add_name(struct names *names, const char *name)
{
    names->list = bf_grow(names->list, names->n + 1, sizeof *names->list);
    names->list[names->n++] = name;
}

static enum bf_status take_without(struct arguments *a, const char *text, struct bf_error *err)
{
    free(a->without_text);
    a->without_text = bf_strdup(text);
    a->without.n = 0;
    char *rest = NULL;
    for (char *id = strtok_r(a->without_text, ",", &rest); id != NULL; id = strtok_r(NULL, ",", &rest)) {
        if (effect_find(id, err) == NULL)
            return BF_USAGE;
        add_name(&a->without, id);
    }
    return BF_OK;
}

static enum bf_status take_count(const char *option, const char *text, long most, long *out, struct bf_error *err)
{
    char *end;
    *out = strtol(text, &end, 10);
    if (end == text || *end != '\0' || *out < 1 || *out > most)
        return bf_fail(err, BF_USAGE, "%s %s: give a whole number from 1 to %ld", option, text, most);
    return BF_OK;
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    enum { MOST_THREADS = 256 };
    long count = 0;
    enum bf_status status = BF_OK;
    switch (code) {
    case 'w':
        return take_without(a, optarg, err);
    case 'e':
        status = take_count("--effects", optarg, DIAGNOSE_EFFECTS, &count, err);
        a->options.most_effects = (size_t)count;
        return status;
    case 't':
        status = take_count("--threads", optarg, MOST_THREADS, &count, err);
        a->options.threads = (int)count;
        return status;
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

/* Names are taken in order: those after --check, up to the next option, are held out. */
static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    static const struct option options[] = {
        {"check", no_argument, NULL, 'c'},
        {"without", required_argument, NULL, 'w'},
        {"effects", required_argument, NULL, 'e'},
        {"plot", required_argument, NULL, 'p'},
        {"everything", no_argument, NULL, 'a'},
        {"intersample", required_argument, NULL, 'i'},
        {"threads", required_argument, NULL, 't'},
        {"json", no_argument, NULL, 'j'},
        {0},
    };
    bool checking = false;
    int code;
    while ((code = options_next(argc, argv, "-:", options, err)) != -1) {
        if (code == 1) {
            add_name(checking ? &a->held_out : &a->fitted, optarg);
            continue;
        }
        checking = code == 'c';
        if (code != 'c' && take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    }
    for (; optind < argc; optind++)
        add_name(checking ? &a->held_out : &a->fitted, argv[optind]);
    if (a->fitted.n < 2)
        return bf_fail(err, BF_USAGE, "give a model and at least one record: beamfit diagnose MODEL RECORD...");
    a->options.without = a->without.list;
    a->options.n_without = a->without.n;
    return BF_OK;
}

struct work {
    struct model model;
    struct record *fitted, *held_out;
    size_t n_fitted, n_held_out;
    struct diagnosis diagnosis;
};

static enum bf_status read_records(const struct names *names, size_t skip, struct record **out, size_t *n,
                                   struct bf_error *err)
{
    *out = bf_alloc(names->n, sizeof **out);
    for (size_t i = skip; i < names->n; i++) {
        const enum bf_status status = record_read(names->list[i], &(*out)[*n], err);
        if (status)
            return status;
        (*n)++;
    }
    return BF_OK;
}

static void work_free(struct work *w)
{
    diagnose_free(&w->diagnosis);
    for (size_t i = 0; i < w->n_fitted; i++)
        record_free(&w->fitted[i]);
    for (size_t i = 0; i < w->n_held_out; i++)
        record_free(&w->held_out[i]);
    free(w->fitted), free(w->held_out);
    model_free(&w->model);
}

static enum bf_status answer(const struct arguments *a, struct work *w, struct bf_error *err)
{
    progress_catch_interrupts();
    enum bf_status status =
        diagnose_run(&w->model, w->fitted, w->n_fitted, w->held_out, w->n_held_out, &a->options, &w->diagnosis, err);
    if (status)
        return status;
    if (a->json)
        status = json_print_and_free(diagnose_json(&w->diagnosis), stdout, err);
    else
        diagnose_print(stdout, &w->diagnosis);
    if (!status && a->plot)
        status = diagnose_plot(&w->diagnosis, &a->options.predict, a->plot, err);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct work w = {0};
    enum bf_status status = parse(argc, argv, &a, err);
    if (!status)
        status = model_read(a.fitted.list[0], &w.model, err);
    if (!status)
        status = read_records(&a.fitted, 1, &w.fitted, &w.n_fitted, err);
    if (!status)
        status = read_records(&a.held_out, 0, &w.held_out, &w.n_held_out, err);
    if (!status)
        status = answer(&a, &w, err);
    work_free(&w);
    free(a.fitted.list), free(a.held_out.list), free(a.without.list), free(a.without_text);
    return status;
}

const struct command command_diagnose = {
    .name = "diagnose",
    .summary = "what physics the model lacks, where it shows, how sure that is",
    .help = help,
    .run = run,
};
