/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * report.h — the state of a model as one page (HTML) that needs nothing beside it: what `compare`, `modes` and `history`
 * found, as tables and pictures. Nothing is computed here but what fits on a line: which of the numbers to say first.
 */
#ifndef BEAMFIT_REPORT_H
#define BEAMFIT_REPORT_H

#include "compare/compare.h"
#include "compare/history.h"
#include "beam/modes.h"

enum { REPORT_TEXT = 1024 };

/* Everything is the caller's. */
struct report {
    const char *title; /* NULL: made of the model's file name */
    const struct model *model;
    const struct comparison *comparison; /* of that model */
    const struct modes *modes;           /* of that model */
    const struct history *history;       /* of history_of() */
    size_t most_channels;                /* pictures of so many channels, the furthest from their noise first */
};

/* What was drawn. Starts empty ({0}); free with report_pictures_free(), which also removes the files. */
struct report_pictures {
    char *directory;   /* of its own, temporary */
    bool *drawn;       /* [n_channels] panels and residual of this channel are there */
    size_t n_channels; /* of them */
    bool history;      /* and the chain of models */
    size_t n;          /* pictures in all */
};

/*
 * Draws into a new directory below TMPDIR. About 0.7 s a channel, with a progress bar. Ctrl-C (progress.h) between two
 * pictures is BF_NUMERIC.
 */
enum bf_status report_draw(const struct report *report, struct report_pictures *out, struct bf_error *err);
void report_pictures_free(struct report_pictures *pictures);

/* One sentence or two, plain text: how many times the noise is left, and what to do next. */
void report_verdict(const struct report *report, char text[REPORT_TEXT]);

/* The page. BF_BAD_FILE when a picture cannot be read; writes to `out` are not checked here. */
enum bf_status report_write(const struct report *report, const struct report_pictures *pictures, FILE *out,
                            struct bf_error *err);

#endif
