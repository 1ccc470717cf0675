/* SPDX-License-Identifier: MIT */
/* Memory and pages: upload, download, checksum, the two pages of segment 0. */
#include "app.h"
#include <string.h>

enum { ECU = 0x01, XCP = 0x02, ALL = 0x80 }; /* mode bits of SET_CAL_PAGE, GET_CAL_PAGE */

/* ---- Memory ---- */

static int set_mta(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    app->xcp.mta_extension = packet[3];
    app->xcp.mta = xcp_u32(packet + 4);
    return xcp_response(1, packet);
}

static int upload_here(struct app *app, uint32_t n, uint8_t packet[])
{
    if (n < 1 || n > BEAM_WIRE_MAX_PACKET - 1)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    const int fault =
        app->xcp.mta_extension != 0 ? BEAM_XCP_ERR_ACCESS_DENIED : app_read(app, app->xcp.mta, n, packet + 1);
    if (fault != 0)
        return xcp_error(fault);
    app->xcp.mta += n;
    packet[0] = BEAM_XCP_RES;
    return (int)n + 1;
}

static int upload(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    return upload_here(app, packet[1], packet);
}

static int short_upload(struct app *app, uint16_t n, uint8_t packet[])
{
    const uint8_t count = packet[1];
    set_mta(app, n, packet);
    return upload_here(app, count, packet);
}

/* `count` bytes at packet + data_at to the MTA. */
static int download_here(struct app *app, uint16_t n, uint32_t count, uint32_t data_at, uint8_t packet[])
{
    if (count < 1 || count + data_at > n)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    const int fault = app->xcp.mta_extension != 0 ? BEAM_XCP_ERR_ACCESS_DENIED
                                                  : app_write(app, app->xcp.mta, count, packet + data_at);
    if (fault != 0)
        return xcp_error(fault);
    app->xcp.mta += count;
    return xcp_response(1, packet);
}

static int download(struct app *app, uint16_t n, uint8_t packet[])
{
    return download_here(app, n, packet[1], 2, packet);
}

static int short_download(struct app *app, uint16_t n, uint8_t packet[])
{
    app->xcp.mta_extension = packet[3];
    app->xcp.mta = xcp_u32(packet + 4);
    return download_here(app, n, packet[1], 8, packet);
}

static int build_checksum(struct app *app, uint16_t n, uint8_t packet[])
{
    uint8_t chunk[64];
    const uint32_t bytes = xcp_u32(packet + 4);
    uint32_t crc = 0;
    (void)n;
    if (bytes < 1 || bytes > BEAM_IMAGE_BYTES)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    for (uint32_t done = 0; done < bytes;) {
        const uint32_t count = bytes - done < sizeof chunk ? bytes - done : sizeof chunk;
        const int fault =
            app->xcp.mta_extension != 0 ? BEAM_XCP_ERR_ACCESS_DENIED : app_read(app, app->xcp.mta + done, count, chunk);
        if (fault != 0)
            return xcp_error(fault);
        crc = beam_crc32(crc, count, chunk);
        done += count;
    }
    app->xcp.mta += bytes;
    xcp_response(8, packet);
    packet[1] = 9; /* CRC-32 */
    xcp_put(4, crc, packet + 4);
    return 8;
}

/* ---- Pages ---- */

static int set_cal_page(struct app *app, uint16_t n, uint8_t packet[])
{
    struct xcp *xcp = &app->xcp;
    const uint8_t mode = packet[1], segment = packet[2], page = packet[3];
    (void)n;
    if ((mode & (ECU | XCP)) == 0 || (mode & ~(ECU | XCP | ALL)) != 0)
        return xcp_error(BEAM_XCP_ERR_MODE_NOT_VALID);
    if (segment != 0 && !(mode & ALL))
        return xcp_error(BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    if (page > BEAM_WIRE_PAGE_STAGING)
        return xcp_error(BEAM_XCP_ERR_PAGE_NOT_VALID);
    if (!(mode & ECU) || page == BEAM_WIRE_PAGE_ACTIVE) { /* the ECU's page is always 0: nothing to change there */
        if (mode & XCP)
            xcp->page = page;
        return xcp_response(1, packet);
    }
    if (!xcp->unlocked)
        return xcp_error(BEAM_XCP_ERR_ACCESS_LOCKED);
    if (app->store.phase != STORE_IDLE)
        return xcp_error(BEAM_XCP_ERR_CMD_BUSY);
    pages_begin(&app->pages, app->store.stored);
    xcp->pending = true;
    xcp->pending_moves_xcp = (mode & XCP) != 0;
    xcp->pending_since_us = board_time_us();
    return XCP_NO_ANSWER;
}

static int get_cal_page(struct app *app, uint16_t n, uint8_t packet[])
{
    const uint8_t mode = packet[1], segment = packet[2];
    (void)n;
    if (mode != ECU && mode != XCP)
        return xcp_error(BEAM_XCP_ERR_MODE_NOT_VALID);
    if (segment != 0)
        return xcp_error(BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    xcp_response(4, packet);
    packet[3] = mode == XCP ? app->xcp.page : BEAM_WIRE_PAGE_ACTIVE;
    return 4;
}

static int get_pag_processor_info(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)app, (void)n;
    xcp_response(3, packet);
    packet[1] = 1; /* segments */
    return 3;
}

static int get_segment_info(struct app *app, uint16_t n, uint8_t packet[])
{
    const uint8_t mode = packet[1], segment = packet[2], what = packet[3];
    (void)app, (void)n;
    if (segment != 0)
        return xcp_error(BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    if (mode == 1) { /* two pages, nothing else */
        xcp_response(6, packet);
        packet[1] = 2;
        return 6;
    }
    if (mode != 0 || what > 1)
        return xcp_error(BEAM_XCP_ERR_OUT_OF_RANGE);
    xcp_response(8, packet);
    xcp_put(4, what == 0 ? BEAM_WIRE_IMAGE : BEAM_IMAGE_BYTES, packet + 4);
    return 8;
}

static int get_page_info(struct app *app, uint16_t n, uint8_t packet[])
{
    const uint8_t segment = packet[2], page = packet[3];
    (void)app, (void)n;
    if (segment != 0)
        return xcp_error(BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    if (page > BEAM_WIRE_PAGE_STAGING)
        return xcp_error(BEAM_XCP_ERR_PAGE_NOT_VALID);
    xcp_response(3, packet);
    packet[1] = page == BEAM_WIRE_PAGE_ACTIVE ? 0x0F : 0x3F; /* ECU access; XCP reads; XCP writes to page 1 only */
    return 3;
}

static int copy_cal_page(struct app *app, uint16_t n, uint8_t packet[])
{
    (void)n;
    if (packet[1] != 0 || packet[3] != 0)
        return xcp_error(BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    if (packet[2] > BEAM_WIRE_PAGE_STAGING || packet[4] > BEAM_WIRE_PAGE_STAGING)
        return xcp_error(BEAM_XCP_ERR_PAGE_NOT_VALID);
    if (packet[4] == BEAM_WIRE_PAGE_ACTIVE)
        return xcp_error(BEAM_XCP_ERR_WRITE_PROTECTED);
    if (!app->xcp.unlocked)
        return xcp_error(BEAM_XCP_ERR_ACCESS_LOCKED);
    if (packet[2] == BEAM_WIRE_PAGE_ACTIVE)
        *pages_staging(&app->pages) = *pages_active(&app->pages);
    return xcp_response(1, packet);
}

const struct xcp_command xcp_memory_commands[] = {
    {BEAM_XCP_SET_MTA, 8, set_mta},
    {BEAM_XCP_UPLOAD, 2, upload},
    {BEAM_XCP_SHORT_UPLOAD, 8, short_upload},
    {BEAM_XCP_BUILD_CHECKSUM, 8, build_checksum},
    {BEAM_XCP_DOWNLOAD, 3, download},
    {BEAM_XCP_SHORT_DOWNLOAD, 9, short_download},
    {BEAM_XCP_SET_CAL_PAGE, 4, set_cal_page},
    {BEAM_XCP_GET_CAL_PAGE, 3, get_cal_page},
    {BEAM_XCP_GET_PAG_PROCESSOR_INFO, 1, get_pag_processor_info},
    {BEAM_XCP_GET_SEGMENT_INFO, 5, get_segment_info},
    {BEAM_XCP_GET_PAGE_INFO, 4, get_page_info},
    {BEAM_XCP_COPY_CAL_PAGE, 5, copy_cal_page},
    {0, 0, 0},
};
