/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnose_road.h"

#include <math.h>
#include <string.h>

#include "diagnose_relatives.h"

bool road_is_structural(const struct beam_effect *effect)
{
    return effect->terms != NULL || effect->geometry != NULL;
}

/* Start values with the other sign of the strength; false: it has one sign only, or its start is what a score found. */
static bool turn(const struct candidate *candidate, double start[])
{
    const struct beam_effect *effect = candidate->effect;
    bool any = false;
    for (int i = 0; i < effect->n_parameters; i++) {
        const struct beam_parameter_info *info = &effect->parameters[i];
        const bool turns =
            info->role == BEAM_ROLE_STRENGTH && !(info->neutral < 0.0 || info->neutral > 0.0) && info->minimum < 0.0;
        start[i] = turns ? -candidate->start[i] : candidate->start[i];
        any = any || turns;
    }
    return any && road_is_structural(effect);
}

/*
 * What laboratories put on a beam, as a start: a rigid support, a mass as heavy as the beam, anywhere along the span. From a soft spring a fit does not find the
 * support, nor from a gram such a mass. roads[1], returns how many.
 */
static size_t lay_large(const struct model *from, const struct candidate *candidate, struct road roads[])
{
    const struct beam_effect *effect = candidate->effect;
    const double length_m = from->length_m;
    const int strength = effect_slot(effect, BEAM_ROLE_STRENGTH), place = effect_slot(effect, BEAM_ROLE_PLACE);
    if (!diagnose_follows_much(effect, from)) /* neither a spring nor a mass at a free place */
        return 0;
    const double large = diagnose_is_mass(effect, from) ? model_mass_kg(from) : diagnose_rigid_Npm(from);
    *roads = (struct road){.candidate = candidate, .along = true};
    memcpy(roads->start, candidate->start, sizeof roads->start);
    roads->start[strength] = fmin(large, candidate->upper[strength]);
    roads->start[place] =
        length_m / 3.0; /* the reduced space is of this place: at the tip it would be of another beam */
    return 1;
}

/* The other starts of a candidate: far from the truth either sign may lead astray (a strut near buckling), and a soft spring or a small mass. */
static size_t lay_others(const struct model *from, const struct candidate *candidate, struct road roads[])
{
    struct road turned = {.candidate = candidate};
    size_t n = 0;
    if (turn(candidate, turned.start))
        roads[n++] = turned;
    return n + lay_large(from, candidate, &roads[n]);
}

size_t roads_lay(const struct candidate candidates[], const struct model *from, const size_t order[], size_t n,
                 bool all, struct road roads[])
{
    size_t n_roads = 0, structural = 0;
    for (size_t k = 0; k < n; k++) {
        const struct candidate *candidate = &candidates[order[k]];
        roads[n_roads] = (struct road){.candidate = candidate, .usual = true};
        memcpy(roads[n_roads].start, candidate->start, sizeof candidate->start);
        n_roads++;
        if (road_is_structural(candidate->effect))
            structural = k + 1;
        if (!all || structural != k + 1 || (k + 1 < n && road_is_structural(candidates[order[k + 1]].effect)))
            continue;
        for (size_t i = 0; i < structural; i++)
            n_roads += lay_others(from, &candidates[order[i]], &roads[n_roads]);
    }
    return n_roads;
}

/* Of an effect whose strength is all that it has. roads[1]; returns how many. */
static size_t lay_large_alone(const struct model *from, const struct candidate *candidate, struct road roads[])
{
    const double large = diagnose_large_strength(candidate->effect, from);
    if (!(large > 0.0))
        return 0;
    *roads = (struct road){.candidate = candidate, .start = {fmin(large, candidate->upper[0])}};
    return 1;
}

size_t roads_lay_all(const struct model *from, const struct candidate *candidate, struct road roads[])
{
    roads[0] = (struct road){.candidate = candidate, .usual = true};
    memcpy(roads[0].start, candidate->start, sizeof candidate->start);
    const size_t n = 1 + lay_others(from, candidate, &roads[1]);
    return n + lay_large_alone(from, candidate, &roads[n]);
}

size_t roads_lay_own(const struct model *from, const struct candidate *candidate, struct road roads[])
{
    static const enum beam_role differing[] = {BEAM_ROLE_STRENGTH, BEAM_ROLE_PLACE};
    struct road starts[ROADS];
    size_t n = 0;
    const size_t n_starts = roads_lay_all(from, candidate, starts);
    for (size_t role = 0; role < sizeof differing / sizeof *differing; role++) {
        const int slot = effect_slot(candidate->effect, differing[role]);
        for (size_t k = 0; k < n_starts && slot >= 0; k++) {
            roads[n] = starts[k];
            roads[n++].own = slot + 1;
        }
    }
    return n;
}
