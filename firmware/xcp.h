/* SPDX-License-Identifier: MIT */
/*
 * xcp.h — the XCP slave: one command in, one packet out. beam_wire.h lists commands, errors and the memory map.
 *
 * Silent until CONNECT, which stops DAQ and the drive and locks again. Reading and DAQ are open; everything that could change
 * the model, the store, the latch or the beam's motion needs UNLOCK with the device's key; after a wrong one the slave is silent until CONNECT. Nothing here waits: a page switch is answered when its
 * checks are done (xcp_events()), with EV_CMD_PENDING every 100 ms; other commands meanwhile are ERR_CMD_BUSY, SYNCH,
 * CONNECT and DISCONNECT give the switch up.
 */
#ifndef XCP_H
#define XCP_H

#include <stdbool.h>
#include <stdint.h>
#include "beam_wire.h"

struct app;

enum {
    XCP_NOTICE_BYTES = 8,        /* longest packet that is not a response in the command's buffer */
    XCP_DELAY_FIRST_US = 250000, /* after a wrong key, doubled with each further one */
    XCP_DELAY_LONGEST_US = 8000000,
    XCP_PENDING_US = 100000, /* EV_CMD_PENDING this often */
    XCP_TEXT = 0x00050000    /* address of the event's name, read only */
};

struct xcp {
    bool connected, unlocked, seeded, delayed, pending;
    bool pending_moves_xcp; /* the pending SET_CAL_PAGE is for XCP's access too */
    uint8_t page;           /* that UPLOAD and DOWNLOAD see */
    uint8_t seed[BEAM_XCP_SEED_BYTES];
    uint32_t seeds; /* given since power-on */
    uint32_t wrong_keys;
    uint32_t delay_us, delay_since_us;
    uint32_t pending_since_us;
    uint32_t heard_us; /* when the last command came */
    uint8_t mta_extension;
    uint32_t mta;
    uint8_t alloc;              /* DAQ: what was allocated last, enum in xcp_daq.c */
    uint8_t daq_odt, daq_entry; /* where WRITE_DAQ goes */
    bool daq_pointer;
};

/* One packet of n bytes (1..248), answered in place: length of the response, 0 when there is none (now). */
uint16_t xcp_command(struct app *app, uint16_t n, uint8_t packet[BEAM_WIRE_MAX_PACKET]);

/* What happened since: answers that were pending, events. Length of a packet, 0 when there is nothing. */
uint16_t xcp_events(struct app *app, uint8_t packet[XCP_NOTICE_BYTES]);

/* ---- Between the files of the slave ---- */

/* A handler reads its arguments before it writes a response over them. Returns its length, or xcp_error(). */
enum { XCP_NO_ANSWER = 0 };
static inline int xcp_error(int code)
{
    return -1 - code;
}

static inline uint16_t xcp_u16(const uint8_t bytes[])
{
    return (uint16_t)(bytes[0] | bytes[1] << 8);
}

static inline uint32_t xcp_u32(const uint8_t bytes[])
{
    return xcp_u16(bytes) | (uint32_t)xcp_u16(bytes + 2) << 16;
}

static inline void xcp_put(int n, uint32_t value, uint8_t out[])
{
    for (int i = 0; i < n; i++)
        out[i] = (uint8_t)(value >> 8 * i);
}

typedef int xcp_handler(struct app *app, uint16_t n, uint8_t packet[]);

struct xcp_command {
    uint8_t code, least; /* bytes of the packet */
    xcp_handler *handler;
};

/* Each file's commands, ended by handler 0. */
extern const struct xcp_command xcp_session_commands[], xcp_memory_commands[], xcp_daq_commands[];

/* A response of n bytes: RES, then zeros for the caller to fill in. Returns n. */
int xcp_response(int n, uint8_t packet[]);

#endif
