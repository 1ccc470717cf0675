/* SPDX-License-Identifier: MIT */
/*
 * The tick starts a conversion; its end runs app_sample(). SysTick stands above the converter's interrupt, so a tick is
 * never late, and one that finds the last sample unfinished is counted.
 *
 * While the flash is erased no instruction is fetched from it, and of all the ticks meanwhile one is pending. TIM2 goes on, so the
 * next tick knows from it how many conversions did not take place, and time stamps stay right.
 */
#include "parts.h"

enum { TICK_CYCLES = CORE_HZ / BOARD_SAMPLE_HZ, TICK_US = 1000000 / BOARD_SAMPLE_HZ };
enum { PRIORITY_ADC = 0x20, SENSOR_CHANNEL = 1, IWDG_TICKS = 4095, IWDG_TRIES = 100000 };

void board_tick_isr(void);
void board_sample_isr(void);

static uint32_t tick_us; /* when the last tick was due */
static volatile enum { OFF, WAITING, CONVERTING, STEPPING } phase;

void time_init(void)
{
    TIM2->PSC = TIM2_HZ / 1000000 - 1;
    TIM2->ARR = UINT32_MAX;
    TIM2->EGR = EGR_UG; /* takes the prescaler, and begins at 0 */
    TIM2->CR1 = CR1_CEN;
}

void sample_init(void)
{
    phase = OFF;
    ADC_CCR = CCR_ADCPRE_DIV4;              /* 21 MHz */
    ADC1->SMPR2 = 4u << 3 * SENSOR_CHANNEL; /* 84 cycles; a conversion takes 4.6 µs */
    ADC1->SQR1 = 0;                         /* one conversion */
    ADC1->SQR3 = SENSOR_CHANNEL;
    ADC1->CR1 = CR1_EOCIE;
    ADC1->CR2 = CR2_ADON;
    DAC->CR = DAC_EN1;
    DAC->DHR12R1 = DRIVE_ZERO;
    NVIC_IPR[IRQ_ADC] = PRIORITY_ADC;
    NVIC_ISER[IRQ_ADC / 32] = 1u << IRQ_ADC % 32;
    SCB_SHPR[11] = 0;
    SYSTICK->RVR = TICK_CYCLES - 1;
    SYSTICK->CVR = 0;
    SYSTICK->CSR = CSR_ENABLE | CSR_TICKINT | CSR_CORE;
}

void board_start(void)
{
    IWDG->KR = IWDG_BEGIN;
    IWDG->KR = IWDG_UNLOCK;
    IWDG->PR = IWDG_DIV32; /* 1 ms of the 32 kHz oscillator, which is 17 to 47 kHz: 2.8 to 7.7 s */
    IWDG->RLR = IWDG_TICKS;
    for (int tries = IWDG_TRIES; tries > 0 && IWDG->SR != 0; tries--) { /* some of its own ticks until they hold */
    }
    IWDG->KR = IWDG_RELOAD;
    tick_us = board_time_us();
    phase = WAITING;
}

void board_alive(void)
{
    IWDG->KR = IWDG_RELOAD;
}

void board_tick_isr(void)
{
    if (phase == OFF)
        return;
    const uint32_t passed = (board_time_us() - tick_us + TICK_US / 8) / TICK_US;
    if (passed == 0) /* the first after board_start(); or one that came late has already stood for it */
        return;
    tick_us += passed * TICK_US;
    if (passed - 1 + (phase != WAITING) > 0)
        app_missed(passed - 1 + (phase != WAITING));
    if (phase == WAITING || (phase == CONVERTING && !(ADC1->SR & ADC_EOC))) { /* a lost conversion is started again */
        phase = CONVERTING;
        ADC1->CR2 |= CR2_SWSTART;
    }
}

void board_sample_isr(void)
{
    if (ADC1->SR & ADC_OVR)
        ADC1->SR = ~(uint32_t)ADC_OVR;
    if (!(ADC1->SR & ADC_EOC))
        return;
    const uint16_t code = (uint16_t)(ADC1->DR & 0xFFFu); /* clears EOC */
    if (phase != CONVERTING)
        return;
    phase = STEPPING;
    app_sample(code);
    phase = WAITING;
}

void board_drive(uint16_t code)
{
    DAC->DHR12R1 = code & 0xFFFu;
}

uint32_t board_time_us(void)
{
    return TIM2->CNT;
}
