/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "probability.h"

#include <math.h>

const char *feature_name(enum feature feature)
{
    static const char *const names[FEATURES] = {
        [FEATURE_STRENGTH] = "strength", [FEATURE_EXPLAINED] = "explained",
        [FEATURE_REMAINS] = "remains",   [FEATURE_HELD_OUT] = "held_out",
        [FEATURE_GAP] = "gap",           [FEATURE_UNCHECKED] = "unchecked",
        [FEATURE_LEAD] = "lead",         [FEATURE_FACTS] = "facts",
        [FEATURE_LAW] = "law",           [FEATURE_MORE_EFFECTS] = "more_effects",
        [FEATURE_OTHERS] = "others",     [FEATURE_OVER_MEMBERS] = "over_members",
        [FEATURE_AHEAD] = "ahead",       [FEATURE_ONE_MORE] = "one_more",
    };
    return names[feature];
}

double probability_of(const double feature[FEATURES])
{
    double logit = probability_table.intercept;
    for (int k = 0; k < FEATURES; k++)
        logit += probability_table.weight[k] * feature[k];
    return 1.0 / (1.0 + exp(-logit));
}
