/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * rig.h — a directory with a good model (model.yaml) and a good record (record.csv), to be spoilt by a test.
 */
#ifndef TESTS_RIG_H
#define TESTS_RIG_H

#include "run_program.h"

enum { RIG_SAMPLES = 64, RIG_RECORD_TEXT = 8192 };

struct rig {
    char dir[64];
    struct outcome outcome; /* of the last run */
};

extern const char rig_model[];      /* the good model's text */
extern const char rig_old_output[]; /* text for an output that stands already */

/* For cmocka_unit_test_setup_teardown(); *state is the struct rig. */
int rig_setup(void **state);
int rig_teardown(void **state);

/* Header on line 1, sample k on line k + 2, sample at_sample (< 0: none) replaced by line; dt = time_scale/256 s. */
void rig_make_record(char text[RIG_RECORD_TEXT], const char *header, int samples, int at_sample, const char *line,
                     double time_scale);
/* The good model's text with one line (from 1) replaced; written to model.yaml. */
void rig_model_with(struct rig *rig, int line, const char *replacement);

/* Status 3, and one line "beamfit: WHERE: ... WORD ...; remedy" as the last on standard error; nothing on standard output. */
void assert_refused(const struct outcome *outcome, const char *where, const char *word);
/* simulate, fit and compare refuse model.yaml or record.csv, leave the outputs that stood there, and leave no new file. */
void refuse_everywhere(struct rig *rig, const char *where, const char *word);

#endif
