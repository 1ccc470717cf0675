/* SPDX-License-Identifier: MIT */
/*
 * resets.h — why the board started, and how often for each reason since power was applied. Counted in memory that a reset
 * leaves as it was; after a power-on that memory holds anything, and its sum says so.
 */
#ifndef RESETS_H
#define RESETS_H

#include "beam_wire.h"
#include "board.h"

/* Counts this start in facts->kept, which may be NULL: then only this one is known. */
void resets_count(const struct board_facts *facts);

/* Starts for each reason since power was applied, this one included. */
void resets_read(const struct board_facts *facts, uint32_t out[BEAM_RESETS]);

#endif
