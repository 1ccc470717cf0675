/* SPDX-License-Identifier: MIT */
/* DAQ commands: dynamic allocation, one event, absolute ODT numbers, time stamps of 1 µs. */
#include "app.h"

enum { FREED = 0, LISTS, ODTS, ENTRIES }; /* what was allocated last; xcp.alloc */
enum { MODE_TIMESTAMP = 0x10, STOP = 0, START = 1, SELECT = 2 };

/* ---- What there is ---- */

static int get_daq_clock(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)app, (void)n;
    xcp_response(8, packet);
    xcp_put(4, board_time_us(), packet + 4);
    return 8;
}

static int get_daq_processor_info(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)app, (void)n;
    xcp_response(8, packet);
    packet[1] = 0x01 | 0x02 | 0x10; /* dynamic lists, prescaler, time stamps */
    xcp_put(2, BEAM_DAQ_LISTS, packet + 2);
    xcp_put(2, BEAM_DAQ_EVENTS, packet + 4);
    return 8; /* no fixed list; absolute ODT numbers */
}

static int get_daq_resolution_info(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)app, (void)n;
    xcp_response(8, packet);
    packet[1] = 1; /* an entry is whole bytes, */
    packet[2] = sizeof(struct beam_live);
    packet[5] = 0x04 | 3 << 4; /* time stamps: 4 bytes, unit 1 µs, */
    xcp_put(2, 1, packet + 6); /* 1 unit a tick */
    return 8;
}

/* The sample's interval as cycle × unit, rounded: XCP has a byte for the first and powers of ten from 1 ns. */
static int get_daq_event_info(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    if (xcp_u16(packet + 2) >= BEAM_DAQ_EVENTS)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    uint32_t cycle_us = 1000000000u / app->facts->sample_mHz;
    uint8_t unit = 3; /* 1 µs */
    while (cycle_us > 255) {
        cycle_us = (cycle_us + 5) / 10;
        unit++;
    }
    xcp_response(7, packet);
    packet[1] = 0x04; /* DAQ, not stimulation */
    packet[2] = BEAM_DAQ_LISTS;
    packet[3] = sizeof "sample" - 1;
    packet[4] = (uint8_t)cycle_us;
    packet[5] = unit;
    app->xcp.mta = XCP_TEXT; /* the name is uploaded from here */
    app->xcp.mta_extension = 0;
    return 7;
}

/* ---- Allocation: free, lists, ODTs, entries, in this order ---- */

static int free_daq(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    daq_free(&app->daq);
    app->xcp.alloc = FREED;
    app->xcp.daq_pointer = false;
    return xcp_response(1, packet);
}

static int alloc_daq(struct app *app, uint16_t n, uint8_t packet[])
{
    const uint16_t count = xcp_u16(packet + 2);
    (void)n;
    if (app->xcp.alloc != FREED)
        return xcp_error(BEAM_XCP_ERR_SEQUENCE);
    if (count > BEAM_DAQ_LISTS)
        return xcp_error(BEAM_XCP_ERR_MEMORY_OVERFLOW);
    app->daq.n_lists = (uint8_t)count;
    app->xcp.alloc = LISTS;
    return xcp_response(1, packet);
}

static int alloc_odt(struct app *app, uint16_t n, uint8_t packet[])
{
    struct daq *daq = &app->daq;
    const uint16_t list = xcp_u16(packet + 2);
    const uint8_t count = packet[4];
    (void)n;
    if (app->xcp.alloc != LISTS && app->xcp.alloc != ODTS)
        return xcp_error(BEAM_XCP_ERR_SEQUENCE);
    if (list >= daq->n_lists)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    if (daq->list[list].n_odts != 0)
        return xcp_error(BEAM_XCP_ERR_SEQUENCE);
    if (count > BEAM_DAQ_ODTS - daq->n_odts)
        return xcp_error(BEAM_XCP_ERR_MEMORY_OVERFLOW);
    daq->list[list].first_odt = daq->n_odts;
    daq->list[list].n_odts = count;
    daq->n_odts = (uint8_t)(daq->n_odts + count);
    app->xcp.alloc = ODTS;
    return xcp_response(1, packet);
}

static int alloc_odt_entry(struct app *app, uint16_t n, uint8_t packet[])
{
    struct daq *daq = &app->daq;
    const uint16_t list = xcp_u16(packet + 2);
    const uint8_t odt = packet[4], count = packet[5];
    (void)n;
    if (app->xcp.alloc != ODTS && app->xcp.alloc != ENTRIES)
        return xcp_error(BEAM_XCP_ERR_SEQUENCE);
    if (list >= daq->n_lists || odt >= daq->list[list].n_odts)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    struct daq_odt *table = &daq->odt[daq->list[list].first_odt + odt];
    if (table->n_entries != 0)
        return xcp_error(BEAM_XCP_ERR_SEQUENCE);
    if (count > BEAM_DAQ_ENTRIES - daq->n_entries)
        return xcp_error(BEAM_XCP_ERR_MEMORY_OVERFLOW);
    table->first_entry = daq->n_entries;
    table->n_entries = count;
    daq->n_entries = (uint8_t)(daq->n_entries + count);
    app->xcp.alloc = ENTRIES;
    return xcp_response(1, packet);
}

/* ---- What is sent ---- */

static int set_daq_ptr(struct app *app, uint16_t n, uint8_t packet[])
{
    const struct daq *daq = &app->daq;
    const uint16_t list = xcp_u16(packet + 2);
    const uint8_t odt = packet[4], entry = packet[5];
    (void)n;
    app->xcp.daq_pointer = false;
    if (list >= daq->n_lists || odt >= daq->list[list].n_odts)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    app->xcp.daq_odt = (uint8_t)(daq->list[list].first_odt + odt);
    if (entry >= daq->odt[app->xcp.daq_odt].n_entries)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    app->xcp.daq_entry = entry;
    app->xcp.daq_pointer = true;
    return xcp_response(1, packet);
}

static int write_daq(struct app *app, uint16_t n, uint8_t packet[])
{
    struct daq *daq = &app->daq;
    struct xcp *xcp = &app->xcp;
    const uint8_t bit = packet[1], size = packet[2], extension = packet[3];
    const uint32_t offset = xcp_u32(packet + 4) - BEAM_WIRE_LIVE;
    (void)n;
    if (daq_running(daq))
        return xcp_error(BEAM_XCP_ERR_DAQ_ACTIVE);
    const struct daq_odt *odt = &daq->odt[xcp->daq_odt];
    if (!xcp->daq_pointer || xcp->daq_entry >= odt->n_entries)
        return xcp_error(BEAM_XCP_ERR_DAQ_CONFIG);
    if (bit != 0xFF || size == 0 || size > sizeof(struct beam_live))
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    if (extension != 0 || offset > sizeof(struct beam_live) - size)
        return xcp_error(BEAM_XCP_ERR_ACCESS_DENIED); /* the live sample is all that is measured */
    daq->entry[odt->first_entry + xcp->daq_entry++] = (struct daq_entry){(uint8_t)offset, size};
    return xcp_response(1, packet);
}

static int set_daq_list_mode(struct app *app, uint16_t n, uint8_t packet[])
{
    const uint8_t mode = packet[1], prescaler = packet[6];
    const uint16_t list = xcp_u16(packet + 2), channel = xcp_u16(packet + 4);
    (void)n;
    if (list >= app->daq.n_lists || channel >= BEAM_DAQ_EVENTS || prescaler < 1)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    if ((mode & ~MODE_TIMESTAMP) != 0)
        return xcp_error(BEAM_XCP_ERR_MODE_NOT_VALID);
    if (atomic_load(&app->daq.list[list].running))
        return xcp_error(BEAM_XCP_ERR_DAQ_ACTIVE);
    app->daq.list[list].timestamp = (mode & MODE_TIMESTAMP) != 0;
    app->daq.list[list].prescaler = prescaler;
    return xcp_response(1, packet);
}

static int start_stop_daq_list(struct app *app, uint16_t n, uint8_t packet[])
{
    struct daq *daq = &app->daq;
    const uint8_t mode = packet[1];
    const uint16_t list = xcp_u16(packet + 2);
    (void)n;
    if (list >= daq->n_lists)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    if (mode > SELECT)
        return xcp_error(BEAM_XCP_ERR_MODE_NOT_VALID);
    if (mode != STOP && !daq_complete(daq, list))
        return xcp_error(BEAM_XCP_ERR_DAQ_CONFIG);
    if (mode == START)
        daq_start(daq, list);
    else if (mode == STOP)
        atomic_store(&daq->list[list].running, false);
    else
        daq->list[list].selected = true;
    xcp_response(2, packet);
    packet[1] = daq->list[list].first_odt;
    return 2;
}

static int start_stop_synch(struct app *app, uint16_t n, uint8_t packet[])
{
    struct daq *daq = &app->daq;
    const uint8_t mode = packet[1];
    (void)n;
    if (mode > 2)
        return xcp_error(BEAM_XCP_ERR_MODE_NOT_VALID);
    for (int i = 0; i < daq->n_lists && mode == 1; i++)
        if (daq->list[i].selected && !daq_complete(daq, i))
            return xcp_error(BEAM_XCP_ERR_DAQ_CONFIG);
    if (mode == 0)
        daq_stop(daq);
    for (int i = 0; i < daq->n_lists && mode != 0; i++) {
        if (!daq->list[i].selected)
            continue;
        daq->list[i].selected = false;
        if (mode == 1)
            daq_start(daq, i);
        else
            atomic_store(&daq->list[i].running, false);
    }
    return xcp_response(1, packet);
}

const struct xcp_command xcp_daq_commands[] = {
    {BEAM_XCP_SET_DAQ_PTR, 6, set_daq_ptr},
    {BEAM_XCP_WRITE_DAQ, 8, write_daq},
    {BEAM_XCP_SET_DAQ_LIST_MODE, 8, set_daq_list_mode},
    {BEAM_XCP_START_STOP_DAQ_LIST, 4, start_stop_daq_list},
    {BEAM_XCP_START_STOP_SYNCH, 2, start_stop_synch},
    {BEAM_XCP_GET_DAQ_CLOCK, 1, get_daq_clock},
    {BEAM_XCP_GET_DAQ_PROCESSOR_INFO, 1, get_daq_processor_info},
    {BEAM_XCP_GET_DAQ_RESOLUTION_INFO, 1, get_daq_resolution_info},
    {BEAM_XCP_GET_DAQ_EVENT_INFO, 4, get_daq_event_info},
    {BEAM_XCP_FREE_DAQ, 1, free_daq},
    {BEAM_XCP_ALLOC_DAQ, 4, alloc_daq},
    {BEAM_XCP_ALLOC_ODT, 5, alloc_odt},
    {BEAM_XCP_ALLOC_ODT_ENTRY, 6, alloc_odt_entry},
    {0, 0, 0},
};
