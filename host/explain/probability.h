/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * probability.h — how sure an answer is: a logistic function of few features, fitted to drawn cases with known causes
 * (`make calibrate` writes probability_table.c; docs/results/calibration.md shows how it holds on others). Private to explain/.
 */
#ifndef BEAMFIT_PROBABILITY_H
#define BEAMFIT_PROBABILITY_H

#include "explain.h"

struct probability_table {
    double intercept;
    double weight[FEATURES];
};
extern const struct probability_table probability_table;

/* 1/(1 + exp(−(intercept + weight · feature))) */
double probability_of(const double feature[FEATURES]);

#endif
