/* SPDX-License-Identifier: MIT */
/* Staged image → checks in slices → switch at a step boundary. */
#include "pages.h"

enum { CODE_AT = BEAM_IMAGE_BYTES - BEAM_IMAGE_CODE_BYTES, CHUNK = 64 };

void pages_init(struct pages *p, const struct board_facts *facts)
{
    *p = (struct pages){.facts = facts};
    p->dt_s = 1000.0F / (float)facts->sample_mHz;
}

const struct beam_image *pages_active(const struct pages *p)
{
    return &p->page[atomic_load(&p->active)];
}

struct beam_image *pages_staging(struct pages *p)
{
    return &p->page[atomic_load(&p->active) ^ 1u];
}

uint32_t pages_longest_us(const struct pages *p)
{
    return p->longest_us[atomic_load(&p->active)];
}

/* What the image is, what its step may cost here. */
static enum beam_image_fault check_image(const struct pages *p, struct beam_image *image)
{
    const enum beam_image_fault fault = beam_image_check(image, p->dt_s);
    if (fault != BEAM_IMAGE_FINE)
        return fault;
    const uint32_t budget = beam_image_budget(p->facts->core_Hz, p->facts->sample_mHz);
    return beam_image_bound(image) > budget ? BEAM_IMAGE_TOO_SLOW : BEAM_IMAGE_FINE;
}

/* ---- The code ---- */

static void code_begin(struct pages *p)
{
    p->fed = 0;
    authentic_begin(&p->scratch.authentic, p->facts->key);
}

/* `most` further bytes; true when all were seen. */
static bool code_feed(struct pages *p, const struct beam_image *image, uint32_t most)
{
    uint8_t chunk[CHUNK];
    for (uint32_t done = 0; done < most && p->fed < CODE_AT;) {
        const uint32_t left = CODE_AT - p->fed, n = left < CHUNK ? left : CHUNK;
        beam_image_read(image, p->fed, n, chunk);
        authentic_feed(&p->scratch.authentic, n, chunk);
        p->fed += n;
        done += n;
    }
    return p->fed == CODE_AT;
}

static bool code_end(struct pages *p, const struct beam_image *image)
{
    uint8_t code[BEAM_IMAGE_CODE_BYTES];
    authentic_end(&p->scratch.authentic, code);
    const bool equal = authentic_equal(sizeof code, code, image->code);
    authentic_wipe(sizeof code, code);
    return equal;
}

/* ---- Boot ---- */

static void note_step(struct pages *p, int memory, uint32_t step_us)
{
    if (step_us > p->longest_us[memory])
        p->longest_us[memory] = step_us;
}

enum beam_image_fault pages_boot_check(struct pages *p, int memory)
{
    struct beam_image *image = &p->page[memory];
    enum beam_image_fault fault = beam_image_header_check(image, p->facts->device);
    if (fault != BEAM_IMAGE_FINE)
        return fault;
    code_begin(p);
    code_feed(p, image, CODE_AT);
    if (!code_end(p, image))
        return BEAM_IMAGE_BAD_CODE;
    fault = check_image(p, image);
    p->scratch.proof.progress = 0;
    p->longest_us[memory] = 0;
    for (uint32_t step = 0; fault == BEAM_IMAGE_FINE && step < image->front.setup.proof_steps; step++) {
        const uint32_t begun_us = board_time_us();
        fault = beam_image_prove(image, 1, &p->scratch.proof);
        note_step(p, memory, board_time_us() - begun_us);
    }
    return fault;
}

/* ---- Background loop ---- */

void pages_begin(struct pages *p, uint32_t stored_counter)
{
    const uint32_t active = pages_active(p)->front.header.counter;
    p->counter_before = stored_counter > active ? stored_counter : active;
    p->phase = PAGES_HEADER;
}

static enum beam_image_fault check_header(struct pages *p)
{
    const struct beam_image *image = pages_staging(p);
    enum beam_image_fault fault = beam_image_header_check(image, p->facts->device);
    if (fault == BEAM_IMAGE_FINE && image->front.header.counter <= p->counter_before)
        fault = BEAM_IMAGE_OLD_COUNTER;
    code_begin(p);
    p->phase = PAGES_CODE;
    return fault;
}

static enum beam_image_fault check_code(struct pages *p)
{
    const struct beam_image *image = pages_staging(p);
    if (!code_feed(p, image, PAGES_CODE_SLICE))
        return BEAM_IMAGE_FINE;
    p->phase = PAGES_CONTENT;
    return code_end(p, image) ? BEAM_IMAGE_FINE : BEAM_IMAGE_BAD_CODE;
}

static enum beam_image_fault check_content(struct pages *p)
{
    const enum beam_image_fault fault = check_image(p, pages_staging(p));
    if (fault != BEAM_IMAGE_FINE)
        return fault;
    p->scratch.proof.progress = 0;
    p->longest_us[atomic_load(&p->active) ^ 1u] = 0;
    p->proof_ticks = 0;
    p->step_us = 0;
    p->slow_steps = 0;
    p->phase = PAGES_PROOF;
    atomic_store(&p->proof, PROOF_RUNS); /* from here the scratch is the interrupt's */
    return BEAM_IMAGE_FINE;
}

static enum beam_image_fault await_proof(struct pages *p)
{
    const uint8_t proof = atomic_load(&p->proof);
    if (proof == PROOF_RUNS)
        return BEAM_IMAGE_FINE;
    atomic_store(&p->proof, PROOF_NONE);
    if (proof != PROOF_FINE)
        return proof == PROOF_SLOW ? BEAM_IMAGE_TOO_SLOW : BEAM_IMAGE_BAD_PROOF;
    p->phase = PAGES_SWITCH;
    atomic_store(&p->wanted, true);
    return BEAM_IMAGE_FINE;
}

enum pages_answer pages_poll(struct pages *p)
{
    enum beam_image_fault fault = BEAM_IMAGE_FINE;
    switch ((enum pages_phase)p->phase) {
    case PAGES_IDLE:
        return PAGES_NOTHING;
    case PAGES_HEADER:
        fault = check_header(p);
        break;
    case PAGES_CODE:
        fault = check_code(p);
        break;
    case PAGES_CONTENT:
        fault = check_content(p);
        break;
    case PAGES_PROOF:
        fault = await_proof(p);
        break;
    case PAGES_SWITCH:
        if (atomic_load(&p->wanted))
            return PAGES_NOTHING;
        p->phase = PAGES_IDLE;
        return PAGES_SWITCHED;
    }
    if (fault == BEAM_IMAGE_FINE)
        return PAGES_NOTHING;
    authentic_wipe(sizeof p->scratch, &p->scratch);
    p->fault = (uint8_t)fault;
    p->refused++;
    p->phase = PAGES_IDLE;
    return PAGES_REFUSED;
}

bool pages_abandon(struct pages *p)
{
    const bool asked = p->phase == PAGES_SWITCH;
    if (p->phase == PAGES_CODE)
        authentic_wipe(sizeof p->scratch, &p->scratch);
    p->phase = PAGES_IDLE;
    atomic_store(&p->proof, PROOF_NONE);
    return !asked || atomic_exchange(&p->wanted, false);
}

/* ---- Sample interrupt ---- */

bool pages_tick(struct pages *p)
{
    if (!atomic_load(&p->wanted))
        return false;
    atomic_store(&p->active, atomic_load(&p->active) ^ 1u);
    atomic_store(&p->wanted, false);
    return true;
}

/* A step that takes more than its share once may have been interrupted; three times, the model does not fit. */
static uint8_t prove_once(struct pages *p, uint32_t end_us, uint32_t *now_us)
{
    const struct beam_image *image = pages_staging(p);
    struct beam_image_proof *proof = &p->scratch.proof;
    const uint32_t begun_us = *now_us;
    const enum beam_image_fault fault = beam_image_prove(image, 1, proof);
    *now_us = board_time_us();
    p->step_us = *now_us - begun_us;
    note_step(p, (int)(atomic_load(&p->active) ^ 1u), p->step_us);
    if (fault != BEAM_IMAGE_FINE)
        return PROOF_BAD;
    if (p->step_us > end_us && ++p->slow_steps == PAGES_SLOW_STEPS_MAX)
        return PROOF_SLOW;
    return proof->progress == image->front.setup.proof_steps ? PROOF_FINE : PROOF_RUNS;
}

/* A further step is begun while it would end, like the last one, within three quarters of the interval. */
void pages_prove(struct pages *p, uint32_t tick_us)
{
    uint8_t proof = atomic_load(&p->proof);
    if (proof != PROOF_RUNS)
        return;
    const uint32_t interval_us = 1000000000u / p->facts->sample_mHz, end_us = interval_us - interval_us / 4;
    uint32_t now_us = board_time_us();
    int steps = 0;
    for (; proof == PROOF_RUNS && steps < PAGES_PROOF_STEPS_MAX && now_us - tick_us + p->step_us < end_us; steps++)
        proof = prove_once(p, end_us, &now_us);
    if (steps == 0)
        p->step_us /= 2;
    if (proof == PROOF_RUNS && ++p->proof_ticks == PAGES_PROOF_TICKS_MAX)
        proof = PROOF_SLOW;
    atomic_store(&p->proof, proof);
}
