/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "beam.h"

#include <stdint.h>
#include <stdlib.h>

static size_t *nowhere(size_t n)
{
    size_t *list = bf_alloc(n, sizeof *list);
    for (size_t i = 0; i < n; i++)
        list[i] = SIZE_MAX;
    return list;
}

/* Parameter i stands for this. */
static void enter(struct parameter_map *map, const struct parameter_ref *ref, size_t i)
{
    switch (ref->role) {
    case ROLE_EI:
        map->EI[ref->owner] = i;
        break;
    case ROLE_RHO:
        map->rho[ref->owner] = i;
        break;
    case ROLE_CDI:
        map->cDI[ref->owner] = i;
        break;
    case ROLE_GAMMA:
        map->gamma = i;
        break;
    case ROLE_KS:
        map->Ks = i;
        break;
    case ROLE_KB:
        map->KB = i;
        break;
    case ROLE_RESIDUAL:
        map->residual[ref->owner] = i;
        break;
    case ROLE_INPUT_PLACE:
        map->input_place[ref->owner] = i;
        break;
    case ROLE_INPUT_GAIN:
        map->input_gain[ref->owner] = i;
        break;
    case ROLE_OUTPUT_PLACE:
        map->output_place[ref->owner] = i;
        break;
    case ROLE_OUTPUT_GAIN:
        map->output_gain[ref->owner] = i;
        break;
    case ROLE_LENGTH:
        map->move[MOVE_LENGTH] = i;
        break;
    case ROLE_PATCH_FROM:
        map->move[MOVE_FROM] = i;
        break;
    case ROLE_PATCH_TO:
        map->move[MOVE_TO] = i;
        break;
    case ROLE_EFFECT:
        for (size_t r = 0; r < map->n_records; r++)
            if (ref->record < 0 || (size_t)ref->record == r)
                map->effect[(r * map->n_effects + ref->owner) * BEAM_EFFECT_PARAMETERS + (size_t)ref->slot] = i;
        break;
    }
}

struct parameter_map parameter_map_new(const struct model *model, const struct parameter_ref refs[], size_t n,
                                       size_t n_records)
{
    size_t records = n_records > 0 ? n_records : 1;
    struct parameter_map map = {.n = n, .n_records = records, .n_effects = model->n_effects};
    map.EI = bf_alloc(model->n_materials, sizeof(size_t));
    map.rho = bf_alloc(model->n_materials, sizeof(size_t));
    map.cDI = bf_alloc(model->n_materials, sizeof(size_t));
    map.residual = bf_alloc(model->n_residuals, sizeof(size_t));
    size_t slots = records * model->n_effects * BEAM_EFFECT_PARAMETERS;
    map.effect = nowhere(slots);
    map.input_place = nowhere(model->n_inputs), map.input_gain = nowhere(model->n_inputs);
    map.output_place = nowhere(model->n_outputs), map.output_gain = nowhere(model->n_outputs);
    for (int g = 0; g < MODEL_MOVES; g++)
        map.move[g] = SIZE_MAX;
    for (size_t i = 0; i < n; i++)
        enter(&map, &refs[i], i);
    return map;
}

void parameter_map_free(struct parameter_map *map)
{
    free(map->EI);
    free(map->rho);
    free(map->cDI);
    free(map->residual);
    free(map->input_place), free(map->input_gain), free(map->output_place), free(map->output_gain);
    free(map->effect);
    *map = (struct parameter_map){0};
}

void parameter_map_effect(const struct parameter_map *map, size_t record, size_t effect, const double theta[],
                          double p[BEAM_EFFECT_PARAMETERS])
{
    for (int s = 0; s < BEAM_EFFECT_PARAMETERS; s++) {
        size_t i = parameter_map_slot(map, record, effect, s);
        p[s] = i == SIZE_MAX ? 0.0 : theta[i];
    }
}
