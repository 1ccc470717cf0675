/* SPDX-License-Identifier: GPL-3.0-or-later */
/* history.c — the order of models by descent, and what each step brought. */
#include "compare.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "ground/ground.h"

enum { MOST_FILES = 1000, MOST_BYTES = 1 << 22 };
enum { HISTORY_NONE = -1 }; /* the index of a parent that is not among the entries */

/* ---- Order ---- */

static int find_sha256(const struct history *h, const char *sha256)
{
    for (int i = 0; i < h->n; i++)
        if (sha256[0] && strcmp(h->entries[i].model.sha256, sha256) == 0)
            return i;
    return HISTORY_NONE;
}

/* Nearest ancestor among the files given. A file cannot contain its own hash, so there is no circle. */
static int find_parent(const struct history *h, int i)
{
    const struct fit_info *fit = &h->entries[i].model.fit;
    int found = find_sha256(h, fit->parent_sha256);
    for (size_t k = 0; k < fit->n_ancestors && found == HISTORY_NONE; k++)
        found = find_sha256(h, fit->ancestors[k]);
    return found == i ? HISTORY_NONE : found;
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
    free(h->order);
    h->order = bf_alloc((size_t)h->n, sizeof *h->order);
    for (int i = 0; i < h->n; i++) {
        h->entries[i].placed = false;
        h->entries[i].depth = 0;
    }
    for (int i = 0; i < h->n; i++)
        h->entries[i].parent = find_parent(h, i);
    for (int i = 0; i < h->n; i++)
        if (h->entries[i].parent == HISTORY_NONE)
            place(h, i, 0, &n_placed);
    for (int i = 0; i < h->n; i++) /* models that claim to be each other's ancestor have no root */
        place(h, i, 0, &n_placed);
}

static size_t count_effect(const struct model *model, const struct beam_effect *effect)
{
    size_t n = 0;
    for (size_t i = 0; i < model->n_effects; i++)
        n += model->effects[i].effect == effect;
    return n;
}

void history_surplus(const struct model *model, const struct model *than, void (*call)(void *, const char *, bool),
                     void *context, bool gained)
{
    for (int i = 0; i < beam_effects_count; i++) {
        size_t n = count_effect(model, beam_effects[i]), m = than ? count_effect(than, beam_effects[i]) : 0;
        for (; n > m; n--)
            call(context, beam_effects[i]->id, gained);
    }
}

const struct model *history_parent(const struct history *h, int i)
{
    int parent = h->entries[i].parent;
    return parent == HISTORY_NONE ? NULL : &h->entries[parent].model;
}

double history_error(double x)
{
    return x > 0.0 ? x : (double)NAN;
}

/* ---- What a step brought ---- */

/* A text that is being put together; it never grows beyond its size. */
struct step_text {
    char *text;
    size_t size;
};

static void add_words(struct step_text *t, const char *before, const char *words)
{
    const size_t n = strlen(t->text);
    (void)snprintf(t->text + n, t->size - n, "%s%s", before, words);
}

static void add_change(void *context, const char *id, bool gained)
{
    struct step_text *t = context;
    add_words(t, t->text[0] ? " " : "", gained ? "+" : "−");
    add_words(t, "", id);
}

void history_step(const struct history *h, int i, char *text, size_t size)
{
    const struct history_entry *e = &h->entries[i];
    const struct model *parent = history_parent(h, i);
    struct step_text t = {text, size};
    text[0] = '\0';
    history_surplus(&e->model, parent, add_change, &t, true);
    if (parent)
        history_surplus(parent, &e->model, add_change, &t, false);
    if (e->model.fit.present)
        add_words(&t, text[0] ? "; " : "", e->model.fit.converged ? "fitted" : "fit not converged");
    else if (text[0] == '\0')
        add_words(&t, "", "not fitted");
}

int history_fits(const struct history *h)
{
    int n = 0;
    for (int i = 0; i < h->n; i++)
        n += h->entries[i].model.fit.present;
    return n;
}

/* ---- Reading ---- */

static struct history_entry *add_entry(struct history *h, const char *path)
{
    h->entries = bf_grow(h->entries, (size_t)h->n + 1, sizeof *h->entries);
    struct history_entry *e = &h->entries[h->n];
    *e = (struct history_entry){.file = bf_strdup(path), .parent = HISTORY_NONE};
    h->n++; /* from here on it is freed with the others */
    return e;
}

enum bf_status history_read(const char *const paths[], size_t n, struct history *out, struct bf_error *err)
{
    *out = (struct history){0};
    for (size_t i = 0; i < n; i++)
        if (model_read(paths[i], &add_entry(out, paths[i])->model, err) != BF_OK)
            return err->status;
    sort_by_descent(out);
    return BF_OK;
}

static bool is_ancestor(const struct fit_info *fit, const char *sha256)
{
    bool found = fit->parent_sha256[0] && strcmp(fit->parent_sha256, sha256) == 0;
    for (size_t k = 0; k < fit->n_ancestors && !found; k++)
        found = strcmp(fit->ancestors[k], sha256) == 0;
    return found;
}

/* Adds a model file of plausible size whose bytes are an ancestor's that is not there yet. */
static void take_ancestor(struct history *h, const char *path)
{
    struct stat info;
    struct bf_error ignored;
    char sha256[65];
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode) || info.st_size > MOST_BYTES ||
        hash_file(path, sha256, &ignored) != BF_OK)
        return;
    if (!is_ancestor(&h->entries[0].model.fit, sha256) || find_sha256(h, sha256) != HISTORY_NONE)
        return;
    struct history_entry *e = add_entry(h, path);
    if (model_read(path, &e->model, &ignored) == BF_OK)
        return;
    free(e->file); /* of another version, perhaps: no ancestor that could be shown */
    h->n--;
}

static int is_model_name(const struct dirent *entry)
{
    const char *dot = strrchr(entry->d_name, '.');
    return dot != NULL && (strcasecmp(dot, ".yaml") == 0 || strcasecmp(dot, ".yml") == 0);
}

static void search_directory(struct history *h, const char *path)
{
    const char *slash = strrchr(path, '/');
    const int length = slash ? (int)(slash - path) + 1 : 0;
    char *directory = bf_alloc((size_t)length + 3, 1);
    struct dirent **list = NULL;
    (void)snprintf(directory, (size_t)length + 3, "%.*s.", length, path);
    const int n = scandir(directory, &list, is_model_name, alphasort);
    for (int i = 0; i < n; i++) {
        const size_t size = (size_t)length + strlen(list[i]->d_name) + 1;
        char *found = bf_alloc(size, 1);
        (void)snprintf(found, size, "%.*s%s", length, path, list[i]->d_name);
        if (i < MOST_FILES)
            take_ancestor(h, found);
        free(found);
        free(list[i]);
    }
    free(list);
    free(directory);
}

enum bf_status history_of(const char *path, const char *const others[], size_t n_others, struct history *out,
                          struct bf_error *err)
{
    if (history_read(&path, 1, out, err) != BF_OK)
        return err->status;
    for (size_t i = 0; i < n_others; i++) {
        struct model model;
        if (model_read(others[i], &model, err) != BF_OK)
            return err->status;
        const bool ancestor = is_ancestor(&out->entries[0].model.fit, model.sha256);
        if (ancestor && find_sha256(out, model.sha256) == HISTORY_NONE)
            add_entry(out, others[i])->model = model;
        else
            model_free(&model);
        if (!ancestor)
            return bf_fail(err, BF_USAGE,
                           "%s is no ancestor of %s: its SHA-256 is not among the parents that the file states",
                           others[i], path);
    }
    search_directory(out, path);
    sort_by_descent(out);
    return BF_OK;
}

void history_free(struct history *h)
{
    for (int i = 0; i < h->n; i++) {
        model_free(&h->entries[i].model);
        free(h->entries[i].file);
    }
    free(h->entries);
    free(h->order);
    *h = (struct history){0};
}
