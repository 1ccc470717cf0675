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

enum { PROOF_STEPS = 256, EVALUATIONS_MOST = 16, EVALUATIONS_LEAST = 4 };

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

/* ---- What a step costs ---- */

/* Laws that would not fit with all their evaluations get fewer of them: few steps want more than four. */
static enum bf_status fit_interval(struct target_image *image, bool tracks, struct bf_error *err)
{
    const struct model_board *b = &image->board;
    struct beam_plan_counts *n = &image->plan.n;
    const uint32_t beside = beam_image_tracking_bound(tracks ? (1u << BEAM_TRACKED) - 1u : 0u);
    image->step_budget = beam_image_budget((uint32_t)(1e6 * b->core_MHz), (uint32_t)(1e3 * b->sample_Hz + 0.5));
    n->law_evaluations = EVALUATIONS_MOST;
    while (n->n_ports > 0 && n->law_evaluations > EVALUATIONS_LEAST &&
           beam_step_bound(&image->plan) + beside > image->step_budget)
        n->law_evaluations--;
    image->law_evaluations = n->n_ports > 0 ? n->law_evaluations : 0;
    image->step_bound = beam_step_bound(&image->plan) + beside;
    if (image->step_bound <= image->step_budget)
        return BF_OK;
    return bf_fail(
        err, BF_NUMERIC,
        "a step of this model may take %u instructions, and at %g Hz a controller of %g MHz leaves %u for it; leave "
        "out a law (--without), sample more slowly, or say the clock of a faster one (--core-MHz)",
        (unsigned)image->step_bound, b->sample_Hz, b->core_MHz, (unsigned)image->step_budget);
}

/* ---- The rest of the image ---- */

/*
 * Equal codes in a row that white noise of this rms gives once in 1e12 runs, times 8 for noise that is alike over as many
 * samples: n with p^n = 1e-12, p the chance of the likeliest code of a Gaussian of σ² = rms² − 1/12. 0: more than 65535.
 */
static uint32_t stuck_samples(double noise_codes)
{
    static const double rare = 1e-12, alike = 8.0, least = 64.0, most = 65535.0;
    const double square = noise_codes * noise_codes - 1.0 / 12.0;
    const double p = square > 0.0 ? erf(0.5 / sqrt(2.0 * square)) : 1.0;
    const double n = ceil(alike * log(rare) / log(p));
    return p < 1.0 && n <= most ? (uint32_t)fmax(n, least) : 0;
}

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
        .quiet_ratio = (float)b->quiet_ratio,
        .offset_ratio = (float)b->offset_ratio,
        .stuck_samples = stuck_samples(b->noise_rms / fabs(b->sensor_per_code)),
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
    double off = 0.0, whole = 0.0, unsolved = 0.0;
    beam_reset(&image->plan, state);
    beam_image_run_rest(run);
    for (int k = 0; k < STEPS; k++) {
        random = 1664525u * random + 1013904223u;
        const float u = image->file.front.setup.proof_amplitude / 2147483648.0F * (float)(int32_t)random;
        double in[BEAM_INPUTS] = {(double)u}, out[BEAM_OUTPUTS];
        float y = 0.0F;
        (void)beam_step(&image->plan, state, in, out);
        unsolved += beam_image_run_step(run, u, &y) == BEAM_ERROR_SOLVE ? 1.0 : 0.0;
        off += ((double)y - out[0]) * ((double)y - out[0]);
        whole += out[0] * out[0];
    }
    free(state);
    image->unsolved = unsolved / STEPS;
    if (unsolved > 0.0)
        target_note(image,
                    "in %.2g %% of the steps under half the full drive the laws want more than %d evaluations; the "
                    "best force found is used",
                    100.0 * image->unsolved, image->law_evaluations);
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

/* A number of the board that no controller takes, said by its name. */
static enum bf_status check_setup(const struct beam_image_setup *setup, struct bf_error *err)
{
    const int outside = beam_image_setup_outside(setup);
    const double codes = fabs((double)setup->noise_rms / (double)setup->sensor_V_per_code);
    if (outside >= 0) {
        const struct beam_image_limit *limit = &beam_image_limits[outside];
        return bf_fail(err, BF_BAD_FILE,
                       "%s is %g, and a controller takes %s%g to %g; correct the board block or the option",
                       limit->name, (double)beam_image_setup_value(setup, outside), limit->of_size ? "sizes from " : "",
                       (double)limit->least, (double)limit->most);
    }
    if (codes >= 0.01 && codes <= 65535.0)
        return BF_OK;
    return bf_fail(
        err, BF_BAD_FILE,
        "noise_rms is %g codes of the sensor, and a controller takes 0.01 to 65535; the converter alone makes 0.3, so "
        "correct noise_rms or the sensor's per_code",
        codes);
}

static enum bf_status seal(const struct model *model, struct target_image *image, struct bf_error *err)
{
    struct beam_image_run *run = bf_alloc(1, beam_image_run_bytes());
    pack_setup(image, &image->file.front.setup);
    pack_header(model, &image->file.front.header);
    if (check_setup(&image->file.front.setup, err) != BF_OK) {
        free(run);
        return err->status;
    }
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
        status = fit_interval(out, options->tracks, err);
    if (status == BF_OK)
        status = pack_plan(out, err);
    if (status == BF_OK)
        status = deploy_observer(out, err);
    if (status == BF_OK && options->tracks)
        status = deploy_tracking(out, err);
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
    outputs_note_input(path);
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
    const uint32_t budget = beam_image_budget((uint32_t)against->core_Hz, (uint32_t)(1e3 * against->sample_Hz + 0.5));
    if (fault == BEAM_IMAGE_FINE && beam_image_run_bound(run) > budget)
        fault = BEAM_IMAGE_TOO_SLOW;
    free(run);
    return fault;
}

uint32_t target_image_bound(const struct beam_image_file *file)
{
    struct beam_image_run *run = bf_alloc(1, beam_image_run_bytes());
    beam_image_run_load(run, file);
    const enum beam_image_fault fault = beam_image_run_check(run, NULL, 0.0F);
    const uint32_t bound = fault == BEAM_IMAGE_FINE || fault == BEAM_IMAGE_BAD_PROOF ? beam_image_run_bound(run) : 0;
    free(run);
    return bound;
}
