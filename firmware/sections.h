/* SPDX-License-Identifier: MIT */
/* sections.h — what sections.ld lays out. A board's reset handler calls sections_init() before main(). */
#ifndef SECTIONS_H
#define SECTIONS_H

#include <stdint.h>

extern uint32_t board_stack_top, board_data_load, board_data, board_data_end, board_bss, board_bss_end;

/* Initial values out of flash, zeros elsewhere. */
static inline void sections_init(void)
{
    const uint32_t *from = &board_data_load;
    for (uint32_t *to = &board_data; (uintptr_t)to < (uintptr_t)&board_data_end;)
        *to++ = *from++;
    for (uint32_t *to = &board_bss; (uintptr_t)to < (uintptr_t)&board_bss_end;)
        *to++ = 0;
}

#endif
