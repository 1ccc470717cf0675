/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_road.h — where the refits of a candidate begin: its usual start, the other sign, what laboratories put on a beam; inside explain/ only. */
#ifndef BEAMFIT_DIAGNOSE_ROAD_H
#define BEAMFIT_DIAGNOSE_ROAD_H

#include <stdbool.h>
#include <stddef.h>

#include "estimate/estimate.h"

/* Starts of a candidate at most: with either sign, and as a rigid support or a heavy mass. */
enum { ROADS = 3 };

/* A candidate from one start; its refit is done, or has been left unfinished with so much left, χ²/n. */
struct road {
    const struct candidate *candidate;
    double start[BEAM_EFFECT_PARAMETERS];
    bool usual; /* the first start of its candidate */
    bool along; /* its strength at places along the span, too */
    int own;    /* 1 + the parameter that has a value of its own in each record; 0: none */
    bool done;
    double left;
};

/* Moves the beam's frequencies and shapes: what a baseline without it is driven away by. */
bool road_is_structural(const struct beam_effect *effect);

/*
 * roads[ROADS · n]; returns how many. `all` takes every start: first the usual one of each of the beam's own effects, from which nearly every cause is found,
 * then their other starts, then the measurement's effects. order[]: the beam's own effects come first.
 */
size_t roads_lay(const struct candidate candidates[], const struct model *from, const size_t order[], size_t n,
                 bool all, struct road roads[]);
/* Every start of one candidate, one that has a strength alone as a large one, too. roads[ROADS]; returns how many. */
size_t roads_lay_all(const struct model *from, const struct candidate *candidate, struct road roads[]);
/* From every start twice: with a strength of its own in each record, and with a place of its own. roads[2 · ROADS]; returns how many. */
size_t roads_lay_own(const struct model *from, const struct candidate *candidate, struct road roads[]);

#endif
