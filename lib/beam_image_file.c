/* SPDX-License-Identifier: MIT */
/* The controller's page behind plain bytes, for programs of another arithmetic. */
#include "beam_image_file.h"

#ifdef BEAM_TARGET

#include <stddef.h>
#include <string.h>

_Static_assert(BEAM_IMAGE_OUTPUTS == BEAM_OUTPUTS && BEAM_IMAGE_PORTS == BEAM_PORTS, "sizes of arrays");
_Static_assert((int)BEAM_IMAGE_ROWS == (int)BEAM_ROWS && BEAM_IMAGE_TAPS == BEAM_TAPS, "sizes of arrays");
_Static_assert(BEAM_IMAGE_HISTORY == BEAM_HISTORY && (int)BEAM_IMAGE_INPUTS == (int)BEAM_ALL_INPUTS, "sizes of arrays");
#define SAME(file, plan, member)                                                                                       \
    _Static_assert(offsetof(struct file, member) == offsetof(struct plan, member), "place of " #member)
SAME(beam_image_counts, beam_plan_counts, law_evaluations);
SAME(beam_image_counts, beam_plan_counts, port_coordinate);
SAME(beam_image_counts, beam_plan_counts, output_ring);
SAME(beam_image_counts, beam_plan_counts, link);
SAME(beam_image_numbers, beam_plan_numbers, gamma);
SAME(beam_image_numbers, beam_plan_numbers, gamma_port);
SAME(beam_image_numbers, beam_plan_numbers, row);
SAME(beam_image_numbers, beam_plan_numbers, compliance);
SAME(beam_image_numbers, beam_plan_numbers, base_gain);
SAME(beam_image_numbers, beam_plan_numbers, link_gamma);
SAME(beam_image_numbers, beam_plan_numbers, taps);

struct beam_image_run {
    struct beam_image page;
    struct beam_image_proof proof; /* its state serves the steps too */
};

uint32_t beam_image_run_bytes(void)
{
    return sizeof(struct beam_image_run);
}

void beam_image_run_load(struct beam_image_run *run, const struct beam_image_file *file)
{
    memset(run, 0, sizeof *run);
    (void)beam_image_write(&run->page, 0, BEAM_IMAGE_BYTES, (const uint8_t *)file); /* never outside */
}

enum beam_image_fault beam_image_run_header(const struct beam_image_run *run,
                                            const uint8_t device[BEAM_IMAGE_DEVICE_BYTES])
{
    const struct beam_image *page = &run->page;
    return beam_image_header_check(page, device ? device : page->front.header.device);
}

enum beam_image_fault beam_image_run_check(struct beam_image_run *run, const uint8_t device[BEAM_IMAGE_DEVICE_BYTES],
                                           float dt_s)
{
    enum beam_image_fault fault = beam_image_run_header(run, device);
    if (fault == BEAM_IMAGE_FINE)
        fault = beam_image_check(&run->page, dt_s);
    if (fault != BEAM_IMAGE_FINE)
        return fault;
    run->proof.progress = 0;
    return beam_image_prove(&run->page, run->page.front.setup.proof_steps, &run->proof);
}

uint32_t beam_image_run_bound(const struct beam_image_run *run)
{
    return beam_image_bound(&run->page);
}

enum beam_image_fault beam_image_run_seal(struct beam_image_run *run, struct beam_image_file *file, float dt_s)
{
    memset(file->front.setup.proof, 0, sizeof file->front.setup.proof);
    file->front.observer.proof = 0.0F;
    beam_image_run_load(run, file);
    const enum beam_image_fault fault = beam_image_check(&run->page, dt_s);
    if (fault != BEAM_IMAGE_FINE)
        return fault;
    (void)beam_image_prove(&run->page, file->front.setup.proof_steps, &run->proof); /* differs from the zeros above */
    memcpy(file->front.setup.proof, run->proof.last, sizeof run->proof.last);
    memcpy(run->page.front.setup.proof, run->proof.last, sizeof run->proof.last);
    file->front.observer.proof = run->page.front.observer.proof = run->proof.innovation;
    file->front.header.crc32 = run->page.front.header.crc32 = beam_image_crc(&run->page);
    return beam_image_run_check(run, 0, dt_s);
}

void beam_image_run_rest(struct beam_image_run *run)
{
    beam_reset(&run->page.plan, &run->proof.state);
}

enum beam_status beam_image_run_step(struct beam_image_run *run, float u, float *y)
{
    float all[BEAM_INPUTS] = {0.0F}, out[BEAM_OUTPUTS] = {0.0F};
    all[0] = u;
    const enum beam_status status = beam_step(&run->page.plan, &run->proof.state, all, out);
    *y = out[0];
    return status;
}

#else

/* ISO C forbids an empty translation unit. */
enum { BEAM_IMAGE_FILE_IS_THE_CONTROLLERS = 1 };

#endif
