/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "explanations.h"

#include <math.h>
#include <stdlib.h>

enum { ANCESTORS = 3, HYPOTHESES = 6 };

void explanations_begin(struct explanations *out, const struct record records[], size_t n_records, size_t n_held_out,
                        const struct predict_options *predict)
{
    *out = (struct explanations){
        .records = records, .n_records = n_records, .n_held_out = n_held_out, .predict = *predict};
}

static enum bf_status add(struct explanations *e, const char *name, const struct model *model,
                          const struct hypothesis *h, int hypothesis, struct bf_error *err)
{
    struct comparison *comparison = bf_alloc(1, sizeof *comparison);
    if (compare_run(model, e->records, e->n_records, e->n_held_out, &e->predict, comparison, err) != BF_OK) {
        compare_free(comparison);
        free(comparison);
        return err->status;
    }
    e->all = bf_grow(e->all, e->n + 1, sizeof *e->all);
    e->comparisons = bf_grow(e->comparisons, e->n + 1, sizeof *e->comparisons);
    e->names = bf_grow(e->names, e->n + 1, sizeof *e->names);
    e->names[e->n] = bf_strdup(name);
    e->comparisons[e->n] = comparison;
    e->hypothesis = bf_grow(e->hypothesis, e->n + 1, sizeof *e->hypothesis);
    e->hypothesis[e->n] = hypothesis;
    e->all[e->n] = (struct explanation){e->names[e->n], comparison, h != NULL ? h->probability : (double)NAN,
                                        h != NULL ? h->explained : (double)NAN};
    e->n++;
    return BF_OK;
}

enum bf_status explanations_add(struct explanations *e, const char *name, const struct model *model,
                                struct bf_error *err)
{
    if (add(e, name, model, NULL, -1, err) != BF_OK)
        return err->status;
    e->after = e->n - 1;
    return BF_OK;
}

void explanations_add_ancestors(struct explanations *e, const struct history *history)
{
    int line[ANCESTORS], n = 0, at = history->n > 0 ? history->entries[0].parent : -1;
    for (; at >= 0 && n < ANCESTORS; at = history->entries[at].parent)
        line[n++] = at;
    while (n-- > 0) {
        struct bf_error ignored; /* it may lack a channel that these records have */
        const struct history_entry *entry = &history->entries[line[n]];
        if (add(e, text_base_name(entry->file), &entry->model, NULL, -1, &ignored) == BF_OK && entry->model.fit.present)
            e->before = e->n - 1;
    }
}

static char *name_of(const struct hypothesis *h)
{
    char *text = NULL;
    size_t n = 0;
    FILE *f = open_memstream(&text, &n);
    if (f == NULL)
        return bf_strdup("");
    hypothesis_name(f, h);
    (void)fclose(f);
    return text;
}

void explanations_add_diagnosis(struct explanations *e, const struct diagnosis *diagnosis)
{
    struct bf_error ignored;
    size_t added = 0;
    const size_t before = e->n;
    if (add(e, "fitted, no effect more", &diagnosis->baseline.model, NULL, -1, &ignored) != BF_OK)
        return;
    for (size_t i = 0; i < diagnosis->n_hypotheses && added < HYPOTHESES; i++) {
        const struct hypothesis *h = &diagnosis->hypotheses[i];
        if (!h->refitted)
            continue;
        char *name = name_of(h);
        const bool there = add(e, name, &h->model, h, (int)i, &ignored) == BF_OK;
        free(name);
        added += there;
        if (there && added == 1 && diagnosis->n_named > 0) {
            e->before = before;
            e->after = e->n - 1;
        }
    }
}

struct curves explanations_curves(const struct explanations *e, size_t most_channels)
{
    return (struct curves){
        .n = e->n, .explanations = e->all, .before = e->before, .after = e->after, .most_channels = most_channels};
}

void explanations_free(struct explanations *e)
{
    for (size_t i = 0; i < e->n; i++) {
        compare_free(e->comparisons[i]);
        free(e->comparisons[i]);
        free(e->names[i]);
    }
    free(e->comparisons), free(e->names), free(e->hypothesis), free(e->all);
    *e = (struct explanations){0};
}
