/* SPDX-License-Identifier: MIT */
/* parts.h — what the files of this board share. Pins: PA1 sensor (ADC1_IN1), PA4 drive (DAC1), PA5 alarm, PA9/PA10 USART1. */
#ifndef PARTS_H
#define PARTS_H

#include "../board.h"
#include "stm32f405.h"

#ifndef BOARD_SAMPLE_HZ
#define BOARD_SAMPLE_HZ 1000
#endif
#ifndef BOARD_BAUD
#define BOARD_BAUD 921600
#endif
#if BOARD_SAMPLE_HZ < 100 || BOARD_SAMPLE_HZ > 10000 || 1000000 % BOARD_SAMPLE_HZ != 0
#error "BOARD_SAMPLE_HZ must be 100..10000 and divide 1000000"
#endif
#if BOARD_BAUD < 9600 || BOARD_BAUD > 2000000
#error "BOARD_BAUD must be 9600..2000000"
#endif

enum {
    CORE_HZ = 168000000,
    APB2_HZ = 84000000,
    TIM2_HZ = 84000000, /* twice APB1's clock */
    DRIVE_ZERO = 2048,  /* D/A code of no drive: mid scale */
    NVM_SLOTS = 3,
    NVM_SLOT_BYTES = 8 * 1024 - 4 /* a window of a sector without its mark */
};

bool clock_init(void); /* 168 MHz from the 8 MHz crystal; false: no crystal or no PLL */
void time_init(void);  /* microseconds, from the store's first use on */
void sample_init(void);
bool nvm_init(void);
void port_init(void);

#endif
