/* SPDX-License-Identifier: MIT */
/*
 * A bare Cortex-M4F that runs the model of a target image: `beamfit export model.yaml -o model.bfi`, linked into the flash. Vectors,
 * start-up and loop are all here; sensor() and drive() are yours. make BEAM=PREFIX/share/beamfit/lib IMAGE=model.bfi
 */
#include "beam_image.h"

extern const uint8_t image_begin[]; /* model.bfi */
extern uint32_t data_load, data_begin, data_end, bss_begin, bss_end, stack_top;

static struct beam_image image;
static union {
    struct beam_image_proof proof; /* once */
    struct beam_state state;       /* then */
} memory;

/* Yours: the D/A holds this voltage from now on; the A/D's finished conversion. */
static void drive(float volt)
{
    (void)volt;
}
static uint32_t sensor(void)
{
    return 2048;
}

/* Ends an emulation with a status; a controller without a debugger stops here. */
static _Noreturn void end(uint32_t status)
{
    const uint32_t stop[2] = {0x20026, status};
    register uint32_t r0 __asm__("r0") = 0x20;
    register const void *r1 __asm__("r1") = stop;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    for (;;) {
    }
}

int main(void)
{
    enum { SAMPLES = 1000 };
    const struct beam_image_setup *setup = &image.front.setup;
    float u = 1.0F, y = 0.0F, largest = 0.0F;
    beam_image_write(&image, 0, BEAM_IMAGE_BYTES, image_begin);
    if (beam_image_header_check(&image, image.front.header.device) != BEAM_IMAGE_FINE ||
        beam_image_check(&image, 0.0F) != BEAM_IMAGE_FINE)
        end(1);
    if (beam_image_prove(&image, setup->proof_steps, &memory.proof) != BEAM_IMAGE_FINE)
        end(2); /* this processor computes otherwise than the one the image was made on */
    beam_reset(&image.plan, &memory.state);
    for (int k = 0; k < SAMPLES; k++) { /* once a sample, from your timer */
        drive(u);
        if (beam_step(&image.plan, &memory.state, &u, &y) != BEAM_OK)
            end(3);
        const float residual = beam_image_sensor_value(setup, sensor()) - y;
        largest = beam_fabs(residual) > largest ? beam_fabs(residual) : largest;
    }
    end(largest > 0.0F ? 0 : 4); /* a beam that does not answer 1 V */
}

static _Noreturn void fault(void)
{
    end(5);
}

void reset(void);
void reset(void)
{
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;           /* the FPU, before any instruction of its */
    __asm__ volatile("dsb\n isb\n vmsr fpscr, %0" : : "r"(0)); /* to nearest, denormal numbers kept: as the host */
    for (uint32_t *to = &data_begin, *from = &data_load; (uintptr_t)to < (uintptr_t)&data_end;)
        *to++ = *from++;
    for (uint32_t *to = &bss_begin; (uintptr_t)to < (uintptr_t)&bss_end;)
        *to++ = 0;
    (void)main();
}

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*core[15])(void);
} vectors = {&stack_top, {reset, fault, fault, fault, fault, fault}};
