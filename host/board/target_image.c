/* SPDX-License-Identifier: GPL-3.0-or-later */
/* target_image.c — factor, narrow, pack, prove; files, codes, checks. */
#include "deployment.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

_Static_assert((int)DEVICE_ID_BYTES == (int)BEAM_IMAGE_DEVICE_BYTES, "one identity");
_Static_assert((int)DEVICE_KEY_BYTES == (int)BEAM_IMAGE_KEY_BYTES, "one key");
_Static_assert((int)DEVICE_CODE_BYTES == (int)BEAM_IMAGE_CODE_BYTES, "one code");

enum { PROOF_STEPS = 256 };

/* ---- The step, in double ---- */

/* Behind the model's blocks; the pool of states is zero there. */
static void add_beside(const struct deployment *d, struct beam_plan *plan)
{
    for (int i = 0; i < d->n_beside; i++) {
        const int b = plan->n.n_blocks++;
        memcpy(plan->x.phi[b], d->beside[i].phi, sizeof plan->x.phi[b]);
        memcpy(&plan->x.row[0][2 * b], d->beside[i].row, sizeof d->beside[i].row);
        plan->x.gamma[0][2 * b] = 1.0;
    }
}

static enum bf_status make_plan(const struct deployment *d, const struct target_options *options,
                                struct target_image *image, struct bf_error *err)
{
    struct beam_work *work = bf_alloc(1, sizeof *work);
    const struct beam_options step = {.dt_s = image->dt_s, .hold = options->hold};
    enum beam_status status = beam_model_check(&d->out);
    if (status == BEAM_OK)
        status = beam_factor(&d->out, &step, work, &image->plan);
    free(work);
    if (status == BEAM_OK) {
        image->plan.x.taps[0] += d->direct;
        image->n_beside = d->n_beside;
        add_beside(d, &image->plan);
        status = beam_narrow(&image->plan);
    }
    if (status == BEAM_OK)
        return BF_OK;
    return bf_fail(err, BF_NUMERIC, "no step can be made of this model: %s", beam_status_text(status));
}

/* ---- The rest of the image ---- */

static void pack_setup(const struct target_image *image, struct beam_image_setup *setup)
{
    static const double half_scale_codes = 1023.0; /* half of what a 12-bit D/A reaches */
    const struct model_board *b = &image->board;
    *setup = (struct beam_image_setup){
        .sensor_V_per_code = (float)b->sensor_per_code,
        .sensor_zero_code = (float)b->sensor_zero_code,
        .drive_V_per_code = (float)b->drive_per_code,
        .drive_zero_code = (float)b->drive_zero_code,
        .noise_rms = (float)b->noise_rms,
        .alarm_ratio = (float)b->alarm_ratio,
        .clear_ratio = (float)b->clear_ratio,
        .averaging_s = (float)b->averaging_s,
        .clock_relative = (float)image->clock_relative,
        .proof_steps = PROOF_STEPS,
        .proof_amplitude = (float)(half_scale_codes * fabs(b->drive_per_code)),
    };
}

static int digit(char c)
{
    return c <= '9' ? c - '0' : c - 'a' + 10;
}

static void pack_header(const struct model *model, struct beam_image_header *header)
{
    header->magic = BEAM_IMAGE_MAGIC;
    header->layout = BEAM_IMAGE_LAYOUT;
    header->length = BEAM_IMAGE_BYTES;
    for (size_t i = 0; i < sizeof header->model_sha256 && model->sha256[0]; i++)
        header->model_sha256[i] = (uint8_t)(digit(model->sha256[2 * i]) * 16 + digit(model->sha256[2 * i + 1]));
}

/* ---- The controller's arithmetic beside the host's ---- */

static enum bf_status compare_arithmetic(struct target_image *image, struct beam_image_run *run, struct bf_error *err)
{
    enum { STEPS = 4096 };
    struct beam_state *state = bf_alloc(1, sizeof *state);
    uint32_t random = 1;
    double off = 0.0, whole = 0.0;
    beam_reset(&image->plan, state);
    beam_image_run_rest(run);
    for (int k = 0; k < STEPS; k++) {
        random = 1664525u * random + 1013904223u;
        const float u = image->file.front.setup.proof_amplitude / 2147483648.0F * (float)(int32_t)random;
        double in[BEAM_INPUTS] = {(double)u}, out[BEAM_OUTPUTS];
        float y = 0.0F;
        (void)beam_step(&image->plan, state, in, out);
        (void)beam_image_run_step(run, u, &y);
        off += ((double)y - out[0]) * ((double)y - out[0]);
        whole += out[0] * out[0];
    }
    free(state);
    image->float_error = whole > 0.0 ? sqrt(off / whole) : 0.0;
    if (isfinite(image->float_error))
        return BF_OK;
    return bf_fail(err, BF_NUMERIC, "the model does not stay finite under half of the full drive; check its effects");
}

static enum bf_status pack_plan(struct target_image *image, struct bf_error *err)
{
    if (beam_image_pack(&image->plan, &image->file) == BEAM_IMAGE_FINE)
        return BF_OK;
    return bf_fail(err, BF_BAD_FILE,
                   "the model's filters remember more samples than the %d a controller keeps; shorten sensor_delay "
                   "or sample more slowly",
                   BEAM_IMAGE_HISTORY);
}

static enum bf_status seal(const struct model *model, struct target_image *image, struct bf_error *err)
{
    struct beam_image_run *run = bf_alloc(1, beam_image_run_bytes());
    pack_setup(image, &image->file.front.setup);
    pack_header(model, &image->file.front.header);
    enum bf_status status = BF_OK;
    const enum beam_image_fault fault = beam_image_run_seal(run, &image->file, (float)(1.0 / image->board.sample_Hz));
    if (fault != BEAM_IMAGE_FINE)
        status = bf_fail(err, BF_NUMERIC, "a controller would refuse this image: %s", beam_image_fault_text(fault));
    else
        status = compare_arithmetic(image, run, err);
    free(run);
    return status;
}

/*
 * Laws need the static responses of their places. A model without laws may do better with more modes instead: blocks beside
 * the space bring the rest; the space with the least error is taken.
 */
static enum bf_status choose_space(struct deployment *d, bool mending, struct target_image *image, struct bf_error *err)
{
    const size_t most = deploy_statics(&d->model);
    size_t best = most;
    double least = INFINITY;
    bool has_law = false;
    enum bf_status status = BF_OK;
    for (size_t e = 0; e < d->model.n_effects; e++)
        has_law = has_law || d->model.effects[e].effect->law != NULL;
    for (size_t statics = 0; mending && !has_law && status == BF_OK && statics <= most; statics++) {
        status = deploy_space(d, statics, image, err);
        if (status == BF_OK)
            status = deploy_judge(d, mending, image, err);
        if (status == BF_OK && image->held_error < least) {
            least = image->held_error;
            best = statics;
        }
    }
    if (status == BF_OK)
        status = deploy_space(d, best, image, err);
    return status == BF_OK ? deploy_judge(d, mending, image, err) : status;
}

enum bf_status target_image_make(const struct model *model, const struct target_options *options,
                                 struct target_image *out, struct bf_error *err)
{
    struct deployment *d = bf_alloc(1, sizeof *d);
    *out = (struct target_image){.dt_s = 0.0};
    enum bf_status status = target_board(model, options, out, err);
    if (status == BF_OK)
        status = deploy_channels(model, options, d, out, err);
    out->dt_s = (1.0 + out->clock_relative) / out->board.sample_Hz;
    if (status == BF_OK)
        status = choose_space(d, options->hold == BEAM_HOLD_ZERO_ORDER && !options->plain, out, err);
    if (status == BF_OK)
        status = deploy_effects(d, out, err);
    if (status == BF_OK)
        status = make_plan(d, options, out, err);
    if (status == BF_OK)
        status = pack_plan(out, err);
    if (status == BF_OK)
        status = seal(model, out, err);
    deployment_free(d);
    free(d);
    return status;
}

void target_image_free(struct target_image *image)
{
    for (size_t i = 0; i < image->n_notes; i++)
        free(image->notes[i]);
    free(image->notes);
    free(image->effects);
    *image = (struct target_image){.dt_s = 0.0};
}

/* ---- Code, file, checks ---- */

static void code_of(const struct beam_image_file *file, const struct device_key *key, uint8_t code[DEVICE_CODE_BYTES])
{
    device_key_code(key, file, BEAM_IMAGE_BYTES - BEAM_IMAGE_CODE_BYTES, NULL, 0, code);
}

void target_image_sign(struct beam_image_file *file, const struct device_key *key,
                       const uint8_t device[BEAM_IMAGE_DEVICE_BYTES], uint32_t counter)
{
    memcpy(file->front.header.device, device, BEAM_IMAGE_DEVICE_BYTES);
    file->front.header.counter = counter;
    code_of(file, key, file->code);
}

bool target_image_is_signed(const struct beam_image_file *file)
{
    static const uint8_t none[BEAM_IMAGE_CODE_BYTES];
    return memcmp(file->code, none, sizeof none) != 0;
}

enum bf_status target_image_load(const char *path, struct beam_image_file *out, size_t *n, struct bf_error *err)
{
    FILE *f = fopen(path, "rb");
    memset(out, 0, sizeof *out);
    if (f == NULL)
        return bf_fail_at(err, path, 0, "cannot be read: %s; check the name and the permissions", strerror(errno));
    uint8_t beyond;
    *n = fread(out, 1, sizeof *out, f);
    if (*n == sizeof *out)
        *n += fread(&beyond, 1, 1, f);
    const int failed = ferror(f);
    (void)fclose(f);
    return failed == 0 ? BF_OK : bf_fail_at(err, path, 0, "cannot be read; give a file, not a directory");
}

enum bf_status target_image_read(const char *path, struct beam_image_file *out, struct bf_error *err)
{
    size_t n;
    const enum bf_status status = target_image_load(path, out, &n, err);
    if (status == BF_OK && n != sizeof *out)
        return bf_fail_at(err, path, 0, "is no target image: it has %s than %d bytes; make one with beamfit export",
                          n > sizeof *out ? "more" : "fewer", (int)BEAM_IMAGE_BYTES);
    return status;
}

enum bf_status target_image_write(const char *path, const struct beam_image_file *file, struct bf_error *err)
{
    struct atomic_file out;
    if (atomic_open(path, &out, err) != BF_OK)
        return err->status;
    (void)fwrite(file, sizeof *file, 1, out.f);
    return atomic_commit(&out, err);
}

enum beam_image_fault target_image_check(const struct beam_image_file *file, const struct target_controller *against)
{
    const struct beam_image_header *header = &file->front.header;
    struct beam_image_run *run = bf_alloc(1, beam_image_run_bytes());
    beam_image_run_load(run, file);
    enum beam_image_fault fault = beam_image_run_header(run, against->device);
    if (fault == BEAM_IMAGE_FINE && against->stored >= 0 && (int64_t)header->counter <= against->stored)
        fault = BEAM_IMAGE_OLD_COUNTER;
    if (fault == BEAM_IMAGE_FINE && against->key != NULL) {
        uint8_t code[DEVICE_CODE_BYTES];
        code_of(file, against->key, code);
        if (!device_key_equal(code, file->code, sizeof code))
            fault = BEAM_IMAGE_BAD_CODE;
        explicit_bzero(code, sizeof code);
    }
    const double dt_s = against->sample_Hz > 0.0 ? 1.0 / against->sample_Hz : 0.0;
    if (fault == BEAM_IMAGE_FINE)
        fault = beam_image_run_check(run, against->device, (float)dt_s);
    free(run);
    return fault;
}
