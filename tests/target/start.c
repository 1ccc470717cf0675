/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Start-up of a test program on an emulated board: FPU, data, bss, then main() with semihosting for standard output and
 * the exit status. A fault ends the emulation with status 99.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

extern uint32_t target_stack_top, target_data_load, target_data, target_data_end, target_bss, target_bss_end;
extern void initialise_monitor_handles(void);
extern void __libc_init_array(void);
int main(void);
void target_reset(void);
void target_fault(void);
uint32_t target_count(void);
void _init(void); /* newlib's hooks: nothing to do here */
void _fini(void);

void _init(void) {}

void _fini(void) {}

/* Instructions so far, on a board whose TIM5 runs (STM32) at one count a nanosecond and an instruction a nanosecond */
uint32_t target_count(void)
{
#ifdef TARGET_COUNTS
    return REGISTER(0x40000C24); /* TIM5_CNT */
#else
    return 0;
#endif
}

void target_fault(void)
{
    const struct {
        uint32_t reason, status;
    } stop = {0x20026, 99};                           /* ADP_Stopped_ApplicationExit */
    register uint32_t operation __asm__("r0") = 0x20; /* SYS_EXIT_EXTENDED */
    register const void *argument __asm__("r1") = &stop;
    __asm__ volatile("bkpt 0xAB" : : "r"(operation), "r"(argument) : "memory");
    for (;;) {
    }
}

void target_reset(void)
{
    REGISTER(0xE000ED88) |= 0xFu << 20; /* CPACR: the FPU, before any instruction of its */
    __asm__ volatile("dsb\n isb");
    memcpy(&target_data, &target_data_load, (uintptr_t)&target_data_end - (uintptr_t)&target_data);
    memset(&target_bss, 0, (uintptr_t)&target_bss_end - (uintptr_t)&target_bss);
#ifdef TARGET_COUNTS
    REGISTER(0x40000C00) |= 1u; /* TIM5_CR1: run */
#endif
    initialise_monitor_handles();
    __libc_init_array();
    exit(main());
}

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handler[15])(void);
} vectors = {&target_stack_top,
             {target_reset, target_fault, target_fault, target_fault, target_fault, target_fault, target_fault}};
