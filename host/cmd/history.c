/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "json.h"
#include "model.h"
#include "options.h"
#include "plot.h"
#include "text.h"

static const char help[] =
    "Usage: beamfit history MODEL... [--json] [--plot DIR]\n"
    "\n"
    "Puts models in the order in which they were made from each other (each file knows the SHA-256 of the file it was\n"
    "made from) and shows what each step brought: the effects gained and lost, and the errors its fit stated, on\n"
    "fitted records and on held-out ones. Nothing is computed again. A model whose parent is not given hangs on the\n"
    "nearest ancestor that is.\n"
    "\n"
    "  --json       {\"models\": [{\"file\", \"sha256\", \"parent\" (a file or null), \"effects\", \"gained\", "
    "\"lost\", \"fitted\",\n"
    "               \"nrmse\", \"noise_ratio\", \"check_nrmse\", \"check_noise_ratio\", \"converged\"}]}, oldest "
    "first;\n"
    "               null: none\n"
    "  --plot DIR   error against model, with the noise floor as a line, as DIR/history.png and .pdf\n"
    "\n"
    "Example:\n"
    "  beamfit history start.yaml fitted.yaml with_mass.yaml with_mass_fitted.yaml --plot pictures\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad model file or pictures not writable.\n";

enum { NONE = -1 };

struct entry {
    struct model model;
    const char *file;
    int parent; /* index, or NONE */
    int depth;  /* steps from its root */
    bool placed;
};

struct history {
    struct entry *entries;
    int n;
    int *order; /* [n] indices, every model after its parent */
};

static int find_sha256(const struct history *h, const char *sha256)
{
    for (int i = 0; i < h->n; i++)
        if (sha256[0] && strcmp(h->entries[i].model.sha256, sha256) == 0)
            return i;
    return NONE;
}

/* Nearest ancestor among the files given. A file cannot contain its own hash, so there is no circle. */
static int find_parent(const struct history *h, int i)
{
    const struct fit_info *fit = &h->entries[i].model.fit;
    int found = find_sha256(h, fit->parent_sha256);
    for (size_t k = 0; k < fit->n_ancestors && found == NONE; k++)
        found = find_sha256(h, fit->ancestors[k]);
    return found == i ? NONE : found;
}

/* Depth first from every root, in the order of the command line. */
static void place(struct history *h, int i, int depth, int *n_placed)
{
    if (h->entries[i].placed)
        return;
    h->entries[i].placed = true;
    h->entries[i].depth = depth;
    h->order[(*n_placed)++] = i;
    for (int k = 0; k < h->n; k++)
        if (h->entries[k].parent == i)
            place(h, k, depth + 1, n_placed);
}

static void sort_by_descent(struct history *h)
{
    int n_placed = 0;
    for (int i = 0; i < h->n; i++)
        h->entries[i].parent = find_parent(h, i);
    for (int i = 0; i < h->n; i++)
        if (h->entries[i].parent == NONE)
            place(h, i, 0, &n_placed);
    for (int i = 0; i < h->n; i++) /* claimed circles of forged hashes */
        place(h, i, 0, &n_placed);
}

static size_t count_effect(const struct model *model, const struct beam_effect *effect)
{
    size_t n = 0;
    for (size_t i = 0; i < model->n_effects; i++)
        n += model->effects[i].effect == effect;
    return n;
}

/* Calls back for every effect that `model` has more often than `than`, once per surplus. */
static void each_surplus(const struct model *model, const struct model *than, void (*call)(void *, const char *, bool),
                         void *context, bool gained)
{
    for (int i = 0; i < beam_effects_count; i++) {
        size_t n = count_effect(model, beam_effects[i]), m = than ? count_effect(than, beam_effects[i]) : 0;
        for (; n > m; n--)
            call(context, beam_effects[i]->id, gained);
    }
}

static const struct model *parent_of(const struct history *h, int i)
{
    int parent = h->entries[i].parent;
    return parent == NONE ? NULL : &h->entries[parent].model;
}

/* ---- JSON ---- */

static void push_id(void *context, const char *id, bool gained)
{
    (void)gained;
    json_push_text(context, id);
}

static double or_none(double x)
{
    return x > 0.0 ? x : (double)NAN;
}

static void put_entry(struct json *object, const struct history *h, int i)
{
    const struct entry *e = &h->entries[i];
    const struct model *parent = parent_of(h, i);
    const struct fit_info *fit = &e->model.fit;
    json_put_text(object, "file", e->file);
    json_put_text(object, "sha256", e->model.sha256);
    if (parent)
        json_put_text(object, "parent", h->entries[e->parent].file);
    else
        json_put_number(object, "parent", (double)NAN);
    struct json *effects = json_put(object, "effects", json_new_array());
    for (size_t k = 0; k < e->model.n_effects; k++)
        json_push_text(effects, e->model.effects[k].effect->id);
    struct json *gained = json_put(object, "gained", json_new_array());
    struct json *lost = json_put(object, "lost", json_new_array());
    if (parent) {
        each_surplus(&e->model, parent, push_id, gained, true);
        each_surplus(parent, &e->model, push_id, lost, false);
    }
    json_put_bool(object, "fitted", fit->present);
    json_put_number(object, "nrmse", or_none(fit->nrmse));
    json_put_number(object, "noise_ratio", or_none(fit->noise_ratio));
    json_put_number(object, "check_nrmse", or_none(fit->check_nrmse));
    json_put_number(object, "check_noise_ratio", or_none(fit->check_noise_ratio));
    json_put_bool(object, "converged", fit->present && fit->converged);
}

static enum bf_status print_json(const struct history *h, struct bf_error *err)
{
    struct json *root = json_new_object(), *models = json_put(root, "models", json_new_array());
    for (int i = 0; i < h->n; i++)
        put_entry(json_push(models, json_new_object()), h, h->order[i]);
    return json_print_and_free(root, stdout, err);
}

/* ---- Table ---- */

static void print_change(void *context, const char *id, bool gained)
{
    bool *first = context;
    (void)printf("%s%s%s", *first ? "" : " ", gained ? "+" : "−", id);
    *first = false;
}

static void print_number(double x, const char *format, int width)
{
    if (x > 0.0)
        (void)printf(format, width, x);
    else
        (void)printf("%*s", width, "-");
}

static void print_entry(const struct history *h, int i, size_t width)
{
    const struct entry *e = &h->entries[i];
    const struct model *parent = parent_of(h, i);
    const struct fit_info *fit = &e->model.fit;
    bool first = true;
    (void)printf("%*s", 2 * e->depth, "");
    text_print_padded(stdout, e->file, width - 2 * (size_t)e->depth);
    print_number(fit->nrmse, "%*.4g", 10);
    print_number(fit->noise_ratio, "%*.3f", 10);
    print_number(fit->check_nrmse, "%*.4g", 12);
    print_number(fit->check_noise_ratio, "%*.3f", 10);
    (void)fputs("  ", stdout);
    if (parent) {
        each_surplus(&e->model, parent, print_change, &first, true);
        each_surplus(parent, &e->model, print_change, &first, false);
    } else {
        each_surplus(&e->model, NULL, print_change, &first, true);
    }
    if (fit->present)
        (void)printf("%s%s", first ? "" : "; ", fit->converged ? "fitted" : "fit not converged");
    else if (first)
        (void)fputs("not fitted", stdout);
    (void)fputc('\n', stdout);
}

static void print_table(const struct history *h)
{
    size_t width = strlen("model");
    for (int i = 0; i < h->n; i++) {
        size_t w = text_width(h->entries[i].file) + 2 * (size_t)h->entries[i].depth;
        width = w > width ? w : width;
    }
    text_print_padded(stdout, "model", width);
    (void)printf("%10s%10s%12s%10s  step\n", "nrmse", "/ noise", "held-out", "/ noise");
    for (int i = 0; i < h->n; i++)
        print_entry(h, h->order[i], width);
    (void)puts("nrmse: residual rms over signal rms, of the fitted and of the held-out records; / noise: over the "
               "noise's rms.");
}

/* ---- Picture ---- */

/* Error that a perfect model would have: root mean square over channels, as nrmse is. 0: the noise is not known. */
static double noise_floor(const struct fit_info *fit, bool held_out)
{
    double sum = 0.0;
    size_t n = 0;
    for (size_t r = 0; r < fit->n_records; r++)
        for (size_t c = 0; c < fit->records[r].n_channels && fit->records[r].held_out == held_out; c++) {
            const struct fit_channel *channel = &fit->records[r].channels[c];
            if (!(channel->nrmse > 0.0 && channel->noise_ratio > 0.0))
                continue;
            sum += (channel->nrmse / channel->noise_ratio) * (channel->nrmse / channel->noise_ratio);
            n++;
        }
    return n > 0 ? sqrt(sum / (double)n) : 0.0;
}

static enum bf_status draw(const struct history *h, const char *directory, struct bf_error *err)
{
    const char **label = bf_alloc((size_t)h->n, sizeof *label);
    double *fitted = bf_alloc((size_t)h->n, sizeof *fitted), *held_out = bf_alloc((size_t)h->n, sizeof *held_out);
    double floor = 0.0, held_out_floor = 0.0; /* of the newest fit */
    size_t n = 0;
    for (int i = 0; i < h->n; i++) {
        const struct entry *e = &h->entries[h->order[i]];
        const struct fit_info *fit = &e->model.fit;
        if (!fit->present)
            continue;
        const char *slash = strrchr(e->file, '/');
        label[n] = slash ? slash + 1 : e->file;
        fitted[n] = or_none(fit->nrmse);
        held_out[n++] = or_none(fit->check_nrmse);
        floor = noise_floor(fit, false) > 0.0 ? noise_floor(fit, false) : floor;
        held_out_floor = noise_floor(fit, true) > 0.0 ? noise_floor(fit, true) : held_out_floor;
    }
    enum bf_status status = BF_OK;
    if (n == 0) {
        status = bf_fail(err, BF_USAGE, "none of the models was fitted, so there is no error to draw");
    } else {
        const struct plot_history plot = {.directory = directory,
                                          .stem = "history",
                                          .title = "Error against model",
                                          .n = n,
                                          .label = label,
                                          .fitted = fitted,
                                          .held_out = held_out,
                                          .noise_floor = floor,
                                          .held_out_floor = held_out_floor};
        status = plot_history(&plot, err);
    }
    free(label);
    free(fitted);
    free(held_out);
    return status;
}

static enum bf_status read_all(struct history *h, char **paths, int n, struct bf_error *err)
{
    h->entries = bf_alloc((size_t)n, sizeof *h->entries);
    h->order = bf_alloc((size_t)n, sizeof *h->order);
    for (; h->n < n; h->n++) {
        struct entry *e = &h->entries[h->n];
        enum bf_status status = model_read(paths[h->n], &e->model, err);
        if (status != BF_OK)
            return status;
        e->file = paths[h->n];
    }
    return BF_OK;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    static const struct option options[] = {
        {"json", no_argument, NULL, 'j'}, {"plot", required_argument, NULL, 'p'}, {0}};
    const char *directory = NULL;
    struct history h = {0};
    bool json = false;
    int code;
    while ((code = options_next(argc, argv, ":", options, err)) != -1) {
        if (code == '?')
            return BF_USAGE;
        if (code == 'p')
            directory = optarg;
        else
            json = true;
    }
    if (optind == argc)
        return bf_fail(err, BF_USAGE, "give the models to put in order; see 'beamfit history --help'");
    enum bf_status status = read_all(&h, argv + optind, argc - optind, err);
    if (status == BF_OK) {
        sort_by_descent(&h);
        if (json)
            status = print_json(&h, err);
        else
            print_table(&h);
    }
    if (status == BF_OK && directory)
        status = draw(&h, directory, err);
    for (int i = 0; i < h.n; i++)
        model_free(&h.entries[i].model);
    free(h.entries);
    free(h.order);
    return status;
}

const struct command command_history = {"history", "the chain of models with their errors, as a table and a picture",
                                        help, run};
