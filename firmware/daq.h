/* SPDX-License-Identifier: MIT */
/*
 * daq.h — samples from the interrupt to the line: lists of what to send, and a ring with one writer and one reader.
 *
 * Lists, object descriptor tables (ODTs) and entries come from fixed pools, in the order of XCP's dynamic allocation.
 * Every entry lies in struct beam_live. A sample that finds the ring full is dropped and counted: the host sees the
 * gap in beam_live.sequence.
 */
#ifndef DAQ_H
#define DAQ_H

#include <stdatomic.h>
#include <stdbool.h>
#include "beam_wire.h"

enum {
    DAQ_RING = 8,       /* samples on their way, a power of two: what comes while a long response leaves */
    DAQ_ODT_BYTES = 48, /* of data in one frame: a whole live sample */
    DAQ_FRAME_BYTES = BEAM_WIRE_HEADER + 1 + 4 + DAQ_ODT_BYTES + 1 + BEAM_WIRE_TAIL
};

struct daq_list {
    uint8_t first_odt, n_odts, prescaler;
    bool timestamp, selected;
    uint8_t wait;         /* samples until the next one sent; the interrupt's while running */
    _Atomic bool running; /* set and cleared in the background, with the list complete */
};

struct daq_odt {
    uint8_t first_entry, n_entries;
};

struct daq_entry {
    uint8_t offset, size; /* bytes of struct beam_live; size 0: not written yet */
};

struct daq_item {
    struct beam_live live; /* without its CRC */
    uint32_t time_us;
    uint8_t due; /* bit per list */
};

struct daq {
    uint8_t n_lists, n_odts, n_entries;
    struct daq_list list[BEAM_DAQ_LISTS];
    struct daq_odt odt[BEAM_DAQ_ODTS];
    struct daq_entry entry[BEAM_DAQ_ENTRIES];
    struct daq_item ring[DAQ_RING];
    _Atomic uint32_t written, taken; /* since power-on: the interrupt's, the background's */
    _Atomic uint32_t overrun;
    uint8_t at_list, at_odt; /* of the oldest item: what is sent next */
    uint8_t frame[DAQ_FRAME_BYTES];
};

/* ---- Background ---- */

void daq_stop(struct daq *daq);
void daq_free(struct daq *daq); /* stops, and empties the pools */
bool daq_running(const struct daq *daq);

/* Every ODT has entries, every entry is written, every ODT fits a frame. */
bool daq_complete(const struct daq *daq, int list);
void daq_start(struct daq *daq, int list);

/* The next packet into frame + BEAM_WIRE_HEADER; its length, 0 when there is none. */
uint16_t daq_next(struct daq *daq);

/* ---- Sample interrupt ---- */

/* Cost: about 30 instructions, 60 when it is sent. */
void daq_sample(struct daq *daq, const struct beam_live *live, uint32_t time_us);

#endif
