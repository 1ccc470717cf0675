/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Any bytes as a recording to be replayed: refused with one line of text, or counts that add up. */
#include <stdlib.h>
#include <string.h>

#include "board/board.h"
#include "board/replay.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters: {EI_beam_Nm2: 0.491, EI_patch_Nm2: 0.793, rho_beam_kgpm: 0.093,\n"
                                 "  rho_patch_kgpm: 0.433, gamma_sNpm2: 0.013, Ks_V: 40, KB_NmpV: 0.0175}\n"
                                 "inputs: {drive_V: {kind: patch_moment}}\n"
                                 "outputs: {piezo_V: {kind: patch_strain}}\n"
                                 "board: {sample_Hz: 1000, sensor: {per_code: 0.001, zero_code: 2048},\n"
                                 "  drive: {per_code: 0.02, zero_code: 2048}, noise_rms: 0.01}\n";

static const struct beam_image_file *image(void)
{
    static struct target_image made;
    if (made.dt_s > 0.0)
        return &made.file;
    const struct target_options options = {.hold = BEAM_HOLD_ZERO_ORDER};
    struct model model;
    struct bf_error err;
    if (model_read_text("fuzz", model_text, sizeof model_text - 1, &model, &err) != BF_OK ||
        target_image_make(&model, &options, &made, &err) != BF_OK)
        abort();
    model_free(&model);
    struct beam_image_run *run =
        bf_alloc(1, beam_image_run_bytes()); /* a short proof: it is run again for every input */
    made.file.front.setup.proof_steps = 1;
    if (beam_image_run_seal(run, &made.file, 0.0F) != BEAM_IMAGE_FINE)
        abort();
    free(run);
    return &made.file;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lines lines;
    struct replay r;
    struct bf_error err = {0};
    lines_from_memory("fuzz", (const char *)data, n, &lines);
    if (replay_lines(&lines, image(), &r, &err) != BF_OK) {
        if (err.status != BF_BAD_FILE || err.text[0] == '\0' || strchr(err.text, '\n') != NULL)
            abort();
    } else if (r.compared == 0 || r.rows != r.compared + r.resets + r.before_rest + r.after_gap + r.other_image) {
        abort();
    }
    return 0;
}
