/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How much damping a beam can have that swings. */
#include "model.h"

#include <math.h>

/* (βL)² of the first bending mode of the uniform beam. */
static const double first_root[] = {[SUPPORT_CLAMPED_FREE] = 3.516015,
                                    [SUPPORT_CLAMPED_CLAMPED] = 22.373285,
                                    [SUPPORT_PINNED_PINNED] = 9.869604,
                                    [SUPPORT_FREE_FREE] = 22.373285};

double model_first_mode_radps(const struct model *model)
{
    const struct material *beam = &model->materials[model_plain_material(model)];
    return first_root[model->support] / (model->length_m * model->length_m) * sqrt(beam->EI.value / beam->rho.value);
}

double model_most_damping(const struct model *model, const struct parameter_ref *ref)
{
    const double omega = model_first_mode_radps(model);
    if (ref->role == ROLE_CDI)
        return model->materials[ref->owner].EI.value / omega; /* cDI ω/EI = 1 */
    if (ref->role == ROLE_GAMMA)
        return model->materials[model_plain_material(model)].rho.value * omega; /* γ/(ρ ω) = 1 */
    return HUGE_VAL;
}
