/* SPDX-License-Identifier: MIT */
/*
 * app.h — the application: everything it owns in one struct, its two contexts.
 *
 *     app_init()       boot: slots, power-on count, newest valid image or the built-in one
 *     app_tick()       sample interrupt: drive out → step → live sample → DAQ → switch of model or drive
 *     app_poll()       one turn of the background loop: frame out, bytes in, command, slice of a check or a store
 *
 * The only data both touch: pages.active/wanted/proof, drive_pending, drive_stop, latch, daq.written/taken, latest/published, counters.
 */
#ifndef APP_H
#define APP_H

#include "board.h"
#include "daq.h"
#include "drive.h"
#include "pages.h"
#include "sampler.h"
#include "store.h"
#include "sxi.h"
#include "xcp.h"

enum { APP_VERSION = 0 << 16 | 1 << 8 | 0 }; /* major, minor, patch */

/* The line's sending side: one frame at a time; response before notice before DAQ. */
struct app_line {
    struct sxi_frame frame;
    bool frame_is_response;
    uint16_t counter, response, notice; /* lengths of packets that wait, 0: none */
    uint8_t notice_frame[BEAM_WIRE_HEADER + XCP_NOTICE_BYTES + BEAM_WIRE_TAIL];
};

/* What came and is not forgotten when a session begins or ends; written by the sample interrupt. */
struct app_latch {
    _Atomic uint32_t now, bits; /* ALARM and SENSOR bits of the newest sample; all that came */
    _Atomic uint32_t alarms, faults, first, last;
    _Atomic bool acknowledge; /* asked for by the background: begins anew with the next sample */
};

struct app {
    const struct board_facts *facts;
    struct pages pages;
    struct store store;
    struct sampler sampler;
    struct drive drive;
    struct daq daq;
    struct sxi_receiver receiver;
    struct app_line line;
    struct xcp xcp;
    struct beam_drive drive_bytes; /* as the host wrote them */
    _Atomic bool drive_pending;    /* they start with the next sample, and are not written meanwhile */
    _Atomic bool drive_stop;       /* the drive ends with the next sample */
    bool driving;                  /* a drive was started and not ended; drive_bytes may already be the next one's */
    uint32_t drive_stops;          /* by the end of a session or its silence */
    struct app_latch latch;
    uint32_t told;              /* latch.now that the last event said */
    uint16_t drive_code;        /* for the next tick */
    struct beam_live latest;    /* without its CRC */
    _Atomic uint32_t published; /* samples that were written to latest */
    uint32_t seen;              /* of them by the background when it last showed life */
    _Atomic uint8_t running;    /* enum beam_boot_choice */
    _Atomic uint32_t missed, worst_us;
    uint32_t missed_before; /* of `missed`, what the sequence has counted; the interrupt's */
};

/* Background, before board_start(). */
void app_init(struct app *app, const struct board_facts *facts);

/* Sample interrupt. Cost: docs/target.md. */
void app_tick(struct app *app, uint16_t sensor_code);

/*
 * Background; one turn, never waits: at most one slice of a check or a store, one command, one frame. At least once in
 * 50 ms, so that gaps are seen. True when there is more to do at once.
 */
bool app_poll(struct app *app);

/* The drive ends, when there is one: its session does. Background. */
void app_stop_drive(struct app *app);

/* ---- The memory map, for the slave; background ---- */

/* n bytes at an address; 0, or the code of an XCP error. */
int app_read(struct app *app, uint32_t address, uint32_t n, uint8_t out[]);
int app_write(struct app *app, uint32_t address, uint32_t n, const uint8_t in[]);

#endif
