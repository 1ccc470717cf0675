/* SPDX-License-Identifier: GPL-3.0-or-later */
/* target_image_text.c — what is in an image, as an answer. */
#include "board.h"

#include <complex.h>
#include <math.h>
#include <string.h>

enum { COST_TEXT = 240 };

/* ---- What the bytes say ---- */

static const char *effect_name(uint32_t crc)
{
    const struct beam_effect *effect = beam_image_effect(crc);
    return effect != NULL ? effect->id : "unknown effect";
}

/* Pole of block b: ln of an eigenvalue of 1 + ψ over the interval; an oscillating pair has Im > 0. */
static double complex block_pole(const struct beam_image_file *file, int b)
{
    const double p[4] = {(double)file->numbers.phi[b][0], (double)file->numbers.phi[b][1],
                         (double)file->numbers.phi[b][2], (double)file->numbers.phi[b][3]};
    const double half = 0.5 * (p[0] + p[3]), product = p[0] * p[3] - p[1] * p[2];
    const double complex root = csqrt(half * half - product);
    return clog(1.0 + half + root) / (double)file->numbers.dt_s;
}

static bool oscillates(double complex pole)
{
    return cimag(pole) > 1e-9 * cabs(pole);
}

static int least(int a, int b)
{
    return a < b ? a : b;
}

/* Clock in MHz below which a controller refuses a step of this bound at the file's sample rate. */
static double least_core_MHz(const struct beam_image_file *file, uint32_t bound)
{
    const double rate_Hz = (1.0 + (double)file->front.setup.clock_relative) / (double)file->numbers.dt_s;
    return 2e-6 * rate_Hz * (double)(bound + BEAM_IMAGE_INTERRUPT);
}

/* What a step costs at most, in one clause. */
static void describe_cost(const struct beam_image_file *file, char text[COST_TEXT])
{
    const struct beam_image_counts *n = &file->counts;
    const uint32_t bound = target_image_bound(file);
    char laws[80] = "linear";
    if (n->n_ports > 0)
        (void)snprintf(laws, sizeof laws, "laws at %ld coordinate%s, %ld evaluations at most", (long)n->n_ports,
                       n->n_ports == 1 ? "" : "s", (long)n->law_evaluations);
    if (bound == 0) /* an image that is refused is described too */
        (void)snprintf(text, COST_TEXT, "none: a controller does not take this plan");
    else
        (void)snprintf(text, COST_TEXT, "%s: at most %lu instructions a sample (Cortex-M4F), for %.3g MHz and more",
                       laws, (unsigned long)bound, least_core_MHz(file, bound));
}

static void hex_of(const uint8_t bytes[], size_t n, char text[])
{
    for (size_t i = 0; i < n; i++)
        (void)snprintf(text + 2 * i, 3, "%02x", bytes[i]);
}

static int observed_blocks(const struct beam_image_file *file)
{
    return __builtin_popcount(file->front.observer.blocks);
}

static void put_owner(struct json *root, const struct beam_image_file *file)
{
    const struct beam_image_header *h = &file->front.header;
    char device[DEVICE_ID_TEXT], sha[65];
    device_id_print(h->device, device);
    hex_of(h->model_sha256, sizeof h->model_sha256, sha);
    json_put_number(root, "bytes", (double)BEAM_IMAGE_BYTES);
    json_put_number(root, "layout", (double)h->layout);
    json_put_bool(root, "signed", target_image_is_signed(file));
    json_put_text(root, "device", device);
    json_put_number(root, "counter", (double)h->counter);
    json_put_text(root, "model_sha256", sha);
    json_put_number(root, "crc32", (double)h->crc32);
}

static void put_board(struct json *root, const struct beam_image_file *file)
{
    const struct beam_image_setup *s = &file->front.setup;
    struct json *board = json_put(root, "board", json_new_object());
    json_put_number(board, "dt_s", (double)file->numbers.dt_s);
    json_put_number(board, "sample_Hz", (1.0 + (double)s->clock_relative) / (double)file->numbers.dt_s);
    json_put_number(board, "clock_relative", (double)s->clock_relative);
    json_put_number(board, "sensor_per_code", (double)s->sensor_V_per_code);
    json_put_number(board, "sensor_zero_code", (double)s->sensor_zero_code);
    json_put_number(board, "drive_per_code", (double)s->drive_V_per_code);
    json_put_number(board, "drive_zero_code", (double)s->drive_zero_code);
    json_put_number(board, "noise_rms", (double)s->noise_rms);
    json_put_number(board, "alarm_ratio", (double)s->alarm_ratio);
    json_put_number(board, "clear_ratio", (double)s->clear_ratio);
    json_put_number(board, "averaging_s", (double)s->averaging_s);
    json_put_number(board, "quiet_ratio", (double)s->quiet_ratio);
    json_put_number(board, "offset_ratio", (double)s->offset_ratio);
    json_put_number(board, "stuck_samples", (double)s->stuck_samples);
}

static void put_observer(struct json *root, const struct beam_image_file *file)
{
    const struct beam_image_observer *o = &file->front.observer;
    struct json *observer = json_put(root, "observer", json_new_object());
    json_put_number(observer, "modes", (double)observed_blocks(file));
    json_put_number(observer, "innovation_rms", (double)o->innovation_rms);
    json_put_number(observer, "disturbance_s", (double)o->disturbance_s);
}

static void put_tracking(struct json *root, const struct beam_image_file *file)
{
    struct json *tracking = json_put(root, "tracking", json_new_object());
    json_put_number(tracking, "modes", (double)__builtin_popcount(file->front.tracking.blocks));
    json_put_number(tracking, "wander_s", (double)file->front.tracking.wander_s);
}

static void put_plan(struct json *root, const struct beam_image_file *file)
{
    char cost[COST_TEXT];
    describe_cost(file, cost);
    const uint32_t bound = target_image_bound(file);
    json_put_text(root, "step", cost);
    json_put_number(root, "step_bound", (double)bound);
    json_put_number(root, "least_core_MHz", bound > 0 ? least_core_MHz(file, bound) : (double)NAN);
    json_put_number(root, "law_evaluations", file->counts.n_ports > 0 ? (double)file->counts.law_evaluations : 0.0);
    struct json *uses = json_put(root, "uses", json_new_array());
    for (int u = 0; u < least(file->counts.n_uses, BEAM_USES); u++) {
        struct json *use = json_push(uses, json_new_object());
        json_put_text(use, "effect", effect_name(file->front.use[u].effect));
        struct json *p = json_put(use, "parameters", json_new_array());
        for (int i = 0; i < BEAM_EFFECT_PARAMETERS; i++)
            json_push_number(p, (double)file->front.use[u].p[i]);
    }
    struct json *poles = json_put(root, "poles", json_new_array());
    for (int b = 0; b < least(file->counts.n_blocks, BEAM_BLOCKS); b++) {
        const double complex pole = block_pole(file, b);
        if (!oscillates(pole))
            continue;
        struct json *one = json_push(poles, json_new_object());
        json_put_number(one, "frequency_Hz", cabs(pole) / (2.0 * acos(-1.0)));
        json_put_number(one, "damping_ratio", -creal(pole) / cabs(pole));
    }
}

struct json *target_image_file_json(const struct beam_image_file *file)
{
    struct json *root = json_new_object();
    put_owner(root, file);
    put_board(root, file);
    put_observer(root, file);
    put_tracking(root, file);
    put_plan(root, file);
    return root;
}

struct json *target_image_json(const struct target_image *image)
{
    struct json *root = target_image_file_json(&image->file);
    json_put_text(root, "sensor", image->board.sensor);
    json_put_text(root, "drive", image->board.drive);
    json_put_text(root, "noise_from", image->noise_from);
    struct json *effects = json_put(root, "effects", json_new_array());
    for (size_t e = 0; e < image->n_effects; e++) {
        struct json *effect = json_push(effects, json_new_object());
        json_put_text(effect, "effect", image->effects[e].id);
        json_put_text(effect, "fate", image->effects[e].fate);
        json_put_bool(effect, "runs", image->effects[e].runs);
    }
    struct json *deployed = json_put(root, "deployed", json_new_object());
    json_put_number(deployed, "modes", (double)image->n_modes);
    json_put_number(deployed, "static_responses", (double)image->n_statics);
    json_put_bool(deployed, "band_is_wider", image->band_is_wider);
    struct json *frequency = json_put(deployed, "frequency_Hz", json_new_array());
    struct json *error = json_put(deployed, "relative_error", json_new_array());
    for (size_t k = 0; k < image->in_band && k < image->n_modes; k++) {
        json_push_number(frequency, image->frequency_Hz[k]);
        json_push_number(error, image->relative_error[k]);
    }
    json_put_number(deployed, "blocks_beside", (double)image->n_beside);
    json_put_number(deployed, "held_error", image->held_error);
    json_put_number(deployed, "float_error", image->float_error);
    json_put_number(deployed, "step_budget", (double)image->step_budget);
    json_put_number(deployed, "core_MHz", image->board.core_MHz);
    json_put_number(deployed, "unsolved_share", image->unsolved);
    struct json *notes = json_put(root, "notes", json_new_array());
    for (size_t i = 0; i < image->n_notes; i++)
        json_push_text(notes, image->notes[i]);
    return root;
}
