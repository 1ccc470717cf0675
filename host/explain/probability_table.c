/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Not fitted yet: replaced by `make calibrate`. */
#include "probability.h"

const struct probability_table probability_table = {
    .intercept = -3.0,
    .weight = {[FEATURE_EXPLAINED] = 1.0,
               [FEATURE_REMAINS] = -2.0,
               [FEATURE_HELD_OUT] = 1.0,
               [FEATURE_GAP] = -3.0,
               [FEATURE_LEAD] = 1.0,
               [FEATURE_MORE_EFFECTS] = -0.5},
};
