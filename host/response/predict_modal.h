/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predict_modal.h — a record of a predictor as a modal system, for the stepping of laws; for predict_law.c and nobody else. */
#ifndef BEAMFIT_PREDICT_MODAL_H
#define BEAMFIT_PREDICT_MODAL_H

#include "modal_system.h"

struct run;

/* The system and the lists it points to. */
struct modal_record {
    struct modal_system system;
    struct clamp clamp;
    struct modal_parameter *parameters;
    struct modal_input *inputs;
    struct modal_change *input_changes;
    struct modal_output *outputs;
    struct modal_state *states;
};

/* Rows of the paths: on each grid the sources, then the outputs. */
size_t modal_source_row(const struct run *run, size_t grid, size_t source);
size_t modal_output_row(const struct run *run, size_t grid, size_t output);

/* paths[rows][n_coordinates]. To be freed whether it fails or not. The system points into *out: it must stay in its place. */
enum bf_status modal_record_new(const struct run *run, size_t record, const struct modal_path paths[],
                                struct modal_record *out, struct bf_error *err);
void modal_record_free(struct modal_record *record);

#endif
