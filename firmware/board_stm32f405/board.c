/* SPDX-License-Identifier: MIT */
/* Facts of the board: identity, key, pins; start of every part in order. */
#include "parts.h"

enum { KEY_BYTES = 32 };
#define ALARM_PIN (1u << 5)
/* Sector 4 holds the keys alone, written once in production; readout protection level 1 keeps debuggers out of it. */
#define KEY         ((const uint8_t *)0x08010000u) /* signs images */
#define SESSION_KEY (KEY + KEY_BYTES)              /* unlocks sessions; blank: KEY does both */
/* A debugger or emulator that wants no sleep (its virtual time would stand still) writes the magic here. */
#define WAKEFUL       (*(const volatile uint32_t *)0x2001FF00u)
#define WAKEFUL_MAGIC 0x5EEDu

static struct board_facts facts;
static uint32_t kept[BOARD_KEPT_WORDS] __attribute__((section(".noinit")));

static bool has_key(void)
{
    const volatile uint8_t *key = KEY;
    uint8_t all = 0xFF;
    for (int i = 0; i < KEY_BYTES; i++)
        all &= key[i];
    return all != 0xFF; /* an erased sector would be a key that everyone knows */
}

/* What the controller noted of this start; then it notes the next one. Every internal reset pulls the pin as well. */
static uint8_t reason(void)
{
    const uint32_t flags = RCC->CSR;
    RCC->CSR = flags | CSR_RMVF;
    if (flags & CSR_PORRSTF)
        return BEAM_RESET_POWER;
    if (flags & (CSR_IWDGRSTF | CSR_WWDGRSTF))
        return BEAM_RESET_WATCHDOG;
    if (flags & (CSR_SFTRSTF | CSR_LPWRRSTF))
        return BEAM_RESET_FAULT;
    return flags & CSR_PINRSTF ? BEAM_RESET_PIN : BEAM_RESET_POWER;
}

const struct board_facts *board_init(void)
{
    if (!clock_init() || !has_key())
        return NULL;
    RCC->AHB1ENR |= AHB1ENR_GPIOA;
    RCC->APB1ENR |= APB1ENR_DAC | APB1ENR_TIM2;
    RCC->APB2ENR |= APB2ENR_USART1 | APB2ENR_ADC1;
    (void)RCC->APB2ENR; /* two cycles until a part answers */
    GPIOA->AFR[1] = 7u << 4 | 7u << 8;
    GPIOA->MODER = 0xA8000000u | 3u << 2 | 3u << 8 | 1u << 10 | 2u << 18 |
                   2u << 20; /* debug pins; PA1, PA4 analogue; PA9, PA10; PA5 */
    for (int i = 0; i < 3; i++) {
        const uint32_t word = UNIQUE_ID[i];
        for (int byte = 0; byte < 4; byte++)
            facts.device[4 * i + byte] = (uint8_t)(word >> 8 * byte);
    }
    facts.key = KEY;
    facts.session_key = board_key_is_blank(SESSION_KEY) ? KEY : SESSION_KEY;
    facts.reset = reason();
    facts.kept = kept;
    facts.sample_mHz = BOARD_SAMPLE_HZ * 1000u;
    facts.core_Hz = CORE_HZ;
    facts.sensor_code_max = 4095;
    facts.drive_code_zero = DRIVE_ZERO;
    facts.nvm_slot_bytes = NVM_SLOT_BYTES;
    time_init();
    sample_init();
    if (!nvm_init())
        return NULL;
    port_init();
    return &facts;
}

void board_alarm(bool on)
{
    GPIOA->BSRR = on ? ALARM_PIN : ALARM_PIN << 16;
}

bool board_idle(bool busy)
{
    if (!busy && WAKEFUL != WAKEFUL_MAGIC)
        __asm__ volatile("wfi");
    return true;
}
