/* SPDX-License-Identifier: MIT */
/* Dispatch, session, seed and key, events. */
#include "app.h"
#include <string.h>

/* ---- Session ---- */

int xcp_response(int n, uint8_t packet[])
{
    memset(packet, 0, (size_t)n);
    packet[0] = BEAM_XCP_RES;
    return n;
}

static void leave(struct app *app)
{
    daq_stop(&app->daq);
    app_stop_drive(app);
    app->xcp.unlocked = app->xcp.seeded = app->xcp.daq_pointer = false;
    app->xcp.page = BEAM_WIRE_PAGE_ACTIVE;
    app->xcp.mta = 0;
    app->xcp.mta_extension = 0;
}

static int connect(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    leave(app);
    app->xcp.connected = true;
    app->told = 0; /* a new host is told what is on */
    xcp_response(8, packet);
    packet[1] = BEAM_XCP_RESOURCE_CAL_PAG | BEAM_XCP_RESOURCE_DAQ;
    packet[2] = 0x80; /* little-endian, bytes, no block mode, GET_COMM_MODE_INFO exists */
    packet[3] = BEAM_WIRE_MAX_PACKET;
    xcp_put(2, BEAM_WIRE_MAX_PACKET, packet + 4);
    packet[6] = packet[7] = 1; /* versions of protocol and transport */
    return 8;
}

static int disconnect(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    leave(app);
    app->xcp.connected = false;
    return xcp_response(1, packet);
}

static int get_status(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    xcp_response(6, packet);
    packet[1] = (uint8_t)((app->store.phase != STORE_IDLE ? 0x01 : 0) | (daq_running(&app->daq) ? 0x40 : 0));
    packet[2] = app->xcp.unlocked ? 0 : BEAM_XCP_RESOURCE_CAL_PAG;
    return 6;
}

static int synch(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)app, (void)n, (void)packet;
    return xcp_error(BEAM_XCP_ERR_CMD_SYNCH);
}

static int get_comm_mode_info(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)app, (void)n;
    xcp_response(8, packet);
    packet[7] = 0x01; /* version of this driver */
    return 8;
}

static int get_id(struct app *app, uint16_t n, uint8_t packet[])
{
    static const char name[] = "beamfit"; /* the A2L file's name, without ending */
    (void)app, (void)n;
    if (packet[1] > 1)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    xcp_response(8, packet);
    packet[1] = 1; /* the name is in the response */
    xcp_put(4, sizeof name - 1, packet + 4);
    memcpy(packet + 8, name, sizeof name - 1);
    return 8 + (int)sizeof name - 1;
}

static int set_request(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    if (packet[1] != 0x01) /* STORE_CAL */
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    if (!app->xcp.unlocked)
        return xcp_error(BEAM_XCP_ERR_ACCESS_LOCKED);
    if (app->store.phase != STORE_IDLE)
        return xcp_error(BEAM_XCP_ERR_CMD_BUSY);
    if (atomic_load(&app->running) == BEAM_BOOT_BUILT_IN)
        return xcp_error(BEAM_XCP_ERR_ACCESS_DENIED); /* it is in ROM */
    store_begin(&app->store, pages_active(&app->pages));
    return xcp_response(1, packet);
}

/* ---- Seed and key ---- */

/* Looked at in every turn, so that the clock's wrap does not matter. */
static void end_delay(struct xcp *xcp, uint32_t now_us)
{
    if (xcp->delayed && now_us - xcp->delay_since_us >= xcp->delay_us)
        xcp->delayed = false;
}

/* HMAC(session key, "seed" ‖ power-ons ‖ seeds): new each time because the store has counted this power-on. */
static void make_seed(struct app *app)
{
    struct authentic *a = &app->pages.scratch.authentic; /* free: no check is under way when a command is taken */
    uint8_t text[12] = {'s', 'e', 'e', 'd'}, code[AUTHENTIC_CODE_BYTES];
    xcp_put(4, app->store.boots, text + 4);
    xcp_put(4, app->xcp.seeds++, text + 8);
    authentic_begin(a, app->facts->session_key);
    authentic_feed(a, sizeof text, text);
    authentic_end(a, code);
    memcpy(app->xcp.seed, code, sizeof app->xcp.seed);
}

static int get_seed(struct app *app, uint16_t n, uint8_t packet[])
{
    struct xcp *xcp = &app->xcp;
    (void)n;
    const uint8_t mode = packet[1], resource = packet[2];
    if (mode > 1 || (resource != BEAM_XCP_RESOURCE_CAL_PAG && resource != BEAM_XCP_RESOURCE_DAQ))
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    if (mode == 1)
        return xcp_error(BEAM_XCP_ERR_SEQUENCE); /* a seed is never longer than a packet */
    if (resource == BEAM_XCP_RESOURCE_DAQ || xcp->unlocked)
        return xcp_response(2, packet); /* length 0: not locked */
    if (xcp->delayed)
        return xcp_error(BEAM_XCP_ERR_ACCESS_LOCKED);
    if (!app->store.counted)
        return xcp_error(BEAM_XCP_ERR_GENERIC); /* the store is broken, and the seed would not be new */
    make_seed(app);
    xcp->seeded = true;
    xcp_response(2 + BEAM_XCP_SEED_BYTES, packet);
    packet[1] = BEAM_XCP_SEED_BYTES;
    memcpy(packet + 2, xcp->seed, BEAM_XCP_SEED_BYTES);
    return 2 + BEAM_XCP_SEED_BYTES;
}

/* As XCP says: the slave is DISCONNECTED after a wrong key. The wait goes on over a further CONNECT. */
static int refuse_key(struct app *app)
{
    struct xcp *xcp = &app->xcp;
    xcp->wrong_keys++;
    xcp->delay_us = xcp->delay_us == 0 ? XCP_DELAY_FIRST_US : 2 * xcp->delay_us;
    if (xcp->delay_us > XCP_DELAY_LONGEST_US)
        xcp->delay_us = XCP_DELAY_LONGEST_US;
    xcp->delayed = true;
    xcp->delay_since_us = board_time_us();
    leave(app);
    xcp->connected = false;
    return xcp_error(BEAM_XCP_ERR_ACCESS_LOCKED);
}

static int unlock(struct app *app, uint16_t n, uint8_t packet[])
{
    struct xcp *xcp = &app->xcp;
    struct authentic *a = &app->pages.scratch.authentic;
    const uint8_t resource = BEAM_XCP_RESOURCE_CAL_PAG;
    uint8_t code[AUTHENTIC_CODE_BYTES];
    if (!xcp->seeded)
        return xcp_error(BEAM_XCP_ERR_SEQUENCE);
    xcp->seeded = false; /* one try a seed */
    if (n < 2 + BEAM_XCP_KEY_BYTES || packet[1] != BEAM_XCP_KEY_BYTES)
        return refuse_key(app);
    authentic_begin(a, app->facts->session_key);
    authentic_feed(a, 1, &resource);
    authentic_feed(a, sizeof xcp->seed, xcp->seed);
    authentic_end(a, code);
    const bool right = authentic_equal(BEAM_XCP_KEY_BYTES, code, packet + 2);
    authentic_wipe(sizeof code, code);
    if (!right)
        return refuse_key(app);
    xcp->unlocked = true;
    xcp->delay_us = 0;
    return xcp_response(2, packet); /* nothing is locked any more */
}

const struct xcp_command xcp_session_commands[] = {
    {BEAM_XCP_CONNECT, 2, connect},
    {BEAM_XCP_DISCONNECT, 1, disconnect},
    {BEAM_XCP_GET_STATUS, 1, get_status},
    {BEAM_XCP_SYNCH, 1, synch},
    {BEAM_XCP_GET_COMM_MODE_INFO, 1, get_comm_mode_info},
    {BEAM_XCP_GET_ID, 2, get_id},
    {BEAM_XCP_SET_REQUEST, 4, set_request},
    {BEAM_XCP_GET_SEED, 3, get_seed},
    {BEAM_XCP_UNLOCK, 3, unlock},
    {0, 0, 0},
};

/* ---- Dispatch ---- */

static const struct xcp_command *find(uint8_t code)
{
    const struct xcp_command *const tables[] = {xcp_session_commands, xcp_memory_commands, xcp_daq_commands};
    for (int t = 0; t < 3; t++)
        for (const struct xcp_command *c = tables[t]; c->handler; c++)
            if (c->code == code)
                return c;
    return 0;
}

/* While a page is checked: may this command go on? Else *answer is what it gets. */
static bool passes_pending(struct app *app, uint8_t code, int *answer)
{
    if (!app->xcp.pending)
        return true;
    if (code == BEAM_XCP_SYNCH || code == BEAM_XCP_CONNECT || code == BEAM_XCP_DISCONNECT) {
        pages_abandon(&app->pages);
        app->xcp.pending = false;
        return true;
    }
    *answer = code == BEAM_XCP_SET_CAL_PAGE ? XCP_NO_ANSWER : xcp_error(BEAM_XCP_ERR_CMD_BUSY); /* asked again: later */
    return false;
}

uint16_t xcp_command(struct app *app, uint16_t n, uint8_t packet[BEAM_WIRE_MAX_PACKET])
{
    struct xcp *xcp = &app->xcp;
    const uint8_t code = packet[0];
    const struct xcp_command *command = find(code);
    int answer = xcp_error(command ? BEAM_XCP_ERR_CMD_SYNTAX : BEAM_XCP_ERR_CMD_UNKNOWN);
    if (!xcp->connected && code != BEAM_XCP_CONNECT)
        return 0;
    xcp->heard_us = board_time_us();
    end_delay(xcp, xcp->heard_us);
    if (command && n >= command->least && passes_pending(app, code, &answer))
        answer = command->handler(app, n, packet);
    if (answer >= 0)
        return (uint16_t)answer;
    packet[0] = BEAM_XCP_ERR;
    packet[1] = (uint8_t)(-1 - answer);
    return 2;
}

/* ---- Events ---- */

enum { EV_STORE_CAL = 0x03, EV_CMD_PENDING = 0x05, EV_USER = 0xFE };

static uint16_t event(uint8_t code, uint8_t packet[])
{
    packet[0] = BEAM_XCP_EV;
    packet[1] = code;
    return 2;
}

static uint16_t user_event(uint8_t kind, uint32_t value, uint8_t packet[XCP_NOTICE_BYTES])
{
    event(EV_USER, packet);
    packet[2] = kind;
    packet[3] = 0;
    xcp_put(4, value, packet + 4);
    return 8;
}

/* A session that drives and then says nothing is over, as far as the drive goes. */
static void mind_the_drive(struct app *app, uint32_t now_us)
{
    if (now_us - app->xcp.heard_us >= 1000u * BEAM_DRIVE_DEAD_MAN_MS) {
        app_stop_drive(app);
        app->xcp.heard_us = now_us - 1000u * BEAM_DRIVE_DEAD_MAN_MS; /* so that the clock's wrap does not matter */
    }
}

uint16_t xcp_events(struct app *app, uint8_t packet[XCP_NOTICE_BYTES])
{
    struct xcp *xcp = &app->xcp;
    const uint32_t now_us = board_time_us();
    end_delay(xcp, now_us);
    mind_the_drive(app, now_us);
    const enum store_answer stored = store_poll(&app->store);
    if (stored != STORE_NOTHING && xcp->connected)
        return stored == STORE_DONE ? event(EV_STORE_CAL, packet) : user_event(BEAM_EVENT_STORE_FAILED, 0, packet);
    const uint32_t alarms = atomic_load(&app->latch.now);
    if (xcp->connected && alarms != app->told) {
        app->told = alarms;
        return user_event(BEAM_EVENT_ALARM, alarms, packet);
    }
    const enum pages_answer switched = pages_poll(&app->pages);
    if (switched == PAGES_NOTHING || !xcp->pending) {
        if (!xcp->pending || now_us - xcp->pending_since_us < XCP_PENDING_US)
            return 0;
        xcp->pending_since_us = now_us;
        return event(EV_CMD_PENDING, packet);
    }
    xcp->pending = false;
    if (switched == PAGES_SWITCHED) {
        if (xcp->pending_moves_xcp)
            xcp->page = BEAM_WIRE_PAGE_ACTIVE; /* where that image is now */
        return (uint16_t)xcp_response(1, packet);
    }
    packet[0] = BEAM_XCP_ERR;
    packet[1] = BEAM_XCP_ERR_PAGE_NOT_VALID;
    return 2;
}
