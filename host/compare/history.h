/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * history.h — models in the order in which they were made from each other, and what each step brought. Each file knows
 * the SHA-256 of the file it was made from; nothing is computed again. For commands history and report.
 */
#ifndef BEAMFIT_HISTORY_H
#define BEAMFIT_HISTORY_H

#include <stdbool.h>
#include "ground/json.h"
#include "model/model.h"

enum { HISTORY_NONE = -1 };

struct history_entry {
    struct model model;
    char *file; /* as given, or as found */
    int parent; /* index of the nearest ancestor among the entries, or HISTORY_NONE */
    int depth;  /* steps from its root */
    bool placed;
};

struct history {
    struct history_entry *entries;
    int n;
    int *order; /* [n] indices, every model after its parent */
};

/* Reads and orders. Free with history_free(), also after a failure. */
enum bf_status history_read(const char *const paths[], size_t n, struct history *out, struct bf_error *err);
/*
 * A model with those of its ancestors that stand in its file's directory (*.yaml, *.yml, known by their SHA-256 under
 * whatever name) or among `others`, which may lie anywhere. A copy of one that is there counts once. BF_USAGE when one of
 * the others is no ancestor; BF_BAD_FILE when it cannot be read.
 * Cost: reads every model file of the directory, at most 1000.
 */
enum bf_status history_of(const char *path, const char *const others[], size_t n_others, struct history *out,
                          struct bf_error *err);
void history_free(struct history *history);

/* The parent of entry i among the entries; NULL: none is there. */
const struct model *history_parent(const struct history *history, int i);
/* Calls back for every effect that `model` has more often than `than` (NULL: none), once per surplus. */
void history_surplus(const struct model *model, const struct model *than, void (*call)(void *, const char *, bool),
                     void *context, bool gained);
/* What entry i has and its parent has not, as in the table: "+tip_mass −hum; fitted". */
void history_step(const struct history *history, int i, char *text, size_t size);
/* An error or noise ratio of a fit_info, where 0 stands for none: NaN then. */
double history_error(double x);
/* Models that were fitted. */
int history_fits(const struct history *history);

void history_print(FILE *out, const struct history *history);
struct json *history_json(const struct history *history); /* keys: `beamfit history --help` */
/* Error against model as DIR/history.png and .pdf. BF_USAGE when none was fitted. */
enum bf_status history_plot(const struct history *history, const char *directory, struct bf_error *err);

#endif
