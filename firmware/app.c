/* SPDX-License-Identifier: MIT */
/* Boot, sample interrupt, background loop. */
#include "app.h"
#include "built_in.h"
#include "resets.h"

#ifdef __arm__
_Static_assert(sizeof(struct app) <= 14000, "RAM: 16 kB with both stacks");
#endif

/* ---- Boot ---- */

static void load_built_in(struct app *app)
{
    struct beam_image *image = &app->pages.page[0];
    beam_image_write(image, 0, BEAM_IMAGE_BYTES, built_in_image);
    const enum beam_image_fault fault = beam_image_check(image, app->pages.dt_s);
    if (fault != BEAM_IMAGE_FINE) /* another sample rate than the built-in model's: it runs, and info says so */
        app->pages.fault = (uint8_t)fault;
    atomic_store(&app->pages.active, 0);
    atomic_store(&app->running, BEAM_BOOT_BUILT_IN);
}

/* Slot s is read into memory s; the newest image that passes everything runs from there. */
static void choose_image(struct app *app)
{
    int chosen = -1;
    for (int slot = 0; slot < 2; slot++) {
        if (app->store.slot[slot] != STORE_VALID)
            continue;
        enum beam_image_fault fault = BEAM_IMAGE_BAD_CRC;
        if (store_load(&app->store, slot, &app->pages.page[slot]))
            fault = pages_boot_check(&app->pages, slot);
        store_authentic(&app->store, slot, fault == BEAM_IMAGE_FINE || fault > BEAM_IMAGE_BAD_CODE);
        if (fault != BEAM_IMAGE_FINE) {
            app->pages.fault = (uint8_t)fault;
            app->pages.refused++;
        } else if (chosen < 0 || app->store.counter[slot] > app->store.counter[chosen]) {
            chosen = slot;
        }
    }
    if (chosen < 0) {
        load_built_in(app);
        return;
    }
    atomic_store(&app->pages.active, (uint8_t)chosen);
    atomic_store(&app->running, (uint8_t)(BEAM_BOOT_SLOT_0 + chosen));
}

void app_init(struct app *app, const struct board_facts *facts)
{
    *app = (struct app){.facts = facts};
    resets_count(facts);
    pages_init(&app->pages, facts);
    store_open(&app->store, facts);
    choose_image(app);
    store_prepare(&app->store);
    sampler_rest(&app->sampler, pages_active(&app->pages));
    drive_start(&app->drive, &app->drive_bytes, facts->drive_code_zero);
    app->drive_code = drive_next(&app->drive);
}

/* ---- Sample interrupt ---- */

static uint32_t status_of_image(const struct app *app, const struct beam_image *image)
{
    const uint32_t counter = image->front.header.counter & 0xFFu;
    return counter << BEAM_LIVE_COUNTER | (atomic_load(&app->running) == BEAM_BOOT_BUILT_IN ? BEAM_LIVE_BUILT_IN : 0u);
}

/* What begins with the next sample: another model, another drive. */
static void change(struct app *app)
{
    if (pages_tick(&app->pages)) {
        atomic_store(&app->running, BEAM_BOOT_DOWNLOADED);
        sampler_rest(&app->sampler, pages_active(&app->pages));
    }
    if (atomic_load(&app->drive_pending)) {
        drive_start(&app->drive, &app->drive_bytes, app->facts->drive_code_zero);
        if (app->drive_bytes.flags & BEAM_DRIVE_REST)
            sampler_rest(&app->sampler, pages_active(&app->pages));
        atomic_store(&app->drive_pending, false);
    }
    if (atomic_load(&app->drive_stop)) {
        static const struct beam_drive off;
        drive_start(&app->drive, &off, app->facts->drive_code_zero);
        atomic_store(&app->drive_stop, false);
    }
}

/* Counts what came with this sample, and says at the pin whether something is wrong. */
static void latch(struct app *app, const struct beam_live *live)
{
    struct app_latch *l = &app->latch;
    const uint32_t now = live->status & (BEAM_LIVE_ALARM | BEAM_LIVE_SENSOR), before = atomic_load(&l->now);
    if (atomic_exchange(&l->acknowledge, false)) {
        atomic_store(&l->bits, 0);
        atomic_store(&l->alarms, 0);
        atomic_store(&l->faults, 0);
        atomic_store(&l->first, 0);
        atomic_store(&l->last, 0);
    }
    const uint32_t came = atomic_load(&l->bits) == 0 ? now : now & ~before;
    if (came != 0) {
        atomic_store(&l->first, atomic_load(&l->bits) == 0 ? live->sequence : atomic_load(&l->first));
        atomic_store(&l->last, live->sequence);
        atomic_fetch_add(&l->alarms, came & BEAM_LIVE_ALARM ? 1u : 0u);
        atomic_fetch_add(&l->faults, came & BEAM_LIVE_SENSOR ? 1u : 0u);
        atomic_fetch_or(&l->bits, came);
    }
    if ((now != 0) != (before != 0))
        board_alarm(now != 0);
    atomic_store(&l->now, now);
}

/* Returns when it began. Apart from the proof run, whose stack would stand on this function's. */
static __attribute__((noinline)) uint32_t sample(struct app *app, uint16_t sensor_code)
{
    board_drive(app->drive_code); /* first, so that it comes at the same time after each tick */
    const uint32_t tick_us = board_time_us();
    const struct beam_image *image = pages_active(&app->pages);
    struct beam_live *live = &app->latest;
    const uint32_t missed = atomic_load(&app->missed);
    app->sampler.sequence +=
        missed - app->missed_before; /* so that the sequence is the time, and what is missing is seen */
    app->missed_before = missed;
    sampler_step(&app->sampler, image, sensor_code, app->drive_code, app->facts->sensor_code_max, live);
    live->status |= status_of_image(app, image);
    latch(app, live);
    daq_sample(&app->daq, live, tick_us);
    atomic_fetch_add(&app->published, 1);
    change(app);
    app->drive_code = drive_next(&app->drive);
    const uint32_t spent_us = board_time_us() - tick_us;
    if (spent_us > atomic_load(&app->worst_us))
        atomic_store(&app->worst_us, spent_us);
    return tick_us;
}

void app_tick(struct app *app, uint16_t sensor_code)
{
    pages_prove(&app->pages, sample(app, sensor_code));
}

/* ---- Background loop ---- */

/* The amplitude goes last: a start that the interrupt may find pending meanwhile is ended by the stop in the same sample. */
void app_stop_drive(struct app *app)
{
    if (!app->driving)
        return;
    app->driving = false;
    atomic_store(&app->drive_stop, true);
    app->drive_bytes.amplitude = 0.0F;
    app->drive_stops++;
}

/* The next frame: a response, a notice, a sample. False: nothing to send. */
static bool choose_frame(struct app *app)
{
    struct app_line *line = &app->line;
    uint8_t *bytes = app->receiver.frame;
    uint16_t n = line->response;
    line->frame_is_response = n > 0;
    if (n == 0 && line->notice > 0) {
        bytes = line->notice_frame;
        n = line->notice;
        line->notice = 0;
    } else if (n == 0) {
        bytes = app->daq.frame;
        n = daq_next(&app->daq);
    }
    if (n == 0)
        return false;
    line->frame = (struct sxi_frame){bytes, sxi_close(bytes, n, line->counter++), 0};
    return true;
}

/* False: nothing is on its way. */
static bool send(struct app *app)
{
    struct app_line *line = &app->line;
    struct sxi_frame *frame = &line->frame;
    if (frame->sent == frame->n && !choose_frame(app))
        return false;
    frame->sent = (uint16_t)(frame->sent + board_send((size_t)(frame->n - frame->sent), frame->bytes + frame->sent));
    if (frame->sent == frame->n && line->frame_is_response) {
        line->response = 0;
        line->frame_is_response = false;
        sxi_restart(&app->receiver);
    }
    return true;
}

/* False: nothing came. */
static bool receive(struct app *app)
{
    struct sxi_receiver *receiver = &app->receiver;
    const uint32_t now_us = board_time_us();
    uint8_t *where;
    if (app->line.response > 0) /* the buffer is taken */
        return false;
    sxi_expire(receiver, now_us);
    const size_t wanted = sxi_wanted(receiver, &where), n = board_receive(wanted, where);
    if (n == 0)
        return false;
    const uint16_t length = sxi_received(receiver, n, now_us);
    if (length > 0) {
        app->line.response = xcp_command(app, length, receiver->frame + BEAM_WIRE_HEADER);
        if (app->line.response == 0)
            sxi_restart(receiver);
    }
    return true;
}

/* Both contexts have to go on for the board's watchdog to hear of it. */
static void show_life(struct app *app)
{
    const uint32_t published = atomic_load(&app->published);
    if (published == app->seen)
        return;
    app->seen = published;
    board_alive();
}

bool app_poll(struct app *app)
{
    struct app_line *line = &app->line;
    show_life(app);
    const bool sending = send(app), received = receive(app);
    const bool notice_is_free = line->notice == 0 && (line->frame.bytes != line->notice_frame || !sending);
    if (notice_is_free)
        line->notice = xcp_events(app, line->notice_frame + BEAM_WIRE_HEADER);
    return sending || received || line->notice > 0 || app->store.phase != STORE_IDLE || app->pages.phase != PAGES_IDLE;
}
