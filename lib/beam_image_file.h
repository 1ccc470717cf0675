/* SPDX-License-Identifier: MIT */
/*
 * beam_image_file.h — a target image in one piece, as it lies in a file and travels, and the controller's own code behind
 * functions that a program of any arithmetic may call: the host is compiled in double, the controller in float and in
 * sizes of its own (BEAM_TARGET). Only the controller's build defines them, so they carry no build in their names.
 *
 *     struct beam_image_file file;        fill it member by member (beam_image_pack), or with sizeof file bytes
 *     struct beam_image_run *run = ...    beam_image_run_bytes() of memory
 *
 *     beam_image_run_load(run, &file);
 *     beam_image_run_check(run, device, dt_s)           what a controller would say
 *     beam_image_run_rest(run); beam_image_run_step(run, u, &y) ...        what a controller computes, bit for bit
 */
#ifndef BEAM_IMAGE_FILE_H
#define BEAM_IMAGE_FILE_H

#include "beam_image.h"
#include "beam_language.h"

BEAM_C_BEGIN

enum { /* sizes of a controller (BEAM_TARGET) that the image's arrays have, asserted in beam_image_file.c */
       BEAM_IMAGE_OUTPUTS = 1,
       BEAM_IMAGE_INPUTS = 1,
       BEAM_IMAGE_PORTS = 8,
       BEAM_IMAGE_ROWS = BEAM_IMAGE_OUTPUTS + 2 * BEAM_IMAGE_PORTS,
       BEAM_IMAGE_TAPS = 64,
       BEAM_IMAGE_HISTORY = 64
};

/* struct beam_plan_counts of a controller. */
struct beam_image_counts {
    beam_count n_blocks, n_inputs, n_outputs, n_ports, n_uses;
    beam_count base_use, drive_input, n_taps, beam_latency, latency, law_evaluations;
    beam_count port_use[BEAM_IMAGE_PORTS], port_coordinate[BEAM_IMAGE_PORTS];
    struct beam_ring input_ring[BEAM_IMAGE_INPUTS], command_ring, output_ring[BEAM_IMAGE_OUTPUTS];
    beam_count n_links[BEAM_IMAGE_OUTPUTS];
    struct beam_link link[BEAM_IMAGE_OUTPUTS][BEAM_CHAIN];
};

/* struct beam_plan_numbers of a controller. */
struct beam_image_numbers {
    float dt_s;
    float phi[BEAM_BLOCKS][4];
    float gamma[BEAM_IMAGE_INPUTS][BEAM_STATES];
    float gamma_port[BEAM_IMAGE_PORTS][BEAM_STATES];
    float row[BEAM_IMAGE_ROWS][BEAM_STATES];
    float compliance[BEAM_IMAGE_ROWS][BEAM_IMAGE_PORTS];
    float weight[BEAM_IMAGE_PORTS];
    float base_gain[BEAM_IMAGE_OUTPUTS];
    float link_phi[BEAM_IMAGE_OUTPUTS][BEAM_CHAIN];
    float link_gamma[BEAM_IMAGE_OUTPUTS][BEAM_CHAIN];
    float taps[BEAM_IMAGE_TAPS];
};

struct beam_image_file {
    struct beam_image_front front;
    struct beam_image_counts counts;
    struct beam_image_numbers numbers;
    uint8_t code[BEAM_IMAGE_CODE_BYTES];
};
BEAM_ASSERT(sizeof(struct beam_image_counts) == 2 * BEAM_IMAGE_COUNTS, "counts");
BEAM_ASSERT(sizeof(struct beam_image_numbers) == 4 * BEAM_IMAGE_NUMBERS, "numbers");
BEAM_ASSERT(sizeof(struct beam_image_file) == BEAM_IMAGE_BYTES, "file");

#define beam_image_pack BEAM_NAME(image_pack)

/*
 * The plan, of whatever build, into a file of zeros: counts, numbers as float, effects by their ids. Header and setup are left
 * alone. BEAM_IMAGE_BAD_PLAN when it has not one input and one output, or remembers more samples than a controller keeps.
 */
enum beam_image_fault beam_image_pack(const struct beam_plan *plan, struct beam_image_file *file);

/* A page, and the state of its runs; memory of so many bytes, aligned for anything (as from malloc). */
struct beam_image_run;
uint32_t beam_image_run_bytes(void);

/* Copies the bytes into the page; nothing is checked. */
void beam_image_run_load(struct beam_image_run *run, const struct beam_image_file *file);

/* Magic, layout, length, CRC, device (NULL: any); then everything but counter and code, proof run included (dt_s 0: any). */
enum beam_image_fault beam_image_run_header(const struct beam_image_run *run,
                                            const uint8_t device[BEAM_IMAGE_DEVICE_BYTES]);
enum beam_image_fault beam_image_run_check(struct beam_image_run *run, const uint8_t device[BEAM_IMAGE_DEVICE_BYTES],
                                           float dt_s);

/* beam_image_bound() of the page; only after a check without fault. */
uint32_t beam_image_run_bound(const struct beam_image_run *run);

/*
 * Makes the proof of file->front.setup (proof_steps and proof_amplitude are given) and the CRC-32, with the controller's
 * arithmetic. A fault when a controller would refuse the rest. The code is not touched. `run` is left loaded.
 */
enum beam_image_fault beam_image_run_seal(struct beam_image_run *run, struct beam_image_file *file, float dt_s);

/* Only after a check without fault. Input in the input's unit; returns what beam_step() says, output in *y. */
void beam_image_run_rest(struct beam_image_run *run);
enum beam_status beam_image_run_step(struct beam_image_run *run, float u, float *y);

BEAM_C_END

#endif
