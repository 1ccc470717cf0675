/* SPDX-License-Identifier: GPL-3.0-or-later */
/* hidden_mass.h — hits on a beam whose model lacks the mass at its tip, and that model fitted. */
#ifndef TESTS_HIDDEN_MASS_H
#define TESTS_HIDDEN_MASS_H

/* A rig with soft.csv, hard.csv, check.csv, model.yaml and fitted.yaml, for cmocka's setup. The fit drives cDI_patch to nothing. */
int hidden_mass_setup(void **state);

#endif
