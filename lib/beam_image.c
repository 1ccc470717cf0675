/* SPDX-License-Identifier: MIT */
/* A target image: its bytes in a page, its checks, its proof run. CRC and texts in every build, pages in the controller's. */
#include "beam_image.h"

const char *beam_image_fault_text(enum beam_image_fault fault)
{
    switch (fault) {
    case BEAM_IMAGE_FINE:
        return "the image is fine";
    case BEAM_IMAGE_BAD_MAGIC:
        return "this is no target image; make one with beamfit export";
    case BEAM_IMAGE_BAD_LAYOUT:
        return "the image has another layout than this firmware; export it with the program that belongs to the "
               "firmware";
    case BEAM_IMAGE_BAD_LENGTH:
        return "the image has another length than its layout; it was cut, export or copy it again";
    case BEAM_IMAGE_BAD_CRC:
        return "the CRC-32 does not belong to the bytes; the image was damaged on its way, send it again";
    case BEAM_IMAGE_FOREIGN_DEVICE:
        return "the image is for another device; sign it for this one";
    case BEAM_IMAGE_OLD_COUNTER:
        return "the counter is not above the stored one; sign the image with a greater counter";
    case BEAM_IMAGE_BAD_CODE:
        return "the image is not signed with this device's key, or was changed afterwards; sign it with that key";
    case BEAM_IMAGE_BAD_SETUP:
        return "a scale, noise, ratio or the proof's setup is not finite or out of range; correct the model's board "
               "block";
    case BEAM_IMAGE_UNKNOWN_EFFECT:
        return "the model uses an effect that this firmware does not have; drop the effect or build the firmware "
               "with it";
    case BEAM_IMAGE_BAD_PLAN:
        return "the step's plan is damaged, not finite or unstable; export the model again";
    case BEAM_IMAGE_BAD_RATE:
        return "the model's sample interval is not the controller's; export it for the controller's sample rate";
    case BEAM_IMAGE_BAD_PROOF:
        return "the proof run gave other bits than where the image was made; use program and firmware of one version";
    case BEAM_IMAGE_TOO_SLOW:
        return "a step may take longer than the controller's sample interval leaves; leave out a law (export "
               "--without), "
               "sample more slowly, or use a faster controller";
    case BEAM_IMAGE_BAD_ARITHMETIC:
        return "this processor flushes denormal numbers or does not round to nearest; set its floating-point control "
               "word, or build "
               "without -ffast-math";
    }
    return "unknown fault";
}

/* Reflected polynomial 0xEDB88320, four bits a turn. */
uint32_t beam_crc32(uint32_t crc, uint32_t n, const uint8_t bytes[])
{
    static const uint32_t table[16] = {0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4,
                                       0x4DB26158, 0x5005713C, 0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C,
                                       0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C};
    crc = ~crc;
    for (uint32_t i = 0; i < n; i++) {
        crc ^= bytes[i];
        crc = crc >> 4 ^ table[crc & 15u];
        crc = crc >> 4 ^ table[crc & 15u];
    }
    return ~crc;
}

bool beam_arithmetic_is_exact(void)
{
    volatile float tiny = 1.17549435e-38F, half = 0.5F, one = 1.0F, small = 5.9604645e-8F; /* 2⁻¹²⁶, 2⁻²⁴ */
    volatile float denormal = tiny * half;
    volatile float back = denormal + denormal, even = one + small, up = even + small * 3.0F;
    return denormal > 0.0F && back == tiny && even == one && up == one + 2.3841858e-7F && -one - small == -one;
}

uint32_t beam_image_effect_key(const char *id)
{
    uint32_t n = 0;
    while (id[n] != 0)
        n++;
    return beam_crc32(0, n, (const uint8_t *)id);
}

const struct beam_effect *beam_image_effect(uint32_t key)
{
    for (int e = 0; e < beam_effects_count; e++)
        if (beam_image_effect_key(beam_effects[e]->id) == key)
            return beam_effects[e];
    return 0;
}

#ifdef BEAM_TARGET

#include <stddef.h>
#include <string.h>

/* ---- The page: pieces of memory that are one row of bytes ---- */

enum {
    SETUP,
    OBSERVER,
    TRACKING,
    USES, /* of each its effect, then channels and parameters */
    COUNTS = USES + 2 * BEAM_USES,
    NUMBERS,
    CODE,
    PIECES,
    HEADER = PIECES /* comes first, and is no part of the sum */
};
_Static_assert(offsetof(struct beam_use, p) == offsetof(struct beam_use, channels) + sizeof(unsigned), "in one piece");
_Static_assert(sizeof(struct beam_image_use) == 8 + sizeof((struct beam_use *)0)->p, "bytes of a use");

struct piece {
    uint8_t *bytes;
    uint32_t n;
};

static struct piece piece_of(struct beam_image *image, int which)
{
    switch (which) {
    case HEADER:
        return (struct piece){(uint8_t *)&image->front.header, sizeof image->front.header};
    case SETUP:
        return (struct piece){(uint8_t *)&image->front.setup, sizeof image->front.setup};
    case OBSERVER:
        return (struct piece){(uint8_t *)&image->front.observer, sizeof image->front.observer};
    case TRACKING:
        return (struct piece){(uint8_t *)&image->front.tracking, sizeof image->front.tracking};
    case COUNTS:
        return (struct piece){(uint8_t *)&image->plan.n, 2 * BEAM_IMAGE_COUNTS};
    case NUMBERS:
        return (struct piece){(uint8_t *)&image->plan.x, 4 * BEAM_IMAGE_NUMBERS};
    case CODE:
        return (struct piece){image->code, BEAM_IMAGE_CODE_BYTES};
    default:
        break;
    }
    struct beam_use *use = &image->plan.use[(which - USES) / 2];
    if ((which - USES) % 2 == 0)
        return (struct piece){(uint8_t *)&image->effect[(which - USES) / 2], sizeof *image->effect};
    return (struct piece){(uint8_t *)&use->channels, sizeof use->channels + sizeof use->p};
}

/* Between the page and a row of bytes, of which one is left as it is. */
static bool copy(struct beam_image *image, uint32_t offset, uint32_t n, uint8_t bytes[], bool into_page)
{
    struct piece piece = piece_of(image, HEADER);
    uint32_t begin = 0, done = 0;
    if (offset > BEAM_IMAGE_BYTES || n > BEAM_IMAGE_BYTES - offset)
        return false;
    for (int p = 0; p <= PIECES && done < n; begin += piece.n, piece = piece_of(image, p++)) {
        const uint32_t at = offset + done;
        if (at >= begin + piece.n)
            continue;
        const uint32_t left = begin + piece.n - at, count = n - done < left ? n - done : left;
        uint8_t *inside = piece.bytes + (at - begin), *outside = bytes + done;
        memcpy(into_page ? inside : outside, into_page ? outside : inside, count);
        done += count;
    }
    return true;
}

bool beam_image_read(const struct beam_image *image, uint32_t offset, uint32_t n, uint8_t out[])
{
    return copy((struct beam_image *)image, offset, n, out, false);
}

bool beam_image_write(struct beam_image *image, uint32_t offset, uint32_t n, const uint8_t in[])
{
    return copy(image, offset, n, (uint8_t *)in, true);
}

/* ---- Checks ---- */

uint32_t beam_image_crc(const struct beam_image *image)
{
    uint32_t crc = 0;
    for (int p = 0; p < CODE; p++) {
        const struct piece piece = piece_of((struct beam_image *)image, p);
        crc = beam_crc32(crc, piece.n, piece.bytes);
    }
    return crc;
}

enum beam_image_fault beam_image_header_check(const struct beam_image *image,
                                              const uint8_t device[BEAM_IMAGE_DEVICE_BYTES])
{
    const struct beam_image_header *header = &image->front.header;
    if (header->magic != BEAM_IMAGE_MAGIC)
        return BEAM_IMAGE_BAD_MAGIC;
    if (header->layout != BEAM_IMAGE_LAYOUT)
        return BEAM_IMAGE_BAD_LAYOUT;
    if (header->length != BEAM_IMAGE_BYTES)
        return BEAM_IMAGE_BAD_LENGTH;
    if (header->crc32 != beam_image_crc(image))
        return BEAM_IMAGE_BAD_CRC;
    return memcmp(header->device, device, BEAM_IMAGE_DEVICE_BYTES) == 0 ? BEAM_IMAGE_FINE : BEAM_IMAGE_FOREIGN_DEVICE;
}

static bool setup_is_sound(const struct beam_image_setup *s)
{
    const float least_codes = 0.01F, most_codes = 65535.0F;
    if (beam_image_setup_outside(s) >= 0 || !(s->alarm_ratio > s->clear_ratio))
        return false;
    const float noise_codes = s->noise_rms / beam_fabs(s->sensor_V_per_code);
    if (!(noise_codes >= least_codes && noise_codes <= most_codes))
        return false;
    return s->proof_steps >= 1 && s->proof_steps <= 1024 &&
           (s->stuck_samples == 0 || (s->stuck_samples >= 16 && s->stuck_samples <= 65535));
}

/* As many gains as blocks, which the plan has; nothing that a stable filter would not have. */
static bool observer_is_sound(const struct beam_image *image)
{
    const struct beam_image_observer *o = &image->front.observer;
    const float most_gain = 1e3F, most_s = 1e9F;
    int n = 0;
    for (uint32_t blocks = o->blocks; blocks != 0; blocks &= blocks - 1)
        n++;
    if (n > BEAM_OBSERVED || o->blocks >> image->plan.n.n_blocks != 0)
        return false;
    for (int i = 0; i < BEAM_OBSERVED; i++)
        for (int j = 0; j < 2; j++)
            if (!beam_image_number(o->gain[i][j]) || beam_fabs(o->gain[i][j]) > (i < n ? most_gain : 0.0F))
                return false;
    if (!beam_image_observed(image))
        return true;
    return beam_image_number(o->gain_offset) && o->gain_offset >= 0.0F && o->gain_offset < 1.0F &&
           beam_image_number(o->innovation_rms) && o->innovation_rms >= image->front.setup.noise_rms &&
           beam_image_number(o->disturbance_s) && o->disturbance_s > 0.0F && o->disturbance_s <= most_s &&
           beam_image_number(o->proof);
}

/* Samples of the history that the plan's rings use; they stand at its beginning. */
static int history_used(const struct beam_plan_counts *n)
{
    const struct beam_ring *rings[3 + BEAM_CHAIN] = {&n->input_ring[0], &n->command_ring, &n->output_ring[0]};
    int used = 0, n_rings = 3;
    for (int c = 0; c < n->n_links[0]; c++)
        if (n->link[0][c].n_taps > 0)
            rings[n_rings++] = &n->link[0][c].ring;
    for (int i = 0; i < n_rings; i++)
        used = rings[i]->offset + rings[i]->length > used ? rings[i]->offset + rings[i]->length : used;
    return used;
}

static bool tracking_is_sound(const struct beam_image *image)
{
    const struct beam_image_tracking *t = &image->front.tracking;
    const float most_s = 1e9F;
    int n = 0;
    for (uint32_t blocks = t->blocks; blocks != 0; blocks &= blocks - 1)
        n++;
    if (n > BEAM_TRACKED || (t->blocks & ~image->front.observer.blocks) != 0 ||
        (n > 0 && history_used(&image->plan.n) + BEAM_TRACK_WORDS > BEAM_HISTORY))
        return false;
    for (int i = 0; i < BEAM_TRACKED; i++)
        for (int j = 0; j < 2; j++)
            if (!beam_image_number(t->heard[i][j]) || (i >= n && t->heard[i][j] != 0.0F))
                return false;
    for (int b = 0, blocks = (int)t->blocks; blocks != 0; b++, blocks >>= 1) { /* an oscillation that decays */
        const float *psi = image->plan.x.phi[b], half = 0.5F * (psi[0] + psi[3]);
        const float square = psi[0] * psi[3] - psi[1] * psi[2] - half * half;
        if ((blocks & 1) != 0 && !(square > 0.0F && half * half + square < -2.0F * half))
            return false;
    }
    return beam_image_number(t->wander_s) && beam_image_number(t->kappa) && t->kappa >= 0.0F && t->kappa < 1.0F &&
           (n == 0 || (t->wander_s >= image->plan.x.dt_s && t->wander_s <= most_s));
}

/* Of the plan, and of the effects' parameters. */
static bool numbers_are_sound(const struct beam_image *image)
{
    const float *x = (const float *)&image->plan.x;
    for (int i = 0; i < BEAM_IMAGE_NUMBERS; i++)
        if (!beam_image_number(x[i]))
            return false;
    for (int u = 0; u < BEAM_USES; u++)
        for (int i = 0; i < BEAM_EFFECT_PARAMETERS; i++)
            if (!beam_image_number(image->plan.use[u].p[i]))
                return false;
    return true;
}

static enum beam_image_fault resolve_effects(struct beam_image *image)
{
    if (image->plan.n.n_uses < 0 || image->plan.n.n_uses > BEAM_USES)
        return BEAM_IMAGE_BAD_PLAN;
    for (int i = 0; i < image->plan.n.n_uses; i++) {
        image->plan.use[i].effect = beam_image_effect(image->effect[i]);
        if (!image->plan.use[i].effect)
            return BEAM_IMAGE_UNKNOWN_EFFECT;
    }
    return BEAM_IMAGE_FINE;
}

enum beam_image_fault beam_image_check(struct beam_image *image, float dt_s)
{
    const struct beam_image_setup *setup = &image->front.setup;
    const float most_samples = 16777216.0F;
    if (!beam_arithmetic_is_exact())
        return BEAM_IMAGE_BAD_ARITHMETIC;
    if (!numbers_are_sound(image))
        return BEAM_IMAGE_BAD_PLAN;
    if (!setup_is_sound(setup))
        return BEAM_IMAGE_BAD_SETUP;
    const enum beam_image_fault fault = resolve_effects(image);
    if (fault != BEAM_IMAGE_FINE)
        return fault;
    if (beam_plan_check(&image->plan) != BEAM_OK || image->plan.n.n_inputs < 1 || image->plan.n.n_outputs != 1)
        return BEAM_IMAGE_BAD_PLAN;
    if (!observer_is_sound(image) || !tracking_is_sound(image))
        return BEAM_IMAGE_BAD_SETUP;
    if (setup->averaging_s > most_samples * image->plan.x.dt_s) /* the mean counts them in single precision */
        return BEAM_IMAGE_BAD_SETUP;
    const float wanted = dt_s * (1.0F + setup->clock_relative), off = beam_fabs(image->plan.x.dt_s - wanted);
    return dt_s > 0.0F && off > 1e-6F * wanted ? BEAM_IMAGE_BAD_RATE : BEAM_IMAGE_FINE;
}

uint32_t beam_image_bound(const struct beam_image *image)
{
    return beam_step_bound(&image->plan) + beam_image_tracking_bound(image->front.tracking.blocks);
}

/* ---- The proof run ---- */

enum beam_image_fault beam_image_prove(const struct beam_image *image, uint32_t steps, struct beam_image_proof *proof)
{
    const struct beam_image_setup *setup = &image->front.setup;
    const float unit = setup->proof_amplitude / 2147483648.0F;
    if (proof->progress == 0) {
        *proof = (struct beam_image_proof){.random = 1};
        beam_reset(&image->plan, &proof->state);
    }
    for (; steps > 0 && proof->progress < setup->proof_steps; steps--) {
        float u[BEAM_INPUTS], y[BEAM_OUTPUTS];
        proof->random = 1664525u * proof->random + 1013904223u;
        for (int i = 0; i < BEAM_INPUTS; i++)
            u[i] = unit * (float)(int32_t)proof->random;
        const enum beam_status status = beam_step(&image->plan, &proof->state, u, y);
        if (status != BEAM_OK && status != BEAM_ERROR_SOLVE)
            return BEAM_IMAGE_BAD_PROOF;
        for (int i = 1; i < BEAM_IMAGE_PROOFS; i++)
            proof->last[i - 1] = proof->last[i];
        proof->last[BEAM_IMAGE_PROOFS - 1] = y[0];
        proof->innovation = beam_image_observe(image, &proof->observed, y[0]);
        proof->progress++;
    }
    if (proof->progress < setup->proof_steps)
        return BEAM_IMAGE_FINE;
    const uint8_t *found = (const uint8_t *)proof->last, *stated = (const uint8_t *)setup->proof;
    const bool equal = memcmp(found, stated, sizeof setup->proof) == 0 &&
                       memcmp(&proof->innovation, &image->front.observer.proof, sizeof proof->innovation) == 0;
    return equal ? BEAM_IMAGE_FINE : BEAM_IMAGE_BAD_PROOF;
}

#endif /* BEAM_TARGET */
