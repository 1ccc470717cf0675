/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "free_or_warn.h"

#include "ground/ground.h"

struct free_motion free_or_warn(const struct comparison *comparison, bool wanted)
{
    struct free_motion out = {.wanted = wanted && comparison->n_records > 0};
    struct bf_error err;
    if (!out.wanted)
        return out;
    if (amplitude_measure(comparison, &out.decays, &err) != BF_OK)
        bf_warn("how the records decay is not known: %s", err.text);
    if (stabilisation_find(comparison, &out.poles, &err) != BF_OK) {
        bf_warn("there is no stabilisation diagram: %s", err.text);
        stabilisation_free(&out.poles);
    }
    if (pole_table_of_records(comparison, &out.poles, &out.table, &err) != BF_OK)
        bf_warn("there is no table of measured poles: %s", err.text);
    return out;
}

void free_motion_free(struct free_motion *motion)
{
    amplitude_free(&motion->decays);
    stabilisation_free(&motion->poles);
    pole_table_free(&motion->table);
    *motion = (struct free_motion){0};
}
