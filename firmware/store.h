/* SPDX-License-Identifier: MIT */
/*
 * store.h — two slots of non-volatile memory, and a count of power-ons.
 *
 *     slot 0, 1:  image | record {magic, counter, CRC-32 of the image, CRC-32 of the record} | rollover word
 *     slot 2:     rollover word | one bit cleared per power-on
 *
 * An image goes to the slot that the last valid one is not in: erase, image, read back, record, read back. The record
 * comes last and carries its own sum, so a cut anywhere, inside a word too, leaves the other slot the newest valid one.
 * The two rollover words count in cleared bits how often slot 2 was full and erased; see store.c.
 */
#ifndef STORE_H
#define STORE_H

#include "beam_image.h"
#include "board.h"

enum store_slot { STORE_EMPTY, STORE_VALID, STORE_SPOILT };
enum store_phase { STORE_IDLE, STORE_ERASE, STORE_IMAGE, STORE_VERIFY, STORE_RECORD, STORE_THERE };
enum store_answer { STORE_NOTHING, STORE_DONE, STORE_FAILED };
enum { STORE_CHUNK = 64 /* bytes of one turn of the background loop */, STORE_NONE = 2 /* no slot */ };

struct store {
    const struct board_facts *facts;
    const struct beam_image *image; /* being written */
    uint32_t stored;                /* greatest counter of an image that is this device's and signed */
    uint32_t counter[2];            /* of a slot that is valid */
    uint8_t slot[2];                /* enum store_slot */
    uint8_t newest;                 /* slot of `stored`, or STORE_NONE */
    uint8_t phase, target;
    uint32_t position, crc;
    uint32_t boots; /* power-ons, this one included */
    bool counted;   /* this power-on is in slot 2: only then are seeds made from it new */
    uint32_t errors;
};

/* Reads both slots' sums and counts this power-on. Bounded by the slots' size; before sampling. */
void store_open(struct store *s, const struct board_facts *facts);

/* A valid slot's image into a page's memory. */
bool store_load(struct store *s, int slot, struct beam_image *image);

/* What the boot found of a valid slot: an image that is not this device's and signed is spoilt and counts for nothing. */
void store_authentic(struct store *s, int slot, bool authentic);

/*
 * After the last store_authentic(), before sampling: a slot without the newest image whose next erase would stop the processor is erased now.
 * So the first store after a power-on never does that. What such a slot held is lost: once in as many stores as it has windows.
 */
void store_prepare(struct store *s);

/* Begin to write this image, which stays unchanged until STORE_DONE or STORE_FAILED. One that is stored is left there. */
void store_begin(struct store *s, const struct beam_image *image);

/* One slice: an erase, or the programming or reading of 64 bytes. */
enum store_answer store_poll(struct store *s);

#endif
