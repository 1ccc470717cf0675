/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "board.h"
#include "xcp_master.h"
#include "port.h"
#include "xcp_frame.h"

#include <string.h>
#include <time.h>

enum { TIMEOUT_MS = 100, TRIES = 10, BUSY_MS = 10000, BUSY_PAUSE_MS = 10, WRITE_MS = 2000 };
enum { LEAST_MS = BEAM_WIRE_GAP_MS + 10, SAFETY = 4, ENOUGH_TIMED = 16, LEAST_PACKET = 64 };

void xcp_begin(struct xcp_master *m, struct port *port)
{
    memset(m, 0, sizeof *m);
    m->port = port;
    m->timeout_ms = TIMEOUT_MS;
    m->tries = TRIES;
    m->busy_ms = BUSY_MS;
    m->heard_ms = port_clock_ms();
}

static void sleep_ms(int ms)
{
    const struct timespec pause = {.tv_nsec = (long)ms * 1000000L};
    (void)nanosleep(&pause, NULL);
}

/* ---- What arrives ---- */

static void take_event(struct xcp_master *m, size_t n, const uint8_t packet[])
{
    const int code = n > 1 ? packet[1] : -1;
    m->counts.stored += code == XCP_EV_STORE_CAL;
    m->counts.overloads += code == XCP_EV_DAQ_OVERLOAD;
    m->counts.terminated += code == XCP_EV_SESSION_TERMINATED;
    m->pending = m->pending || code == XCP_EV_CMD_PENDING;
}

static void take_packet(struct xcp_master *m, size_t n, const uint8_t packet[])
{
    switch (packet[0]) {
    case BEAM_XCP_RES:
    case BEAM_XCP_ERR:
        m->answered = true;
        m->n_answer = n;
        memcpy(m->answer, packet, n);
        break;
    case BEAM_XCP_EV:
        take_event(m, n, packet);
        break;
    case BEAM_XCP_SERV:
        break;
    default:
        if (m->sample != NULL)
            m->sample(m->context, n, packet);
    }
}

static void take_packets(struct xcp_master *m)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    size_t n;
    while (!m->answered && xcp_receiver_next(&m->receiver, packet, &n)) {
        m->heard_ms = port_clock_ms();
        take_packet(m, n, packet);
    }
}

/* Answers that have come and that nobody waits for. */
static void forget_answers(struct xcp_master *m)
{
    do {
        m->counts.stale += m->answered;
        m->answered = false;
        take_packets(m);
    } while (m->answered);
}

/* One look at the port, as long as timeout_ms; stops at an answer, which the caller takes first. */
static enum bf_status receive(struct xcp_master *m, int timeout_ms, struct bf_error *err)
{
    size_t room, got;
    take_packets(m);
    if (m->answered)
        return BF_OK;
    uint8_t *to = xcp_receiver_room(&m->receiver, &room);
    if (port_read(m->port, room, to, &got, timeout_ms, err) != BF_OK)
        return err->status;
    xcp_receiver_added(&m->receiver, got);
    take_packets(m);
    return BF_OK;
}

/*
 * Waiting time of try `again` (from 0). Never below the gap after which the board gives up a frame that a damaged length
 * has made longer.
 */
static int wait_ms(const struct xcp_master *m, int again)
{
    const double wire_ms = 2.0 * BEAM_WIRE_MAX_FRAME * 10 * 1000 / (double)port_baud(m->port);
    const double most_ms = m->timeout_ms + wire_ms, learnt_ms = LEAST_MS + SAFETY * m->usual_ms;
    const double first_ms = m->timed >= ENOUGH_TIMED && learnt_ms < most_ms ? learnt_ms : most_ms;
    return (int)first_ms << (again < 2 ? again : 2);
}

static void learn(struct xcp_master *m, int64_t took_ms)
{
    m->timed++;
    m->usual_ms += ((double)took_ms - m->usual_ms) / (m->timed < ENOUGH_TIMED ? m->timed : ENOUGH_TIMED);
}

/* Until there is an answer or the time is over; then a frame that never ends is given up, since its bytes may contain the answer. */
static enum bf_status await(struct xcp_master *m, int timeout_ms, struct bf_error *err)
{
    int64_t until_ms = port_clock_ms() + timeout_ms;
    m->pending = false;
    for (int64_t left_ms = timeout_ms; !m->answered && left_ms > 0; left_ms = until_ms - port_clock_ms()) {
        if (receive(m, (int)left_ms, err) != BF_OK)
            return err->status;
        if (m->pending)
            until_ms = port_clock_ms() + timeout_ms;
        m->pending = false;
    }
    while (!m->answered && m->receiver.end > m->receiver.start) {
        xcp_receiver_gap(&m->receiver);
        take_packets(m);
    }
    return BF_OK;
}

/* ---- What is sent ---- */

static enum bf_status send_packet(struct xcp_master *m, size_t n, const uint8_t packet[], struct bf_error *err)
{
    uint8_t frame[BEAM_WIRE_MAX_FRAME];
    const size_t size = xcp_frame_make(m->counter++, n, packet, frame);
    return port_write(m->port, size, frame, WRITE_MS, err);
}

static bool is_synch(const struct xcp_master *m)
{
    return m->n_answer == 2 && m->answer[0] == BEAM_XCP_ERR && m->answer[1] == BEAM_XCP_ERR_CMD_SYNCH;
}

static enum bf_status no_answer(const struct xcp_master *m, struct bf_error *err)
{
    return bf_fail(err, BF_DEVICE,
                   "%s: no answer from the board at %ld bit/s; check cable, power and --baud, and that the board is a "
                   "beamfit board",
                   port_path(m->port), port_baud(m->port));
}

/* Brings both sides in step: all answers before SYNCH's own are stale. */
static enum bf_status synchronise(struct xcp_master *m, struct bf_error *err)
{
    for (int i = 0; i < m->tries; i++) {
        const int64_t until_ms = port_clock_ms() + wait_ms(m, i);
        m->counts.synchs++;
        if (send_packet(m, 1, (const uint8_t[]){BEAM_XCP_SYNCH}, err) != BF_OK)
            return err->status;
        do {
            m->answered = false;
            if (await(m, wait_ms(m, i), err) != BF_OK)
                return err->status;
            if (m->answered && is_synch(m)) {
                m->answered = false;
                return BF_OK;
            }
            m->counts.stale += m->answered;
        } while (m->answered && port_clock_ms() < until_ms);
    }
    return no_answer(m, err);
}

/* One sending, the `again`-th repetition. A late answer to an earlier SYNCH is nobody's. */
static enum bf_status ask_now(struct xcp_master *m, int again, size_t n, const uint8_t command[],
                              struct xcp_answer *answer, struct bf_error *err)
{
    const int timeout_ms = wait_ms(m, again) > m->patience_ms ? wait_ms(m, again) : m->patience_ms;
    m->counts.commands++;
    forget_answers(m); /* what came before the command is no answer to it */
    const int64_t sent_ms = port_clock_ms();
    if (send_packet(m, n, command, err) != BF_OK)
        return err->status;
    do {
        m->answered = false;
        if (await(m, timeout_ms, err) != BF_OK)
            return err->status;
    } while (m->answered && is_synch(m));
    if (m->answered && m->patience_ms == 0)
        learn(m, port_clock_ms() - sent_ms);
    answer->outcome = !m->answered ? XCP_LOST : m->answer[0] == BEAM_XCP_RES ? XCP_DONE : XCP_REFUSED;
    answer->error = answer->outcome == XCP_REFUSED && m->n_answer > 1 ? m->answer[1] : BEAM_XCP_ERR_GENERIC;
    answer->n = answer->outcome == XCP_DONE ? m->n_answer : 0;
    memcpy(answer->data, m->answer, answer->n);
    m->answered = false;
    return BF_OK;
}

/* As long as the board is busy, which says that nothing was executed. */
static enum bf_status ask_patiently(struct xcp_master *m, int again, size_t n, const uint8_t command[],
                                    struct xcp_answer *answer, struct bf_error *err)
{
    const int64_t until_ms = port_clock_ms() + m->busy_ms;
    for (;;) {
        if (ask_now(m, again, n, command, answer, err) != BF_OK)
            return err->status;
        if (answer->outcome != XCP_REFUSED || answer->error != BEAM_XCP_ERR_CMD_BUSY || port_clock_ms() >= until_ms)
            return BF_OK;
        sleep_ms(BUSY_PAUSE_MS);
    }
}

static enum bf_status ask_once(struct xcp_master *m, int again, size_t n, const uint8_t command[],
                               struct xcp_answer *answer, struct bf_error *err)
{
    if (ask_patiently(m, again, n, command, answer, err) != BF_OK)
        return err->status;
    return answer->outcome == XCP_LOST ? synchronise(m, err) : BF_OK;
}

enum bf_status xcp_ask_once(struct xcp_master *m, size_t n, const uint8_t command[], struct xcp_answer *answer,
                            struct bf_error *err)
{
    return ask_once(m, 0, n, command, answer, err);
}

enum bf_status xcp_ask(struct xcp_master *m, size_t n, const uint8_t command[], struct xcp_answer *answer,
                       struct bf_error *err)
{
    int refused = -1; /* the error of the try before */
    for (int i = 0; i < m->tries; i++) {
        m->counts.repeats += i > 0;
        if (ask_once(m, i, n, command, answer, err) != BF_OK)
            return err->status;
        if (answer->outcome == XCP_DONE || (answer->outcome == XCP_REFUSED && answer->error == refused))
            return BF_OK;
        refused = answer->outcome == XCP_REFUSED ? answer->error : -1;
    }
    return answer->outcome == XCP_REFUSED ? BF_OK : no_answer(m, err);
}

/* ---- Sessions ---- */

enum bf_status xcp_connect(struct xcp_master *m, size_t *max_packet, struct bf_error *err)
{
    struct xcp_answer answer = {.outcome = XCP_LOST};
    for (int i = 0; i < m->tries && answer.outcome != XCP_DONE; i++)
        if (ask_now(m, i, 2, (const uint8_t[]){BEAM_XCP_CONNECT, 0}, &answer, err) != BF_OK)
            return err->status;
    if (answer.outcome != XCP_DONE)
        return no_answer(m, err);
    const bool known = answer.n >= 8 && (answer.data[2] & 0x07) == 0; /* little-endian, bytes */
    *max_packet = known ? answer.data[3] : 0;
    if (*max_packet < LEAST_PACKET || *max_packet > BEAM_WIRE_MAX_PACKET)
        return bf_fail(err, BF_DEVICE, "%s: an XCP device answers, but not a beamfit board; is this the right port?",
                       port_path(m->port));
    return synchronise(m, err); /* a second answer to a repeated CONNECT may still be on its way */
}

void xcp_disconnect(struct xcp_master *m)
{
    struct xcp_answer ignored;
    struct bf_error unheard = {BF_OK, ""};
    (void)ask_now(m, 0, 1, (const uint8_t[]){BEAM_XCP_DISCONNECT}, &ignored, &unheard);
}

static const char *error_text(uint8_t error)
{
    switch (error) {
    case BEAM_XCP_ERR_CMD_BUSY:
        return "it is busy; try again";
    case BEAM_XCP_ERR_DAQ_ACTIVE:
        return "samples are streaming; another program uses the board";
    case BEAM_XCP_ERR_CMD_UNKNOWN:
    case BEAM_XCP_ERR_CMD_SYNTAX:
        return "its firmware does not know the command; update the firmware";
    case BEAM_XCP_ERR_OUT_OF_RANGE:
    case BEAM_XCP_ERR_ACCESS_DENIED:
        return "its firmware has another memory map; update the firmware or this program";
    case BEAM_XCP_ERR_WRITE_PROTECTED:
        return "that memory is read-only";
    case BEAM_XCP_ERR_ACCESS_LOCKED:
        return "it is locked; give its key file with --key";
    case BEAM_XCP_ERR_PAGE_NOT_VALID:
        return "the image was not accepted";
    case BEAM_XCP_ERR_SEQUENCE:
    case BEAM_XCP_ERR_DAQ_CONFIG:
        return "the set-up of the stream was disturbed; try again";
    case BEAM_XCP_ERR_MEMORY_OVERFLOW:
        return "its memory for streaming is too small";
    case BEAM_XCP_ERR_GENERIC:
        return "its memory failed";
    default:
        return "for a reason that this program does not know";
    }
}

enum bf_status xcp_refused(const struct xcp_master *m, const char *what, uint8_t error, struct bf_error *err)
{
    return bf_fail(err, BF_DEVICE, "%s: the board refused %s (XCP error 0x%02X): %s", port_path(m->port), what, error,
                   error_text(error));
}

enum bf_status xcp_expect(struct xcp_master *m, const char *what, size_t n, const uint8_t command[], size_t least,
                          struct xcp_answer *answer, struct bf_error *err)
{
    for (int i = 0; i < m->tries; i++) { /* too short an answer is a damaged one */
        if (xcp_ask(m, n, command, answer, err) != BF_OK)
            return err->status;
        if (answer->outcome == XCP_REFUSED)
            return xcp_refused(m, what, answer->error, err);
        if (answer->n >= least)
            return BF_OK;
    }
    return bf_fail(err, BF_DEVICE, "%s: the board's answer to %s is too short; update the firmware or this program",
                   port_path(m->port), what);
}

enum bf_status xcp_listen(struct xcp_master *m, int timeout_ms, struct bf_error *err)
{
    if (receive(m, timeout_ms, err) != BF_OK)
        return err->status;
    forget_answers(m);
    return BF_OK;
}

enum bf_status xcp_heartbeat(struct xcp_master *m, int silence_ms, int *session, struct bf_error *err)
{
    struct xcp_answer answer;
    *session = -1;
    if (port_clock_ms() - m->heard_ms < silence_ms)
        return BF_OK;
    if (xcp_expect(m, "a sign of life", 1, (const uint8_t[]){BEAM_XCP_GET_STATUS}, 6, &answer, err) == BF_OK)
        *session = answer.data[1];
    return *session >= 0 ? BF_OK : err->status;
}
