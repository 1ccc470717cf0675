/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fleet_words.h — sentences about a fleet that its text, its JSON and its page say alike. Private to show/. */
#ifndef BEAMFIT_FLEET_WORDS_H
#define BEAMFIT_FLEET_WORDS_H

#include "fleet/fleet.h"

enum { FLEET_SENTENCE = 2048 };

/* "tip_mass is missing in 37 of 40 units, 1.02 ± 0.15 g; units 7, 12 and 31 differ: root_compliance."; "" when nothing was diagnosed. */
void fleet_diagnosis_words(const struct fleet_population *p, char text[FLEET_SENTENCE]);
void fleet_drift_words(const struct fleet_population *p, const struct fleet_drift *drift, char text[FLEET_SENTENCE]);
void fleet_outlier_words(const struct fleet_population *p, const struct fleet_outlier *outlier,
                         char text[FLEET_SENTENCE]);
/* How outliers and drifts were judged. */
void fleet_alarm_words(const struct fleet_population *p, char text[FLEET_SENTENCE]);

/* A parameter's mean over the fleet, its standard error, and its spread, in its own unit; relative: as shares of the mean. */
struct fleet_value_words {
    double mean, sd, spread;
    bool relative;
};
struct fleet_value_words fleet_parameter(const struct fleet_population *p, size_t k);

#endif
