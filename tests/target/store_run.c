/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * One life of a board: what does the store hold, is it whole, and then one more image into it. The emulator may cut the
 * power anywhere in between. Image number n holds bytes made from n, so that the board can say whether it is bit for bit
 * the one that was stored. Prints "boot COUNTER" and, after a store, "stored COUNTER". Status: 0, or what is wrong.
 */
#include <string.h>
#include "board.h"
#include "semihost.h"
#include "store.h"

enum { BROKEN_BOARD = 2, NOT_LOADED, NOT_WHOLE, STORE_SAID_NO, NOT_COUNTED };
#define STORE_TOO (*(const volatile uint32_t *)0x2001FF04u) /* the loader's: 0 looks only, 2 never ends */

static struct beam_image image;
static struct store store;

void app_sample(uint16_t sensor_code)
{
    (void)sensor_code;
}

void app_missed(uint32_t n)
{
    (void)n;
}

static uint8_t byte_of(uint32_t counter, uint32_t offset)
{
    const uint32_t mixed = (counter * 2654435761u + offset) * 2246822519u;
    return (uint8_t)(mixed >> 24);
}

static void make(uint32_t counter)
{
    for (uint32_t at = 0; at < BEAM_IMAGE_BYTES; at++) {
        const uint8_t byte = byte_of(counter, at);
        (void)beam_image_write(&image, at, 1, &byte);
    }
    image.front.header.counter = counter;
}

static bool is_whole(uint32_t counter)
{
    const uint32_t at_counter = (uint32_t)offsetof(struct beam_image_header, counter);
    for (uint32_t at = 0; at < BEAM_IMAGE_BYTES; at++) {
        uint8_t byte = 0;
        if (at - at_counter < 4)
            continue;
        if (!beam_image_read(&image, at, 1, &byte) || byte != byte_of(counter, at))
            return false;
    }
    return image.front.header.counter == counter;
}

static uint32_t look(const struct board_facts *facts)
{
    store_open(&store, facts);
    for (int slot = 0; slot < 2; slot++) {
        if (store.slot[slot] != STORE_VALID)
            continue;
        if (!store_load(&store, slot, &image))
            return NOT_LOADED;
        if (!is_whole(store.counter[slot]))
            return NOT_WHOLE;
        store_authentic(&store, slot, true);
    }
    semihost_text("boot ");
    semihost_number(store.newest == STORE_NONE ? 0 : store.stored);
    semihost_text(" number ");
    semihost_number(store.boots);
    semihost_text("\n");
    return store.counted ? 0 : NOT_COUNTED;
}

static uint32_t store_one(void)
{
    const uint32_t counter = (store.newest == STORE_NONE ? 0 : store.stored) + 1;
    make(counter);
    store_begin(&store, &image);
    enum store_answer answer = STORE_NOTHING;
    while (answer == STORE_NOTHING)
        answer = store_poll(&store);
    if (answer != STORE_DONE)
        return STORE_SAID_NO;
    semihost_text("stored ");
    semihost_number(counter);
    semihost_text("\n");
    return 0;
}

int main(void)
{
    const struct board_facts *facts = board_init();
    if (facts == NULL)
        semihost_exit(BROKEN_BOARD);
    uint32_t wrong = look(facts);
    if (wrong == 0 && STORE_TOO != 0)
        do
            wrong = store_one();
        while (wrong == 0 && STORE_TOO == 2);
    semihost_exit(wrong);
    return 0;
}
