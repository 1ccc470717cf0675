/* SPDX-License-Identifier: MIT */
/* The memory map of beam_wire.h. */
#include "app.h"
#include "resets.h"
#include "track.h"
#include <string.h>

static const char event_name[] = "sample";

/* Is [address, address + n) inside the region of this many bytes? */
static bool inside(uint32_t address, uint32_t n, uint32_t begin, uint32_t bytes, uint32_t *offset)
{
    *offset = address - begin;
    return address >= begin && *offset <= bytes && n <= bytes - *offset;
}

/* The sample interrupt may come between two bytes: then it is read again. */
static void read_live(const struct app *app, struct beam_live *out)
{
    for (int tries = 0; tries < 4; tries++) {
        const uint32_t before = atomic_load(&app->published);
        *out = app->latest;
        atomic_signal_fence(memory_order_seq_cst);
        if (atomic_load(&app->published) == before)
            break;
    }
    out->crc32 = beam_crc32(0, offsetof(struct beam_live, crc32), (const uint8_t *)out);
}

/* The sample interrupt may come meanwhile: then it is read again. */
static void read_tracking(struct app *app, struct beam_tracking *out)
{
    for (int tries = 0; tries < 4; tries++) {
        const uint32_t before = atomic_load(&app->published);
        const struct beam_image *image = pages_active(&app->pages);
        track_report(image, track_of(image, &app->sampler.state), out);
        atomic_signal_fence(memory_order_seq_cst);
        if (atomic_load(&app->published) == before)
            break;
    }
}

static void fill_info(const struct app *app, struct beam_info *out)
{
    const struct beam_image_header *header = &pages_active(&app->pages)->front.header;
    *out = (struct beam_info){
        .firmware_version = APP_VERSION,
        .image_layout = BEAM_IMAGE_LAYOUT,
        .image_bytes = BEAM_IMAGE_BYTES,
        .sample_mHz = app->facts->sample_mHz,
        .running = atomic_load(&app->running),
        .counter = header->counter,
        .stored = app->store.stored,
        .missed = atomic_load(&app->missed),
        .overrun = atomic_load(&app->daq.overrun),
        .frames_bad = app->receiver.bad,
        .wrong_keys = app->xcp.wrong_keys,
        .refused = app->pages.refused,
        .last_fault = app->pages.fault,
        .slot_state = {app->store.slot[0], app->store.slot[1]},
        .boots = app->store.boots,
        .nvm_errors = app->store.errors,
        .worst_step_us = atomic_load(&app->worst_us),
        .core_Hz = app->facts->core_Hz,
        .step_budget = beam_image_budget(app->facts->core_Hz, app->facts->sample_mHz),
        .step_bound = beam_image_bound(pages_active(&app->pages)),
        .proof_us = pages_longest_us(&app->pages),
        .sequence = app->latest.sequence,
        .latched = atomic_load(&app->latch.bits),
        .alarms = atomic_load(&app->latch.alarms),
        .faults = atomic_load(&app->latch.faults),
        .latch_first = atomic_load(&app->latch.first),
        .latch_last = atomic_load(&app->latch.last),
        .drive_stops = app->drive_stops,
        .reset = app->facts->reset,
    };
    resets_read(app->facts, out->resets);
    memcpy(out->device, app->facts->device, sizeof out->device);
    memcpy(out->model_sha256, header->model_sha256, sizeof out->model_sha256);
}

/* Each with its copy on a stack of its own, so that the largest does not lie below the deepest. */
static __attribute__((noinline)) void copy_live(const struct app *app, uint32_t offset, uint32_t n, uint8_t out[])
{
    struct beam_live live;
    read_live(app, &live);
    memcpy(out, (const uint8_t *)&live + offset, n);
}

static __attribute__((noinline)) void copy_info(const struct app *app, uint32_t offset, uint32_t n, uint8_t out[])
{
    struct beam_info info;
    fill_info(app, &info);
    memcpy(out, (const uint8_t *)&info + offset, n);
}

static __attribute__((noinline)) void copy_tracking(struct app *app, uint32_t offset, uint32_t n, uint8_t out[])
{
    struct beam_tracking tracking;
    read_tracking(app, &tracking);
    memcpy(out, (const uint8_t *)&tracking + offset, n);
}

int app_read(struct app *app, uint32_t address, uint32_t n, uint8_t out[])
{
    uint32_t offset;
    if (inside(address, n, BEAM_WIRE_IMAGE, BEAM_IMAGE_BYTES, &offset)) {
        const bool active = app->xcp.page == BEAM_WIRE_PAGE_ACTIVE;
        beam_image_read(active ? pages_active(&app->pages) : pages_staging(&app->pages), offset, n, out);
        return 0;
    }
    if (inside(address, n, BEAM_WIRE_LIVE, sizeof(struct beam_live), &offset)) {
        copy_live(app, offset, n, out);
        return 0;
    }
    if (inside(address, n, BEAM_WIRE_INFO, sizeof(struct beam_info), &offset)) {
        copy_info(app, offset, n, out);
        return 0;
    }
    if (inside(address, n, BEAM_WIRE_TRACKING, sizeof(struct beam_tracking), &offset)) {
        copy_tracking(app, offset, n, out);
        return 0;
    }
    if (inside(address, n, BEAM_WIRE_DRIVE, sizeof(struct beam_drive), &offset)) {
        memcpy(out, (const uint8_t *)&app->drive_bytes + offset, n);
        return 0;
    }
    if (inside(address, n, BEAM_WIRE_LATCH, sizeof(uint32_t), &offset)) {
        const uint32_t bits = atomic_load(&app->latch.bits);
        memcpy(out, (const uint8_t *)&bits + offset, n);
        return 0;
    }
    if (inside(address, n, XCP_TEXT, sizeof event_name - 1, &offset)) {
        memcpy(out, event_name + offset, n);
        return 0;
    }
    return BEAM_XCP_ERR_ACCESS_DENIED;
}

/* The bytes are kept; with the last one of `generation` the whole setting starts, or nothing is changed. */
static int write_drive(struct app *app, uint32_t offset, uint32_t n, const uint8_t in[])
{
    struct beam_drive setting = app->drive_bytes;
    const uint32_t generation = setting.generation;
    if (!app->xcp.unlocked)
        return BEAM_XCP_ERR_ACCESS_LOCKED;
    if (atomic_load(&app->drive_pending) || atomic_load(&app->drive_stop))
        return BEAM_XCP_ERR_CMD_BUSY; /* until the next sample */
    memcpy((uint8_t *)&setting + offset, in, n);
    const bool complete = offset + n == sizeof setting;
    if (complete && !drive_valid(&setting))
        return BEAM_XCP_ERR_OUT_OF_RANGE;
    app->drive_bytes = setting;
    if (complete && setting.generation != generation) {
        app->driving = setting.amplitude > 0.0F;
        atomic_store(&app->drive_pending, true);
    }
    return 0;
}

int app_write(struct app *app, uint32_t address, uint32_t n, const uint8_t in[])
{
    uint32_t offset;
    if (inside(address, n, BEAM_WIRE_DRIVE, sizeof(struct beam_drive), &offset))
        return write_drive(app, offset, n, in);
    if (inside(address, n, BEAM_WIRE_LATCH, sizeof(uint32_t), &offset)) {
        atomic_store(&app->latch.acknowledge, app->xcp.unlocked);
        return app->xcp.unlocked ? 0 : BEAM_XCP_ERR_ACCESS_LOCKED;
    }
    if (inside(address, n, BEAM_WIRE_LIVE, sizeof(struct beam_live), &offset) ||
        inside(address, n, BEAM_WIRE_INFO, sizeof(struct beam_info), &offset) ||
        inside(address, n, BEAM_WIRE_TRACKING, sizeof(struct beam_tracking), &offset))
        return BEAM_XCP_ERR_WRITE_PROTECTED;
    if (!inside(address, n, BEAM_WIRE_IMAGE, BEAM_IMAGE_BYTES, &offset))
        return BEAM_XCP_ERR_ACCESS_DENIED;
    if (app->xcp.page != BEAM_WIRE_PAGE_STAGING)
        return BEAM_XCP_ERR_WRITE_PROTECTED;
    if (!app->xcp.unlocked)
        return BEAM_XCP_ERR_ACCESS_LOCKED;
    beam_image_write(pages_staging(&app->pages), offset, n, in);
    return 0;
}
