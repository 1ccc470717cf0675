/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fuzz_image.c — any bytes as a target image: as they are, and with header and CRC-32 put right, so that the plan's checks
 * are reached and what passes them is stepped. A controller does this only with signed bytes; it must survive them all.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board/board.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static void show(const struct beam_image_file *file)
{
    static FILE *nowhere;
    if (nowhere == NULL && (nowhere = fopen("/dev/null", "w")) == NULL)
        abort();
    struct bf_error err;
    if (json_print_and_free(target_image_file_json(file), nowhere, &err) != BF_OK)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static const struct target_controller any = {.stored = -1};
    static struct beam_image_file file;
    static struct beam_image_run *run;
    enum { STEPS = 16 };
    if (run == NULL)
        run = bf_alloc(1, beam_image_run_bytes());
    memset(&file, 0, sizeof file);
    memcpy(&file, data, n < sizeof file ? n : sizeof file);
    if (file.front.setup.proof_steps > STEPS)
        file.front.setup.proof_steps = 1 + file.front.setup.proof_steps % STEPS;
    const bool shown = n > 0 && data[n - 1] % 16 == 0; /* the costly parts, now and then */
    if (shown && target_image_check(&file, &any) == BEAM_IMAGE_FINE)
        show(&file);
    struct beam_image_header *header = &file.front.header;
    header->magic = BEAM_IMAGE_MAGIC;
    header->layout = BEAM_IMAGE_LAYOUT;
    header->length = BEAM_IMAGE_BYTES;
    if (file.counts.law_evaluations > STEPS)
        file.counts.law_evaluations = STEPS;
    header->crc32 = beam_crc32(0, BEAM_IMAGE_BYTES - (uint32_t)sizeof *header - BEAM_IMAGE_CODE_BYTES,
                               (const uint8_t *)&file.front.setup);
    beam_image_run_load(run, &file);
    const enum beam_image_fault fault = beam_image_run_check(run, NULL, 0.0F);
    if (shown)
        show(&file);
    if (fault != BEAM_IMAGE_FINE && fault != BEAM_IMAGE_BAD_PROOF)
        return 0;
    beam_image_run_rest(run); /* a bad proof is found last: the plan itself may run */
    for (size_t k = 0; k < STEPS; k++) {
        float y, u = (float)(int8_t)data[k % n];
        if (k == STEPS / 2 && n >= sizeof u)
            memcpy(&u, data + n - sizeof u, sizeof u); /* any float at all */
        (void)beam_image_run_step(run, u, &y);
    }
    return 0;
}
