/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Written by `make calibrate SEED='1'`: 136 cases, 153 answers, 445 entries, of them 254 right. */
#include "probability.h"

const struct probability_table probability_table = {
    .intercept = 0.451165,
    .weight = {[FEATURE_STRENGTH] = 0.468595,
               [FEATURE_EXPLAINED] = 0.630306,
               [FEATURE_REMAINS] = -0.54876,
               [FEATURE_HELD_OUT] = -0.266068,
               [FEATURE_GAP] = -1.67153,
               [FEATURE_FACTS] = -0.690314,
               [FEATURE_MORE_EFFECTS] = -1.15187,
               [FEATURE_AHEAD] = 1.23203,
               [FEATURE_ONE_MORE] = -3.58448,
               [FEATURE_AT_NOISE] = 2.06285},
};
