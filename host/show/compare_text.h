/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_text.h — one channel of a comparison in sentences, and pieces of its answer. Private to show/. */
#ifndef BEAMFIT_COMPARE_TEXT_H
#define BEAMFIT_COMPARE_TEXT_H

#include <stddef.h>

#include "compare/compare.h"

/* How large the misfit is and where, in sentences of numbers, without what may be behind it. text: [size], cut when longer. */
void compare_finding(const struct comparison *comparison, const struct comparison_channel *channel, char *text,
                     size_t size);

/* The same, and what may be behind it: which input the residual follows, whether it is white, whether it looks nonlinear. */
void compare_summary(const struct comparison *comparison, const struct comparison_channel *channel, char *text,
                     size_t size);

struct json;
/* channel.where of channel.bands, those with a share worth naming: "0-20 Hz m1 34, 20-40 Hz 12". */
void compare_put_where(struct json *channel);
/* Records that are no samples, behind the others. */
void compare_lines_json(struct json *records, const struct line_comparison *lines);

#endif
