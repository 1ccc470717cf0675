/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "probability.h"

#include <math.h>

const char *feature_name(enum feature feature)
{
    static const char *const names[FEATURES] = {
        [FEATURE_REMAINS] = "remains", [FEATURE_SET] = "set",         [FEATURE_LEAD] = "lead",
        [FEATURE_CROWD] = "crowd",     [FEATURE_FOLLOWS] = "follows", [FEATURE_ALONE] = "alone",
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
