/* SPDX-License-Identifier: MIT */
/* Facts of the board, start of every part in order. */
#include "part.h"

enum { KEY_BYTES = 32 };

static struct board_facts facts;
static uint32_t kept[BOARD_KEPT_WORDS] __attribute__((section(".noinit")));

static bool is_erased(const uint8_t *key)
{
    uint8_t all = 0xFF;
    for (int i = 0; i < KEY_BYTES; i++)
        all &= key[i];
    return all == 0xFF;
}

const struct board_facts *board_init(void)
{
    if (!part_begin() || is_erased(part_key())) /* an erased key would be one that everyone knows */
        return NULL;
    part_drive(PART_DRIVE_ZERO);
    part_alarm(false);
    part_identity(facts.device);
    facts.key = part_key();
    facts.session_key = is_erased(part_key() + KEY_BYTES) ? part_key() : part_key() + KEY_BYTES;
    facts.reset = part_reset_reason();
    facts.kept = kept;
    facts.sample_mHz = BOARD_SAMPLE_HZ * 1000u;
    facts.core_Hz = PART_CORE_HZ;
    facts.sensor_code_max = PART_CODE_MAX;
    facts.drive_code_zero = PART_DRIVE_ZERO;
    facts.nvm_slot_bytes = PART_SLOT_BYTES;
    sample_begin();
    port_begin();
    return &facts;
}

void board_alarm(bool on)
{
    part_alarm(on);
}

bool board_idle(bool busy)
{
    if (!busy)
        part_sleep();
    return true;
}
