/* SPDX-License-Identifier: MIT */
/* Commit record last; power-ons as cleared bits. */
#include "store.h"
#include <string.h>

enum { RECORD_MAGIC = 0x54494D43 /* "CMIT" */, RECORD_WORDS = 4, RECORD_AT = BEAM_IMAGE_BYTES };
enum { ROLLOVER_AT = RECORD_AT + 4 * RECORD_WORDS, SLOT_BYTES_LEAST = ROLLOVER_AT + 4, LOG = 2 };

struct record {
    uint32_t magic, counter, image_crc, record_crc;
};
_Static_assert(sizeof(struct record) == 4 * RECORD_WORDS, "record");

static bool program(struct store *s, int slot, uint32_t offset, size_t words, const uint32_t data[])
{
    const bool done = board_nvm_program(slot, offset, words, data);
    s->errors += !done;
    return done;
}

static bool erase(struct store *s, int slot)
{
    const bool done = board_nvm_erase(slot);
    s->errors += !done;
    return done;
}

static uint32_t read_word(int slot, uint32_t offset)
{
    uint32_t word = 0;
    uint8_t bytes[4];
    if (board_nvm_read(slot, offset, sizeof bytes, bytes))
        memcpy(&word, bytes, sizeof word);
    return word;
}

/* ---- Slots ---- */

static uint32_t record_sum(const struct record *record)
{
    return beam_crc32(0, sizeof *record - sizeof record->record_crc, (const uint8_t *)record);
}

static uint32_t slot_crc(int slot)
{
    uint8_t chunk[STORE_CHUNK];
    uint32_t crc = 0;
    for (uint32_t at = 0; at < BEAM_IMAGE_BYTES;) {
        const uint32_t left = BEAM_IMAGE_BYTES - at, n = left < STORE_CHUNK ? left : STORE_CHUNK;
        if (!board_nvm_read(slot, at, n, chunk))
            return 0;
        crc = beam_crc32(crc, n, chunk);
        at += n;
    }
    return crc;
}

static bool slot_is_blank(int slot)
{
    for (uint32_t at = 0; at < ROLLOVER_AT; at += 4)
        if (read_word(slot, at) != UINT32_MAX)
            return false;
    return true;
}

static void inspect(struct store *s, int slot)
{
    struct record record;
    uint8_t bytes[sizeof record];
    s->slot[slot] = STORE_SPOILT;
    if (!board_nvm_read(slot, RECORD_AT, sizeof bytes, bytes))
        return;
    memcpy(&record, bytes, sizeof record);
    if (record.magic == RECORD_MAGIC && record.record_crc == record_sum(&record) &&
        record.image_crc == slot_crc(slot)) {
        s->slot[slot] = STORE_VALID;
        s->counter[slot] = record.counter;
    } else if (slot_is_blank(slot)) {
        s->slot[slot] = STORE_EMPTY;
    }
}

bool store_load(struct store *s, int slot, struct beam_image *image)
{
    uint8_t chunk[STORE_CHUNK];
    if (s->slot[slot] != STORE_VALID)
        return false;
    for (uint32_t at = 0; at < BEAM_IMAGE_BYTES;) {
        const uint32_t left = BEAM_IMAGE_BYTES - at, n = left < STORE_CHUNK ? left : STORE_CHUNK;
        if (!board_nvm_read(slot, at, n, chunk) || !beam_image_write(image, at, n, chunk))
            return false;
        at += n;
    }
    return image->front.header.counter == s->counter[slot];
}

void store_authentic(struct store *s, int slot, bool authentic)
{
    if (!authentic) {
        s->slot[slot] = STORE_SPOILT;
    } else if (s->newest == STORE_NONE || s->counter[slot] > s->stored) {
        s->newest = (uint8_t)slot;
        s->stored = s->counter[slot];
    }
}

void store_prepare(struct store *s)
{
    for (int slot = 0; slot < 2; slot++)
        if (slot != s->newest && board_nvm_erase_stalls(slot))
            s->slot[slot] = erase(s, slot) ? STORE_EMPTY : STORE_SPOILT;
}

/* ---- Power-ons ---- */

static uint32_t zeros(uint32_t word)
{
    uint32_t count = 0;
    for (word = ~word; word != 0; word &= word - 1)
        count++;
    return count;
}

/* One further bit of a word, and is it there? */
static bool clear_bit(struct store *s, int slot, uint32_t offset)
{
    const uint32_t before = read_word(slot, offset), after = before & (before - 1);
    return before != 0 && program(s, slot, offset, 1, &after) && read_word(slot, offset) == after;
}

/* Bits of slot 2 behind its rollover word, and how many are cleared: words in order, the first not zero ends it. */
static uint32_t log_bits(const struct store *s)
{
    return 8 * (s->facts->nvm_slot_bytes - 4);
}

static uint32_t log_cleared(const struct store *s, uint32_t *next)
{
    uint32_t count = 0;
    for (*next = 4; *next < s->facts->nvm_slot_bytes; *next += 4) {
        const uint32_t word = read_word(LOG, *next);
        count += zeros(word);
        if (word != 0)
            break;
    }
    return count;
}

/*
 * A full log is erased, and what it counted must not be lost on the way: the word behind slot 0's record gets as many
 * cleared bits as there have been rollovers, this one included; then the erase; then slot 2's own word the same. As long
 * as slot 0's says more than slot 2's, the last two are done again. A store erases slot 0's only when they are equal.
 */
static uint32_t roll_over(struct store *s, uint32_t *next)
{
    const uint32_t done = zeros(read_word(LOG, 0));
    if (log_cleared(s, next) == log_bits(s) && done < 32)
        while (zeros(read_word(0, ROLLOVER_AT)) <= done && clear_bit(s, 0, ROLLOVER_AT))
            ;
    const uint32_t begun = zeros(read_word(0, ROLLOVER_AT));
    if (begun <= done)
        return done;
    if (erase(s, LOG))
        while (zeros(read_word(LOG, 0)) < begun && clear_bit(s, LOG, 0))
            ;
    return zeros(read_word(LOG, 0));
}

static void count_boot(struct store *s)
{
    uint32_t next;
    const uint32_t rollovers = roll_over(s, &next), cleared = log_cleared(s, &next);
    s->boots = rollovers * log_bits(s) + cleared + 1;
    s->counted = next < s->facts->nvm_slot_bytes && clear_bit(s, LOG, next);
}

void store_open(struct store *s, const struct board_facts *facts)
{
    *s = (struct store){.facts = facts, .newest = STORE_NONE};
    if (facts->nvm_slot_bytes < SLOT_BYTES_LEAST) {
        s->errors++;
        s->slot[0] = s->slot[1] = STORE_SPOILT;
        return;
    }
    inspect(s, 0);
    inspect(s, 1);
    count_boot(s);
}

/* ---- Writing ---- */

void store_begin(struct store *s, const struct beam_image *image)
{
    s->image = image;
    s->target = s->newest == 0 ? 1 : 0;
    s->phase = s->newest != STORE_NONE && s->stored == image->front.header.counter ? STORE_THERE : STORE_ERASE;
    s->position = s->crc = 0;
}

static bool write_chunk(struct store *s)
{
    uint32_t words[STORE_CHUNK / 4];
    uint8_t chunk[STORE_CHUNK];
    const uint32_t left = BEAM_IMAGE_BYTES - s->position, n = left < STORE_CHUNK ? left : STORE_CHUNK;
    beam_image_read(s->image, s->position, n, chunk);
    memcpy(words, chunk, n);
    if (!program(s, s->target, s->position, n / 4, words))
        return false;
    s->crc = beam_crc32(s->crc, n, chunk);
    s->position += n;
    return true;
}

static bool verify_chunk(struct store *s)
{
    uint8_t chunk[STORE_CHUNK], there[STORE_CHUNK];
    const uint32_t left = BEAM_IMAGE_BYTES - s->position, n = left < STORE_CHUNK ? left : STORE_CHUNK;
    beam_image_read(s->image, s->position, n, chunk);
    if (!board_nvm_read(s->target, s->position, n, there) || memcmp(chunk, there, n) != 0)
        return false;
    s->position += n;
    return true;
}

static bool write_record(struct store *s)
{
    struct record record = {RECORD_MAGIC, s->image->front.header.counter, s->crc, 0};
    uint32_t words[RECORD_WORDS];
    record.record_crc = record_sum(&record);
    memcpy(words, &record, sizeof record);
    if (!program(s, s->target, RECORD_AT, RECORD_WORDS, words))
        return false;
    inspect(s, s->target);
    return s->slot[s->target] == STORE_VALID;
}

static enum store_answer finish(struct store *s, bool stored)
{
    s->phase = STORE_IDLE;
    if (!stored)
        return STORE_FAILED;
    s->newest = s->target;
    s->stored = s->counter[s->target];
    return STORE_DONE;
}

enum store_answer store_poll(struct store *s)
{
    bool fine = true;
    switch ((enum store_phase)s->phase) {
    case STORE_IDLE:
        return STORE_NOTHING;
    case STORE_ERASE:
        s->slot[s->target] = STORE_SPOILT;
        fine = erase(s, s->target);
        s->phase = STORE_IMAGE;
        break;
    case STORE_IMAGE:
    case STORE_VERIFY:
        fine = s->phase == STORE_IMAGE ? write_chunk(s) : verify_chunk(s);
        if (s->position == BEAM_IMAGE_BYTES) {
            s->phase++;
            s->position = 0;
        }
        break;
    case STORE_RECORD:
        return finish(s, write_record(s));
    case STORE_THERE:
        s->phase = STORE_IDLE;
        return STORE_DONE;
    }
    return fine ? STORE_NOTHING : finish(s, false);
}
