/* SPDX-License-Identifier: MIT */
/*
 * pages.h — two pages of memory: page 0 runs and is read only, page 1 is staged; which memory is which changes.
 *
 *     pages_begin()  page 1 is frozen → header, CRC, device, counter → HMAC → setup, effects, plan, rate, bound → proof run
 *     → the switch is asked for → pages_tick() in the sample interrupt switches → pages_poll() says so
 *
 * Until the last arrow nothing is changed, and any failure leaves everything as it was. The proof run is stepped at the
 * end of the sample interrupt, in the time that it leaves: so one stack serves both models, and a model whose step does
 * not fit the interval is found out before it runs.
 */
#ifndef PAGES_H
#define PAGES_H

#include <stdatomic.h>
#include "authentic.h"
#include "beam_image.h"
#include "board.h"

enum pages_phase { PAGES_IDLE, PAGES_HEADER, PAGES_CODE, PAGES_CONTENT, PAGES_PROOF, PAGES_SWITCH };
enum pages_answer { PAGES_NOTHING, PAGES_SWITCHED, PAGES_REFUSED };
enum { PROOF_NONE, PROOF_RUNS, PROOF_FINE, PROOF_BAD, PROOF_SLOW };

enum {
    PAGES_CODE_SLICE = 256,      /* bytes of an image that one turn of the background loop feeds to the HMAC */
    PAGES_PROOF_STEPS_MAX = 64,  /* in one sample interrupt */
    PAGES_SLOW_STEPS_MAX = 3,    /* steps longer than three quarters of the sample interval */
    PAGES_PROOF_TICKS_MAX = 8192 /* after them a proof run that found no time is given up */
};

struct pages {
    struct beam_image page[2];
    const struct board_facts *facts;
    float dt_s;
    uint8_t phase;           /* enum pages_phase */
    uint8_t fault;           /* enum beam_image_fault of the last refusal */
    uint32_t counter_before; /* an image's counter must be above it */
    uint32_t refused;        /* since power-on */
    uint32_t fed;            /* bytes that the HMAC has seen */
    _Atomic uint8_t active;  /* index of page 0's memory; changed by pages_tick() only, once sampling */
    _Atomic bool wanted;     /* the switch is asked for */
    _Atomic uint8_t proof;   /* PROOF_… */
    uint16_t proof_ticks;    /* the interrupt's */
    uint8_t slow_steps;      /* the interrupt's */
    uint32_t step_us;        /* of the last step of the proof run, the interrupt's */
    uint32_t longest_us[2];  /* of the proof run of each memory's image; 0: it has none, or its steps are below 1 µs */
    union {                  /* one computation at a time; HMACs of a session use it while phase is PAGES_IDLE */
        struct authentic authentic;
        struct beam_image_proof proof;
    } scratch;
};

void pages_init(struct pages *p, const struct board_facts *facts);

const struct beam_image *pages_active(const struct pages *p);
uint32_t pages_longest_us(const struct pages *p);  /* longest step in the active image's proof run */
struct beam_image *pages_staging(struct pages *p); /* write to it only while phase is PAGES_IDLE */

/* ---- Boot, before sampling ---- */

/*
 * All checks but the counter on one of the two memories, at once: about 0.4 M instructions and the proof run. A fault
 * above BEAM_IMAGE_BAD_CODE says that the image is this device's and signed, but cannot run here.
 */
enum beam_image_fault pages_boot_check(struct pages *p, int memory);

/* ---- Background loop ---- */

/* Begin the checks of page 1; its counter must be above this one and the active one. */
void pages_begin(struct pages *p, uint32_t stored_counter);

/* One slice, at most about 80 000 instructions. Says once that the switch was done or refused. */
enum pages_answer pages_poll(struct pages *p);

/* Leave a check that nobody waits for; false when the switch has been done already. */
bool pages_abandon(struct pages *p);

/* ---- Sample interrupt ---- */

/* At its start: true when the pages were switched now, and page 0 is another model. */
bool pages_tick(struct pages *p);

/* At its end: steps of the proof run, as long as the interval that began at tick_us leaves time. */
void pages_prove(struct pages *p, uint32_t tick_us);

#endif
