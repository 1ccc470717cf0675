/* SPDX-License-Identifier: GPL-3.0-or-later */
/* xcp_master.h — one XCP session: xcp_begin(), xcp_connect(), then questions and samples, xcp_disconnect(). */
#ifndef BEAMFIT_XCP_MASTER_H
#define BEAMFIT_XCP_MASTER_H

#include "board.h"

enum xcp_event { XCP_EV_STORE_CAL = 3, XCP_EV_CMD_PENDING = 5, XCP_EV_DAQ_OVERLOAD = 6, XCP_EV_SESSION_TERMINATED = 7 };

enum xcp_outcome { XCP_DONE, XCP_REFUSED, XCP_LOST };
struct xcp_answer {
    enum xcp_outcome outcome;
    uint8_t error;                      /* when refused: BEAM_XCP_ERR_… */
    size_t n;                           /* when done */
    uint8_t data[BEAM_WIRE_MAX_PACKET]; /* [n], data[0] = BEAM_XCP_RES */
};

/* Timers at their defaults (100 ms, 10 tries, 10 s busy). No byte is sent. */
void xcp_begin(struct xcp_master *m, struct port *port);

/* CONNECT until answered; max_packet: what the board takes and sends. */
enum bf_status xcp_connect(struct xcp_master *m, size_t *max_packet, struct bf_error *err);

/* DISCONNECT; that nobody answers it is no failure. */
void xcp_disconnect(struct xcp_master *m);

/* n bytes of command. Repeated after a loss; the outcome is done or refused. */
enum bf_status xcp_ask(struct xcp_master *m, size_t n, const uint8_t command[], struct xcp_answer *answer,
                       struct bf_error *err);

/* Never sent twice, unless the board said it was busy. XCP_LOST: it may have been executed; the line is in step again. */
enum bf_status xcp_ask_once(struct xcp_master *m, size_t n, const uint8_t command[], struct xcp_answer *answer,
                            struct bf_error *err);

/* As xcp_ask(), where anything but an answer of at least `least` bytes is a failure; what: "reading memory". */
enum bf_status xcp_expect(struct xcp_master *m, const char *what, size_t n, const uint8_t command[], size_t least,
                          struct xcp_answer *answer, struct bf_error *err);

/* BF_DEVICE with the meaning of the error in words. */
enum bf_status xcp_refused(const struct xcp_master *m, const char *what, uint8_t error, struct bf_error *err);

/* Waits for samples and events up to timeout_ms, handles what has come, and returns. */
enum bf_status xcp_listen(struct xcp_master *m, int timeout_ms, struct bf_error *err);

/* Asks for the status when nothing was heard for silence_ms: BF_DEVICE when no answer comes. *session: GET_STATUS's session
 * byte, −1 when there was no need to ask. */
enum bf_status xcp_heartbeat(struct xcp_master *m, int silence_ms, int *session, struct bf_error *err);
enum { XCP_SESSION_STORE = 0x01, XCP_SESSION_STREAM = 0x40 };

#endif
