/* SPDX-License-Identifier: GPL-3.0-or-later */
/* link_stream.c — struct beam_live as one DAQ list of one table: its own CRC-32 travels with it. */
#include <string.h>

#include "board.h"
#include "xcp_frame.h"
#include "xcp_master.h"

enum { ATTEMPTS = 60, SILENCE_MS = 1000, MOST_ENTRIES = 16, BITS_PER_BYTE = 10 };

double link_rate_Hz(long baud)
{
    const double bytes = (double)xcp_frame_size(1 + sizeof(struct beam_live));
    return 0.9 * (double)baud / BITS_PER_BYTE / bytes;
}

static void take_sample(void *context, size_t n, const uint8_t packet[])
{
    struct link_stream *stream = context;
    struct beam_live live;
    const size_t covered = offsetof(struct beam_live, crc32);
    if (n != 1 + sizeof live) {
        stream->crc_failures++;
        return;
    }
    memcpy(&live, packet + 1, sizeof live);
    if (beam_crc32(0, (uint32_t)covered, packet + 1) != live.crc32) {
        stream->crc_failures++;
        return;
    }
    stream->samples++;
    stream->live(stream->context, &live);
}

/* ---- Setting up ---- */

struct step {
    size_t n;
    uint8_t command[8];
};

/* *done: executed and answered; else everything begins anew. */
static enum bf_status execute(struct link *link, const struct step *step, bool *done, struct xcp_answer *answer,
                              struct bf_error *err)
{
    if (xcp_ask_once(&link->xcp, step->n, step->command, answer, err) != BF_OK)
        return err->status;
    *done = answer->outcome == XCP_DONE;
    return BF_OK;
}

/* Entries of equal size that cover the sample: as few as the board allows. */
static size_t write_entries(size_t largest, struct step steps[MOST_ENTRIES])
{
    const size_t size = sizeof(struct beam_live);
    size_t n = 0;
    for (size_t at = 0, part; at < size && n < MOST_ENTRIES; at += part, n++) {
        part = size - at < largest ? size - at : largest;
        const uint32_t address = BEAM_WIRE_LIVE + (uint32_t)at;
        steps[n] = (struct step){8, {BEAM_XCP_WRITE_DAQ, 0xFF, (uint8_t)part, 0}};
        for (int i = 0; i < 4; i++)
            steps[n].command[4 + i] = (uint8_t)(address >> 8 * i);
    }
    return n;
}

static enum bf_status attempt(struct link *link, unsigned prescale, size_t largest, bool *done,
                              struct xcp_answer *answer, struct bf_error *err)
{
    struct step entries[MOST_ENTRIES];
    const size_t n = write_entries(largest, entries);
    const struct step before[] = {
        {2, {BEAM_XCP_START_STOP_SYNCH, 0}},
        {1, {BEAM_XCP_FREE_DAQ}},
        {4, {BEAM_XCP_ALLOC_DAQ, 0, 1, 0}},
        {5, {BEAM_XCP_ALLOC_ODT, 0, 0, 0, 1}},
        {6, {BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, (uint8_t)n}},
        {6, {BEAM_XCP_SET_DAQ_PTR, 0, 0, 0, 0, 0}},
    };
    const struct step after[] = {
        {8, {BEAM_XCP_SET_DAQ_LIST_MODE, 0, 0, 0, 0, 0, (uint8_t)prescale, 0}},
        {4, {BEAM_XCP_START_STOP_DAQ_LIST, 2, 0, 0}}, /* select */
        {2, {BEAM_XCP_START_STOP_SYNCH, 1}},
    };
    *done = true;
    for (size_t i = 0; *done && i < sizeof before / sizeof *before; i++)
        if (execute(link, &before[i], done, answer, err) != BF_OK)
            return err->status;
    for (size_t i = 0; *done && i < n; i++)
        if (execute(link, &entries[i], done, answer, err) != BF_OK)
            return err->status;
    for (size_t i = 0; *done && i < sizeof after / sizeof *after; i++)
        if (execute(link, &after[i], done, answer, err) != BF_OK)
            return err->status;
    return BF_OK;
}

enum bf_status link_start_stream(struct link *link, unsigned prescale, struct link_stream *stream, struct bf_error *err)
{
    struct xcp_answer answer;
    const uint8_t ask[1] = {BEAM_XCP_GET_DAQ_RESOLUTION_INFO};
    bool done = false;
    if (xcp_expect(&link->xcp, "the sizes of its tables", sizeof ask, ask, 8, &answer, err) != BF_OK)
        return err->status;
    const size_t largest = answer.data[2] & ~3u;
    if (largest * MOST_ENTRIES < sizeof(struct beam_live))
        return bf_fail(err, BF_DEVICE, "%s: the board's tables are too small for a sample; update the firmware",
                       port_path(link->port));
    link->xcp.context = stream;
    link->xcp.sample = take_sample;
    stream->prescale = prescale;
    for (int i = 0; i < ATTEMPTS; i++) {
        stream->samples = stream->crc_failures = 0; /* of an attempt whose last answer was lost nothing counts */
        if (attempt(link, prescale, largest, &done, &answer, err) != BF_OK)
            return err->status;
        if (done)
            return BF_OK;
    }
    link->xcp.sample = NULL;
    if (answer.outcome == XCP_REFUSED)
        return xcp_refused(&link->xcp, "to stream", answer.error, err);
    return bf_fail(err, BF_DEVICE, "%s: the stream could not be set up; check the line", port_path(link->port));
}

/* A sign of life for a board that drives for us, four times a second of its time and of ours; one that is lost is no matter. */
static enum bf_status tell(struct link *link, struct bf_error *err)
{
    enum { TELL_MS = 250 };
    const struct link_stream *stream = link->xcp.context;
    struct xcp_answer ignored;
    if (!link->driving)
        return BF_OK;
    const double board_ms =
        (double)(stream->samples - link->told_samples) * stream->prescale * 1e6 / link->info.sample_mHz;
    if (stream->samples >= link->told_samples && board_ms < TELL_MS && port_clock_ms() - link->told_ms < TELL_MS)
        return BF_OK;
    link->told_ms = port_clock_ms();
    link->told_samples = stream->samples;
    return xcp_ask_once(&link->xcp, 1, (const uint8_t[]){BEAM_XCP_GET_STATUS}, &ignored, err);
}

enum bf_status link_run_stream(struct link *link, int timeout_ms, struct bf_error *err)
{
    int session;
    if (xcp_listen(&link->xcp, timeout_ms, err) != BF_OK || tell(link, err) != BF_OK ||
        xcp_heartbeat(&link->xcp, SILENCE_MS, &session, err) != BF_OK)
        return err->status;
    if (session >= 0 && (session & XCP_SESSION_STREAM) == 0)
        return bf_fail(err, BF_DEVICE,
                       "%s: the board has stopped streaming: another program asked it to, or it restarted",
                       port_path(link->port));
    return BF_OK;
}

void link_stop_stream(struct link *link)
{
    struct xcp_answer answer;
    struct bf_error unheard = {BF_OK, ""};
    link->xcp.sample = NULL;
    (void)xcp_ask(&link->xcp, 2, (const uint8_t[]){BEAM_XCP_START_STOP_SYNCH, 0}, &answer, &unheard);
}
