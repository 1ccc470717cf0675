/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * recording.h — samples of a board, kept in memory, and the record that `fit` reads.
 *
 * A record has a uniform time axis and no holes. So a recording with holes becomes the record of its longest stretch
 * without one, and every hole is named in that record ("# gap: …"). Holes: a sample that did not come (lost on the line,
 * or its CRC-32 was wrong), the model put to rest in the middle, or another model.
 */
#ifndef BEAMFIT_RECORDING_H
#define BEAMFIT_RECORDING_H

#include <stdbool.h>
#include "beam_wire.h"
#include "record.h"

struct recording {
    unsigned prescale; /* every so many samples of the board, ≥ 1 */
    double sample_Hz;  /* of the board */
    size_t n, room;
    struct beam_live *live; /* [n], as they came; sequences rise */
};

void recording_begin(struct recording *recording, double sample_Hz, unsigned prescale);
/* A sample that is no later than the last is dropped. */
void recording_add(struct recording *recording, const struct beam_live *live);
/* Forgets the samples before, after `sequence`. */
void recording_drop_before(struct recording *recording, uint32_t sequence);
void recording_drop_after(struct recording *recording, uint32_t sequence);
void recording_free(struct recording *recording);

enum recording_break { RECORDING_WHOLE, RECORDING_LOST, RECORDING_REST, RECORDING_MODEL };
/* What lies between samples i and i + 1; *lost: samples that should have come between them. */
enum recording_break recording_between(const struct recording *recording, size_t i, uint64_t *lost);

struct recording_summary {
    size_t from, n; /* longest stretch without a hole: samples live[from … from + n − 1] */
    size_t breaks;  /* holes in all */
    uint64_t lost;  /* samples that did not come */
    uint64_t alarms, clipped, resets, unsolved; /* samples of the stretch with that flag */
    double noise_ratio;                         /* mean of the ratio over the stretch's last tenth */
};
struct recording_summary recording_summarise(const struct recording *recording);

/*
 * The stretch as a record: time_s, INPUT, OUTPUT, predicted, residual, ratio, sequence, step, codes, status. Time 0 is the
 * model's step 0 when the stretch has it (or begins in the first `prescale` steps), else its first sample. latency: samples
 * by which the board's measured values and predictions lag its input. It is undone for OUTPUT, which fits read, and left in
 * the others, which replays compare. BF_DEVICE with fewer than 2 samples. Write with 10 digits: then every single and
 * every 32-bit number survives.
 */
enum { RECORDING_DIGITS = 10 };
enum bf_status recording_make_record(const struct recording *recording, const struct recording_summary *summary,
                                     const char *input, const char *output, int latency, struct record *out,
                                     struct bf_error *err);

#endif
