/* SPDX-License-Identifier: MIT */
/* stm32f405.h — the registers and bits that this board uses, named as in ST's reference manual RM0090. */
#ifndef STM32F405_H
#define STM32F405_H

#include <stddef.h>
#include <stdint.h>

struct rcc {
    volatile uint32_t CR, PLLCFGR, CFGR, CIR, unused0[8];
    volatile uint32_t AHB1ENR, unused1[3], APB1ENR, APB2ENR, unused2[11], CSR;
};
struct flash {
    volatile uint32_t ACR, KEYR, OPTKEYR, SR, CR;
};
struct gpio {
    volatile uint32_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFR[2];
};
struct adc {
    volatile uint32_t SR, CR1, CR2, SMPR1, SMPR2, unused0[6], SQR1, SQR2, SQR3, unused1[5], DR;
};
struct dac {
    volatile uint32_t CR, SWTRIGR, DHR12R1;
};
struct usart {
    volatile uint32_t SR, DR, BRR, CR1, CR2, CR3;
};
struct timer {
    volatile uint32_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR;
};
struct iwdg {
    volatile uint32_t KR, PR, RLR, SR;
};
struct systick {
    volatile uint32_t CSR, RVR, CVR;
};
_Static_assert(offsetof(struct rcc, AHB1ENR) == 0x30 && offsetof(struct rcc, APB2ENR) == 0x44 &&
                   offsetof(struct rcc, CSR) == 0x74,
               "RCC");
_Static_assert(offsetof(struct adc, SQR1) == 0x2C && offsetof(struct adc, DR) == 0x4C, "ADC");
_Static_assert(offsetof(struct timer, CNT) == 0x24 && offsetof(struct timer, ARR) == 0x2C, "TIM2");
_Static_assert(offsetof(struct gpio, AFR) == 0x20, "GPIO");

#define RCC     ((struct rcc *)0x40023800u)
#define FLASH   ((struct flash *)0x40023C00u)
#define GPIOA   ((struct gpio *)0x40020000u)
#define ADC1    ((struct adc *)0x40012000u)
#define ADC_CCR (*(volatile uint32_t *)0x40012304u)
#define DAC     ((struct dac *)0x40007400u)
#define TIM2    ((struct timer *)0x40000000u)
#define IWDG    ((struct iwdg *)0x40003000u)
#define USART1  ((struct usart *)0x40011000u)
#define SYSTICK ((struct systick *)0xE000E010u)

#define NVIC_ISER         ((volatile uint32_t *)0xE000E100u)
#define NVIC_ICER         ((volatile uint32_t *)0xE000E180u)
#define NVIC_IPR          ((volatile uint8_t *)0xE000E400u)
#define SCB_AIRCR         (*(volatile uint32_t *)0xE000ED0Cu)
#define SCB_SHPR          ((volatile uint8_t *)0xE000ED18u)        /* [11]: SysTick */
#define UNIQUE_ID         ((const volatile uint32_t *)0x1FFF7A10u) /* three words */
#define AIRCR_SYSRESETREQ 0x05FA0004u

enum { IRQ_ADC = 18, IRQ_USART1 = 37, IRQ_COUNT = 82 };

enum { /* RCC_CR, RCC_CFGR, clock enables */
       CR_HSEON = 1 << 16,
       CR_HSERDY = 1 << 17,
       CR_PLLON = 1 << 24,
       CR_PLLRDY = 1 << 25,
       CFGR_SW_PLL = 2,
       CFGR_SWS = 3 << 2,
       CFGR_SWS_PLL = 2 << 2,
       CFGR_PPRE1_DIV4 = 5 << 10,
       CFGR_PPRE2_DIV2 = 4 << 13,
       AHB1ENR_GPIOA = 1 << 0,
       APB1ENR_TIM2 = 1 << 0,
       APB1ENR_DAC = 1 << 29,
       APB2ENR_USART1 = 1 << 4,
       APB2ENR_ADC1 = 1 << 8,
       CSR_RMVF = 1 << 24, /* why the controller started: forgotten, pin, power, software, the two watchdogs */
       CSR_PINRSTF = 1 << 26,
       CSR_PORRSTF = 1 << 27,
       CSR_SFTRSTF = 1 << 28,
       CSR_IWDGRSTF = 1 << 29,
       CSR_WWDGRSTF = 1 << 30
};
#define CSR_LPWRRSTF 0x80000000u
enum { /* IWDG */
       IWDG_BEGIN = 0xCCCC,
       IWDG_UNLOCK = 0x5555,
       IWDG_RELOAD = 0xAAAA,
       IWDG_DIV32 = 3
};
enum { /* FLASH */
       ACR_5WS = 5,
       ACR_PRFTEN = 1 << 8,
       ACR_ICEN = 1 << 9,
       ACR_DCEN = 1 << 10,
       ACR_DCRST = 1 << 12,
       SR_BSY = 1 << 16,
       SR_FAILED = 0xF2, /* OPERR, WRPERR, PGAERR, PGPERR, PGSERR */
       CR_PG = 1 << 0,
       CR_SER = 1 << 1,
       CR_PSIZE_32 = 2 << 8,
       CR_STRT = 1 << 16
};
#define CR_LOCK 0x80000000u
#define KEY_ONE 0x45670123u
#define KEY_TWO 0xCDEF89ABu
enum { /* ADC, DAC, USART, SysTick */
       ADC_EOC = 1 << 1,
       ADC_OVR = 1 << 5,
       CR1_EOCIE = 1 << 5,
       CR2_ADON = 1 << 0,
       CR2_SWSTART = 1 << 30,
       CCR_ADCPRE_DIV4 = 1 << 16,
       DAC_EN1 = 1 << 0,
       USART_ORE = 1 << 3,
       USART_RXNE = 1 << 5,
       USART_TXE = 1 << 7,
       CR1_RE = 1 << 2,
       CR1_TE = 1 << 3,
       CR1_RXNEIE = 1 << 5,
       CR1_UE = 1 << 13,
       CR1_CEN = 1 << 0,
       EGR_UG = 1 << 0,
       CSR_ENABLE = 1 << 0,
       CSR_TICKINT = 1 << 1,
       CSR_CORE = 1 << 2
};

#endif
