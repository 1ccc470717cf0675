/* SPDX-License-Identifier: GPL-3.0-or-later */
/* truth_hit.h — what the truth simulator makes of a specification, as a record of the program. Include after cmocka.h. */
#ifndef TRUTH_HIT_H
#define TRUTH_HIT_H

#include "record/record.h"
#include "truth_rig.h"

/* All channels, under the name hit.csv. Free with record_free(). */
static inline struct record hit_of(const struct truth_spec *spec)
{
    struct truth_record truth = run(spec);
    struct record record = {.path = strdup("hit.csv"), .n = truth.n, .dt_s = 1.0 / truth.rate_Hz};
    for (size_t c = 0; c < truth.n_channels; c++)
        record_add_column(&record, truth.channel[c].name, truth.channel[c].x);
    truth_record_free(&truth);
    return record;
}

#endif
