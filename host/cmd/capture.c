/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "capture.h"

#include <stdio.h>
#include <string.h>

/* ---- Beginning ---- */

enum bf_status capture_name(struct capture *c, const char *path, struct bf_error *err)
{
    struct model model;
    (void)snprintf(c->input, sizeof c->input, "drive_V");
    (void)snprintf(c->output, sizeof c->output, "piezo_V");
    if (path == NULL)
        return BF_OK;
    if (model_read(path, &model, err) != BF_OK)
        return err->status;
    const bool drive = model.board.present && model.board.drive[0] != '\0';
    const bool sensor = model.board.present && model.board.sensor[0] != '\0';
    if (drive || model.n_inputs > 0)
        (void)snprintf(c->input, sizeof c->input, "%s", drive ? model.board.drive : model.inputs[0].name);
    if (sensor || model.n_outputs > 0)
        (void)snprintf(c->output, sizeof c->output, "%s", sensor ? model.board.sensor : model.outputs[0].name);
    model_free(&model);
    return BF_OK;
}

static void take_live(void *context, const struct beam_live *live)
{
    struct capture *c = context;
    c->origin = live->sequence - live->step;
    c->newest = live->sequence;
    c->any = true;
    recording_add(&c->recording, live);
}

static enum bf_status learn(struct capture *c, const struct board_options *options, long prescale, struct bf_error *err)
{
    const struct beam_info *info = &c->link.info;
    const uint32_t at = BEAM_WIRE_IMAGE + offsetof(struct beam_image_file, counts.latency);
    beam_count latency;
    unsigned every;
    if (board_prescale(options, &c->link, prescale, &every, err) != BF_OK ||
        link_read_setup(&c->link, &c->setup, err) != BF_OK ||
        link_read(&c->link, "reading the model", at, sizeof latency, &latency, err) != BF_OK)
        return err->status;
    if (latency < 0 || latency >= BEAM_IMAGE_TAPS)
        return bf_fail(err, BF_DEVICE, "%s: the board's model says a latency of %ld samples, which no image has",
                       port_path(c->link.port), (long)latency);
    c->latency = latency;
    c->before = *info;
    recording_begin(&c->recording, 1e-3 * (double)info->sample_mHz, every);
    c->stream = (struct link_stream){.live = take_live, .context = c};
    device_id_print(info->device, c->device);
    for (size_t i = 0; i < sizeof info->model_sha256; i++)
        (void)snprintf(c->sha256 + 2 * i, 3, "%02x", info->model_sha256[i]);
    return BF_OK;
}

enum bf_status capture_open(struct capture *c, const struct board_options *options, long prescale, struct bf_error *err)
{
    if (board_open(options, &c->link, err) != BF_OK)
        return err->status;
    const enum bf_status status = learn(c, options, prescale, err);
    if (status != BF_OK)
        link_close(&c->link);
    return status;
}

void capture_close(struct capture *c)
{
    recording_free(&c->recording);
    link_close(&c->link);
}

enum bf_status capture_unlock(struct capture *c, const char *key_path, struct bf_error *err)
{
    struct device_key key;
    if (device_key_read(key_path, &key, err) != BF_OK)
        return err->status;
    const enum bf_status status = link_unlock(&c->link, &key, key_path, err);
    device_key_wipe(&key);
    return status;
}

/* ---- The stream ---- */

enum bf_status capture_start(struct capture *c, struct bf_error *err)
{
    return link_start_stream(&c->link, c->recording.prescale, &c->stream, err);
}

enum bf_status capture_stop(struct capture *c, struct bf_error *err)
{
    link_stop_stream(&c->link);
    return link_read_info(&c->link, err);
}

enum bf_status capture_until(struct capture *c, uint32_t sequence, struct progress *bar, uint32_t from,
                             struct bf_error *err)
{
    enum { SLICE_MS = 100, PATIENCE_MS = 8000 };
    int64_t heard_ms = port_clock_ms();
    uint64_t samples = c->stream.samples;
    while (!progress_interrupted() && (!c->any || (int32_t)(c->newest - sequence) < 0)) {
        if (link_run_stream(&c->link, SLICE_MS, err) != BF_OK)
            return err->status;
        if (c->stream.samples != samples) {
            samples = c->stream.samples;
            heard_ms = port_clock_ms();
        } else if (port_clock_ms() - heard_ms > PATIENCE_MS) {
            return bf_fail(
                err, BF_DEVICE,
                "%s: the board answers, but no sample arrives whole (%llu with a wrong CRC-32); check the line",
                port_path(c->link.port), (unsigned long long)c->stream.crc_failures);
        }
        if (c->any && bar != NULL && sequence != from)
            progress_update(bar, (double)(int32_t)(c->newest - from) / (double)(sequence - from), NULL);
    }
    return BF_OK;
}

/* Until the model has been put to rest after `origin`; the record begins there. */
static enum bf_status await_rest(struct capture *c, uint32_t origin, struct bf_error *err)
{
    enum { SAMPLES = 4000 };
    const uint32_t until = c->newest + SAMPLES;
    while (!progress_interrupted() && c->origin == origin && (int32_t)(c->newest - until) < 0)
        if (capture_until(c, c->newest + 1, NULL, 0, err) != BF_OK)
            return err->status;
    if (c->origin == origin && !progress_interrupted())
        return bf_fail(err, BF_DEVICE, "%s: the board did not put its model to rest; update the firmware",
                       port_path(c->link.port));
    recording_drop_before(&c->recording, c->origin);
    return BF_OK;
}

static enum bf_status settle(struct capture *c, double settle_s, struct bf_error *err)
{
    const uint32_t from = c->newest, samples = (uint32_t)(settle_s * c->recording.sample_Hz);
    struct progress *bar = progress_begin("settling");
    const enum bf_status status = capture_until(c, from + samples, bar, from, err);
    progress_end(bar);
    return status;
}

static enum bf_status from_rest(struct capture *c, const struct beam_drive *drive, double settle_s,
                                struct bf_error *err)
{
    struct beam_drive off = *drive, on = *drive;
    off.amplitude = 0.0F;
    off.flags = 0;
    on.flags = BEAM_DRIVE_REST;
    if (link_start_drive(&c->link, &off, err) != BF_OK || capture_until(c, c->newest, NULL, 0, err) != BF_OK ||
        settle(c, settle_s, err) != BF_OK)
        return err->status;
    const uint32_t origin = c->origin;
    if (!progress_interrupted() &&
        (link_start_drive(&c->link, &on, err) != BF_OK || await_rest(c, origin, err) != BF_OK))
        return err->status;
    if (progress_interrupted())
        return bf_fail(err, BF_DEVICE, "%s: interrupted before the recording began; nothing was written",
                       port_path(c->link.port));
    return BF_OK;
}

enum bf_status capture_from_rest(struct capture *c, const struct beam_drive *drive, double settle_s,
                                 struct bf_error *err)
{
    const enum bf_status status = from_rest(c, drive, settle_s, err);
    if (status != BF_OK)
        c->recording.n = 0;
    return status;
}
