/* SPDX-License-Identifier: GPL-3.0-or-later */
/* simulate_stream.h — `simulate` of a long record of a linear model: read, predicted and written piece by piece. */
#ifndef BEAMFIT_SIMULATE_STREAM_H
#define BEAMFIT_SIMULATE_STREAM_H

#include "model/model.h"
#include "record/record.h"
#include "response/response.h"

/* What is simulated, and where it goes. */
struct simulation {
    const struct model *model;
    const char *model_path, *input, *output;
    struct predict_options predict;
    int digits;
};

/* The head of the file that is written: inputs that `from` has, then the model's outputs, without samples. */
void simulation_head(const struct simulation *s, const struct record *from, struct record *head);

/* rms[n_outputs] of what was written. *done false: it cannot be done in pieces, and nothing is written. */
enum bf_status simulate_streamed(const struct simulation *s, const struct record_spool *spool, double rms[], bool *done,
                                 struct bf_error *err);

#endif
