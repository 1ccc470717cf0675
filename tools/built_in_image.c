/* SPDX-License-Identifier: MIT */
/*
 * built_in_image.c — prints firmware/built_in.h's constant: the image of the model that a controller carries in ROM.
 *
 *     built_in_image HZ > built_in_image.c
 *
 * The paper's beam with its handbook values, the patch as actuator and as sensor, made as `beamfit export` makes an image:
 * the step in double, narrowed to 24 bits, the proof run by the controller's own code.
 */
#include <stdio.h>
#include <stdlib.h>
#include "beam_image_file.h"

static const struct beam_description beam = {
    .basis = BEAM_BASIS_PATCH,
    .parameters = {.EI_beam_Nm2 = 0.495,
                   .EI_patch_Nm2 = 1.050,
                   .rho_beam_kgpm = 0.089,
                   .rho_patch_kgpm = 0.168,
                   .cDI_beam_sNm2 = 0.825e-5,
                   .cDI_patch_sNm2 = 0.825e-5,
                   .gamma_sNpm2 = 0.00183,
                   .Ks_V = 60.0,
                   .KB_NmpV = 0.010},
    .n_inputs = 1,
    .n_outputs = 1,
    .input = {{BEAM_INPUT_PATCH_MOMENT, 0.0}},
    .output = {{BEAM_OUTPUT_PATCH_STRAIN, 0.0}},
};

/* Converters of 12 bits around mid scale: 3.3 V of sensor voltage, 41 V of drive. */
static const struct beam_image_setup setup = {.sensor_V_per_code = 3.3F / 4096,
                                              .sensor_zero_code = 2048,
                                              .drive_V_per_code = 0.01F,
                                              .drive_zero_code = 2048,
                                              .noise_rms = 0.002F,
                                              .alarm_ratio = 3.0F,
                                              .clear_ratio = 2.0F,
                                              .averaging_s = 1.0F,
                                              .quiet_ratio = 0.2F,
                                              .offset_ratio = 1.0F,
                                              .stuck_samples = 121, /* noise of 2.5 codes: as beamfit export has it */
                                              .proof_steps = 256,
                                              .proof_amplitude = 10.0F};

static enum beam_image_fault make(double dt_s, struct beam_image_file *file)
{
    static struct beam_model model;
    static struct beam_work work;
    static struct beam_plan plan;
    struct beam_image_run *run = malloc(beam_image_run_bytes());
    const struct beam_options options = {.dt_s = dt_s, .hold = BEAM_HOLD_ZERO_ORDER};
    enum beam_image_fault fault = BEAM_IMAGE_BAD_PLAN;
    if (run && beam_assemble(&beam, &model) == BEAM_OK && beam_factor(&model, &options, &work, &plan) == BEAM_OK &&
        beam_narrow(&plan) == BEAM_OK && beam_image_pack(&plan, file) == BEAM_IMAGE_FINE) {
        file->front.header = (struct beam_image_header){
            .magic = BEAM_IMAGE_MAGIC, .layout = BEAM_IMAGE_LAYOUT, .length = BEAM_IMAGE_BYTES};
        file->front.setup = setup;
        fault = beam_image_run_seal(run, file, (float)dt_s);
    }
    free(run);
    return fault;
}

int main(int argc, char **argv)
{
    static struct beam_image_file file;
    const double rate_Hz = argc == 2 ? strtod(argv[1], NULL) : 0.0;
    if (!(rate_Hz > 0.0)) {
        fputs("usage: built_in_image HZ\n", stderr);
        return 1;
    }
    const enum beam_image_fault fault = make(1.0 / rate_Hz, &file);
    if (fault != BEAM_IMAGE_FINE) {
        fprintf(stderr, "built_in_image: %s\n", beam_image_fault_text(fault));
        return 1;
    }
    printf("/* Made by: built_in_image %s */\n#include \"beam_image.h\"\nconst uint8_t "
           "built_in_image[BEAM_IMAGE_BYTES] = {",
           argv[1]);
    const uint8_t *bytes = (const uint8_t *)&file;
    for (int i = 0; i < BEAM_IMAGE_BYTES; i++)
        printf("%s%u,", i % 32 == 0 ? "\n" : "", bytes[i]);
    puts("\n};");
    return ferror(stdout) || fflush(stdout) ? 1 : 0;
}
