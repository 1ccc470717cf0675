/* SPDX-License-Identifier: GPL-3.0-or-later */
/* beam_image_rig.h — a good image of the controller's arithmetic, and a page of it for each test to spoil. */
#ifndef BEAM_IMAGE_RIG_H
#define BEAM_IMAGE_RIG_H

#define BEAM_FLOAT
#define BEAM_TARGET
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "beam_image.h"

static const float rate_Hz = 1024.0F;
static const uint8_t device[BEAM_IMAGE_DEVICE_BYTES] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
static struct beam_image good, page;
static struct beam_image_proof proof;

static inline float dt_s(void)
{
    return 1.0F / rate_Hz;
}

static inline uint32_t crc_of(const char *id)
{
    return beam_crc32(0, (uint32_t)strlen(id), (const uint8_t *)id);
}

static inline void make_plan(struct beam_plan *plan)
{
    static struct beam_work work;
    static struct beam_model model;
    const struct beam_description d = {
        .basis = BEAM_BASIS_PATCH,
        .parameters = {.EI_beam_Nm2 = 0.491F,
                       .EI_patch_Nm2 = 0.793F,
                       .rho_beam_kgpm = 0.093F,
                       .rho_patch_kgpm = 0.433F,
                       .cDI_beam_sNm2 = 0.649e-5F,
                       .cDI_patch_sNm2 = 1.255e-5F,
                       .gamma_sNpm2 = 0.013F,
                       .Ks_V = 40.0F,
                       .KB_NmpV = 1.746e-2F},
        .n_inputs = 1,
        .n_outputs = 1,
        .input = {{.kind = BEAM_INPUT_PATCH_MOMENT}},
        .output = {{.kind = BEAM_OUTPUT_PATCH_STRAIN}},
        .n_uses = 1,
        .use = {{.effect = beam_effect_find("cubic_stiffness"), .p = {1e4F, 0.2F}}},
    };
    const struct beam_options options = {.dt_s = dt_s(), .hold = BEAM_HOLD_ZERO_ORDER};
    assert_int_equal(beam_assemble(&d, &model), BEAM_OK);
    assert_int_equal(beam_factor(&model, &options, &work, plan), BEAM_OK);
}

static inline void seal(struct beam_image *image)
{
    memset(image->front.setup.proof, 0, sizeof image->front.setup.proof);
    assert_int_equal(beam_image_check(image, dt_s()), BEAM_IMAGE_FINE);
    proof.progress = 0;
    (void)beam_image_prove(image, image->front.setup.proof_steps, &proof);
    memcpy(image->front.setup.proof, proof.last, sizeof proof.last);
    image->front.observer.proof = proof.innovation;
    image->front.header.crc32 = beam_image_crc(image);
}

static inline int make_good(void **state)
{
    (void)state;
    make_plan(&good.plan);
    good.effect[0] = crc_of("cubic_stiffness");
    good.front.setup = (struct beam_image_setup){.sensor_V_per_code = 1e-3F,
                                                 .sensor_zero_code = 2048.0F,
                                                 .drive_V_per_code = 0.02F,
                                                 .drive_zero_code = 2048.0F,
                                                 .noise_rms = 2e-3F,
                                                 .quiet_ratio = 0.2F,
                                                 .offset_ratio = 1.0F,
                                                 .alarm_ratio = 3.0F,
                                                 .clear_ratio = 2.0F,
                                                 .averaging_s = 1.0F,
                                                 .proof_steps = 100,
                                                 .proof_amplitude = 10.0F};
    good.front.header = (struct beam_image_header){
        .magic = BEAM_IMAGE_MAGIC, .layout = BEAM_IMAGE_LAYOUT, .length = BEAM_IMAGE_BYTES, .counter = 5};
    memcpy(good.front.header.device, device, sizeof device);
    for (int i = 0; i < BEAM_IMAGE_CODE_BYTES; i++)
        good.code[i] = (uint8_t)(200 + i);
    seal(&good);
    return 0;
}

static inline int fresh(void **state)
{
    (void)state;
    page = good;
    return 0;
}

static inline enum beam_image_fault check(void)
{
    page.front.header.crc32 = beam_image_crc(&page);
    return beam_image_check(&page, dt_s());
}

#endif
