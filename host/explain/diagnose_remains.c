/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * How much one more effect would take of what the best explanation leaves. The true effect leaves nothing to take, a wrong one that
 * fits about as well leaves the difference between the two. This does not depend on the level of the noise.
 */
#include "diagnose_shortlist.h"

#include <math.h>
#include <stdlib.h>

/* Of the noise in units of its rms, as scores take it. */
static struct ar_model *colours(const struct diagnose_state *w)
{
    struct ar_model *colour = bf_alloc(w->d->n_channels + 1, sizeof *colour);
    for (size_t c = 0; c < w->d->n_channels; c++) {
        colour[c] = w->whiteners[c].ar;
        colour[c].sigma /= w->sigma[c];
    }
    return colour;
}

enum bf_status diagnose_remains(struct diagnose_state *w, struct bf_error *err)
{
    struct hypothesis *best = &w->d->hypotheses[0];
    struct shortlist s;
    struct ar_model *colour = colours(w);
    const size_t tried = w->n_tried;
    enum bf_status status = shortlist_new(w, best, &s, err);
    s.first_order = true;
    s.colour = colour;
    for (enum effect_kind kind = KIND_LINEAR; kind <= KIND_NONLINEAR_CHAIN && !status; kind++) {
        status = shortlist_score(&s, kind, err);
        best->remains = status ? 0.0 : fmax(best->remains, shortlist_fall(&s, kind));
    }
    shortlist_free(&s);
    free(colour);
    w->n_tried = tried; /* nothing of this is offered as an explanation */
    if (!status)
        diagnose_rank(w->d, w->n_tried);
    return status;
}
