/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Not fitted yet: replaced by `make calibrate`. */
#include "probability.h"

const struct probability_table probability_table = {
    .intercept = -1.38,
    .weight = {[FEATURE_STRENGTH] = 0.37,
               [FEATURE_EXPLAINED] = 0.2,
               [FEATURE_REMAINS] = -1.5,
               [FEATURE_HELD_OUT] = 0.42,
               [FEATURE_GAP] = -1.0,
               [FEATURE_UNCHECKED] = 0.5,
               [FEATURE_LEAD] = 0.96,
               [FEATURE_FACTS] = -0.8,
               [FEATURE_LAW] = 1.5,
               [FEATURE_MORE_EFFECTS] = -1.05,
               [FEATURE_OVER_MEMBERS] = 0.5,
               [FEATURE_ONE_MORE] = -1.0},
};
