/* SPDX-License-Identifier: MIT */
/* Core clock. */
#include "parts.h"

enum { READY_TRIES = 200000 }; /* about 0.1 s at the 16 MHz of reset */

static bool wait_for(const volatile uint32_t *at, uint32_t mask, uint32_t value)
{
    for (int tries = READY_TRIES; tries > 0; tries--)
        if ((*at & mask) == value)
            return true;
    return false;
}

bool clock_init(void)
{
    RCC->CR |= CR_HSEON;
    if (!wait_for(&RCC->CR, CR_HSERDY, CR_HSERDY))
        return false;
    FLASH->ACR = ACR_5WS | ACR_PRFTEN | ACR_ICEN | ACR_DCEN;
    RCC->CFGR = CFGR_PPRE1_DIV4 | CFGR_PPRE2_DIV2;
    RCC->PLLCFGR = 8u | 336u << 6 | 0u << 16 | 1u << 22 | 7u << 24; /* 8 MHz / M 8 × N 336 / P 2; HSE */
    RCC->CR |= CR_PLLON;
    if (!wait_for(&RCC->CR, CR_PLLRDY, CR_PLLRDY))
        return false;
    RCC->CFGR |= CFGR_SW_PLL;
    return wait_for(&RCC->CFGR, CFGR_SWS, CFGR_SWS_PLL);
}
