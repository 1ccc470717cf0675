/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_modal.h — effects fitted to the modes of the free linear model, and what that says of them; private to explain/. */
#ifndef BEAMFIT_DIAGNOSE_MODAL_H
#define BEAMFIT_DIAGNOSE_MODAL_H

#include "diagnose_state.h"

/* All that is set by hand. */
extern const struct modal_limits {
    double promises; /* of what the model without the effect leaves of the modes: what leaves more is not refitted */
    double nothing;  /* of what a good model may be off by: what leaves less is told from its like by sharper errors */
    double same;     /* of what the model without the effect leaves: starts that differ by less have come to one end */
} modal_limits;

/* What is fitted to the modes, from one start. */
struct modal_start {
    const struct beam_effect *effect; /* the last one of the model */
    struct model model;
    double left;   /* rms, in what a good model may be off by */
    bool refitted; /* to the records */
};

/* All starts with one more effect, the nearest first. */
struct modal_road {
    struct diagnose_state *w;
    const struct model *of; /* the model that was extended */
    struct measured_modes modes;
    struct modal_start alone; /* the model without one more effect, fitted to them, too */
    size_t n;
    struct modal_start *starts;
};

/* It comes near the modes, as the nearest does, and leaves clearly less of them than the model without it. */
bool modal_is_near(const struct modal_road *road, const struct modal_start *start);
void modal_start_free(struct modal_start *start);
void modal_road_free(struct modal_road *road);

#endif
