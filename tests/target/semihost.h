/* SPDX-License-Identifier: GPL-3.0-or-later */
/* semihost.h — a word on standard output and an exit status, without a C library. */
#ifndef SEMIHOST_H
#define SEMIHOST_H

#include <stdint.h>

static inline void semihost_call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

static inline void semihost_text(const char *text)
{
    semihost_call(0x04, text); /* SYS_WRITE0 */
}

static inline void semihost_number(uint32_t number)
{
    char digits[12] = {0};
    int at = 10;
    do
        digits[at--] = (char)('0' + number % 10u);
    while ((number /= 10u) != 0);
    semihost_text(&digits[at + 1]);
}

static inline void semihost_exit(uint32_t status)
{
    const uint32_t stop[2] = {0x20026, status}; /* ADP_Stopped_ApplicationExit */
    semihost_call(0x20, stop);                  /* SYS_EXIT_EXTENDED */
    for (;;) {
    }
}

#endif
