/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "predict_work.h"

/* A parameter of a shaken clamp. */
static bool shakes(const struct predictor *p, size_t record, size_t parameter)
{
    for (size_t e = 0; e < p->model.n_effects; e++)
        for (int s = 0; p->model.effects[e].effect->tone != NULL && s < BEAM_EFFECT_PARAMETERS; s++)
            if (parameter_map_slot(&p->map, record, e, s) == parameter)
                return true;
    return false;
}

bool source_depends(const struct run *run, size_t record, size_t parameter)
{
    const struct predictor *p = run->p;
    if (!run_wants(run, parameter))
        return false;
    if (parameter == p->map.KB)
        return true;
    for (size_t c = 0; c < p->plans[record].n_changes; c++)
        if (p->plans[record].changes[c].parameter == parameter)
            return true;
    return shakes(p, record, parameter);
}
