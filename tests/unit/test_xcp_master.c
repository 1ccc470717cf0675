/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The master against a board of a few lines that does what a good board on a good line never does. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "board/board.h"
#include "board/port.h"
#include "board/xcp_master.h"
#include "board/xcp_frame.h"

/* What the board does with the n-th GET_STATUS (from 0) it receives; SYNCH is answered unless it is deaf. */
struct fake {
    int fd;
    pthread_t thread;
    atomic_bool stop, deaf, flood;
    void (*act)(struct fake *fake, int n);
    atomic_int commands;
    uint16_t counter;
};

static void put(struct fake *fake, size_t n, const uint8_t packet[])
{
    uint8_t frame[BEAM_WIRE_MAX_FRAME];
    const size_t size = xcp_frame_make(fake->counter++, n, packet, frame);
    if (write(fake->fd, frame, size) != (ssize_t)size)
        abort();
}

static void put_status(struct fake *fake, uint8_t mark)
{
    put(fake, 6, (const uint8_t[]){BEAM_XCP_RES, 0, 0, 0, mark, 0});
}

static void take(struct fake *fake, const uint8_t packet[])
{
    if (packet[0] == BEAM_XCP_GET_STATUS)
        fake->act(fake, atomic_fetch_add(&fake->commands, 1));
    else if (packet[0] == BEAM_XCP_CONNECT)
        put(fake, 8, (const uint8_t[]){BEAM_XCP_RES, 5, 0, 248, 248, 0, 1, 1});
    else if (packet[0] == BEAM_XCP_SYNCH)
        put(fake, 2, (const uint8_t[]){BEAM_XCP_ERR, BEAM_XCP_ERR_CMD_SYNCH});
}

static void *live(void *context)
{
    struct fake *fake = context;
    struct xcp_receiver *receiver = calloc(1, sizeof *receiver);
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    size_t n, room;
    while (!atomic_load(&fake->stop)) {
        struct pollfd ready = {.fd = fake->fd, .events = POLLIN};
        if (atomic_load(&fake->flood))
            put(fake, 41, (const uint8_t[41]){0});
        if (poll(&ready, 1, 5) <= 0 || (ready.revents & POLLIN) == 0)
            continue;
        uint8_t *to = xcp_receiver_room(receiver, &room);
        const ssize_t got = read(fake->fd, to, room);
        if (got > 0)
            xcp_receiver_added(receiver, (size_t)got);
        while (xcp_receiver_next(receiver, packet, &n))
            if (!atomic_load(&fake->deaf))
                take(fake, packet);
    }
    free(receiver);
    return NULL;
}

struct rig {
    struct fake fake;
    struct port *port;
    struct xcp_master m;
    struct bf_error err;
    struct xcp_answer answer;
};

static int setup(void **state)
{
    struct rig *rig = calloc(1, sizeof *rig);
    *state = rig;
    rig->fake.fd = posix_openpt(O_RDWR | O_NOCTTY);
    if (rig->fake.fd < 0 || grantpt(rig->fake.fd) != 0 || unlockpt(rig->fake.fd) != 0 ||
        port_open(ptsname(rig->fake.fd), 921600, &rig->port, &rig->err) != BF_OK)
        return -1;
    xcp_begin(&rig->m, rig->port);
    rig->m.timeout_ms = 1000; /* a busy machine loses nothing */
    return 0;
}

static void start(struct rig *rig, void (*act)(struct fake *fake, int n))
{
    rig->fake.act = act;
    assert_int_equal(pthread_create(&rig->fake.thread, NULL, live, &rig->fake), 0);
}

static int teardown(void **state)
{
    struct rig *rig = *state;
    atomic_store(&rig->fake.stop, true);
    pthread_join(rig->fake.thread, NULL);
    port_close(rig->port);
    close(rig->fake.fd);
    free(rig);
    return 0;
}

static const uint8_t get_status[] = {BEAM_XCP_GET_STATUS};

static enum bf_status ask(struct rig *rig)
{
    return xcp_ask(&rig->m, sizeof get_status, get_status, &rig->answer, &rig->err);
}

static void answer_all(struct fake *fake, int n)
{
    put_status(fake, (uint8_t)n);
}

static void a_good_board(void **state)
{
    struct rig *rig = *state;
    size_t packet;
    start(rig, answer_all);
    assert_int_equal(xcp_connect(&rig->m, &packet, &rig->err), BF_OK);
    assert_int_equal(packet, 248);
    for (int i = 0; i < 50; i++) {
        assert_int_equal(ask(rig), BF_OK);
        assert_int_equal(rig->answer.outcome, XCP_DONE);
        assert_int_equal(rig->answer.n, 6);
    }
    assert_int_equal(atomic_load(&rig->fake.commands), rig->m.counts.repeats + 50);
    xcp_disconnect(&rig->m);
}

static void answer_the_third(struct fake *fake, int n)
{
    if (n >= 2)
        put_status(fake, 77);
}

static void lost_answers_are_asked_for_again(void **state)
{
    struct rig *rig = *state;
    start(rig, answer_the_third);
    assert_int_equal(ask(rig), BF_OK);
    assert_int_equal(rig->answer.outcome, XCP_DONE);
    assert_int_equal(rig->answer.data[4], 77);
    assert_true(rig->m.counts.repeats >= 2 && rig->m.counts.synchs >= 2);
}

/* A command that must not run twice is not sent twice. */
static void lost_once_is_lost(void **state)
{
    struct rig *rig = *state;
    start(rig, answer_the_third);
    assert_int_equal(xcp_ask_once(&rig->m, sizeof get_status, get_status, &rig->answer, &rig->err), BF_OK);
    assert_int_equal(rig->answer.outcome, XCP_LOST);
    assert_int_equal(atomic_load(&rig->fake.commands), 1);
}

/* The first answer comes after its time: it must not be taken for the second's. */
static void answer_late(struct fake *fake, int n)
{
    if (n == 0)
        usleep(400000);
    put_status(fake, (uint8_t)(n == 0 ? 1 : 2));
}

static void a_late_answer_is_nobodys(void **state)
{
    struct rig *rig = *state;
    rig->m.timeout_ms = 100;
    start(rig, answer_late);
    assert_int_equal(ask(rig), BF_OK);
    assert_int_equal(rig->answer.data[4], 2);
    assert_true(rig->m.counts.stale >= 1);
}

static void answer_behind_junk(struct fake *fake, int n)
{
    static const uint8_t junk[] = {0xF0, 0x00, 1, 2, 3}; /* the length of a frame that does not come */
    if (write(fake->fd, junk, sizeof junk) != sizeof junk)
        abort();
    put_status(fake, (uint8_t)(100 + n));
}

static void an_answer_hidden_in_a_false_frame_is_found(void **state)
{
    struct rig *rig = *state;
    start(rig, answer_behind_junk);
    assert_int_equal(xcp_ask_once(&rig->m, sizeof get_status, get_status, &rig->answer, &rig->err), BF_OK);
    assert_int_equal(rig->answer.outcome, XCP_DONE);
    assert_int_equal(rig->answer.data[4], 100);
}

/* Slow, and says so: longer than any timer. */
static void answer_pending(struct fake *fake, int n)
{
    for (int i = 0; i < 60; i++) {
        put(fake, 2, (const uint8_t[]){BEAM_XCP_EV, XCP_EV_CMD_PENDING});
        usleep(25000);
    }
    put_status(fake, (uint8_t)n);
}

static void a_pending_command_is_waited_for(void **state)
{
    struct rig *rig = *state;
    start(rig, answer_pending);
    rig->m.patience_ms = 1000;
    assert_int_equal(ask(rig), BF_OK);
    assert_int_equal(rig->answer.data[4], 0);
    assert_int_equal(atomic_load(&rig->fake.commands), 1);
}

static void answer_busy(struct fake *fake, int n)
{
    if (n < 5)
        put(fake, 2, (const uint8_t[]){BEAM_XCP_ERR, BEAM_XCP_ERR_CMD_BUSY});
    else
        put_status(fake, 5);
}

static void a_busy_board_is_asked_later(void **state)
{
    struct rig *rig = *state;
    start(rig, answer_busy);
    assert_int_equal(xcp_ask_once(&rig->m, sizeof get_status, get_status, &rig->answer, &rig->err), BF_OK);
    assert_int_equal(rig->answer.outcome, XCP_DONE);
    assert_int_equal(atomic_load(&rig->fake.commands), 6);
}

static void refuse_once(struct fake *fake, int n)
{
    if (n == 0)
        put(fake, 2, (const uint8_t[]){BEAM_XCP_ERR, BEAM_XCP_ERR_CMD_SYNTAX});
    else
        put_status(fake, 9);
}

static void refuse_always(struct fake *fake, int n)
{
    (void)n;
    put(fake, 2, (const uint8_t[]){BEAM_XCP_ERR, BEAM_XCP_ERR_WRITE_PROTECTED});
}

static void one_error_is_not_believed(void **state)
{
    struct rig *rig = *state;
    start(rig, refuse_once);
    assert_int_equal(ask(rig), BF_OK);
    assert_int_equal(rig->answer.outcome, XCP_DONE);
}

static void two_errors_are_said_in_words(void **state)
{
    struct rig *rig = *state;
    start(rig, refuse_always);
    assert_int_equal(xcp_expect(&rig->m, "a test", 1, get_status, 6, &rig->answer, &rig->err), BF_DEVICE);
    assert_non_null(strstr(rig->err.text, "refused a test (XCP error 0x23): that memory is read-only"));
}

static void count_samples(void *context, size_t n, const uint8_t packet[])
{
    (void)packet;
    if (n == 41)
        ++*(int *)context;
}

/* Samples stream on while no answer comes: the time runs out all the same. */
static void samples_do_not_extend_a_deadline(void **state)
{
    struct rig *rig = *state;
    int samples = 0;
    rig->m.timeout_ms = 50;
    rig->m.sample = count_samples;
    rig->m.context = &samples;
    atomic_store(&rig->fake.deaf, true);
    atomic_store(&rig->fake.flood, true);
    start(rig, answer_all);
    const int64_t from_ms = port_clock_ms();
    assert_int_equal(ask(rig), BF_DEVICE);
    assert_non_null(strstr(rig->err.text, "no answer from the board"));
    assert_true(port_clock_ms() - from_ms < 60000);
    assert_true(samples > 0);
}

static void a_heartbeat_finds_silence(void **state)
{
    struct rig *rig = *state;
    int session = 0;
    start(rig, answer_all);
    assert_int_equal(xcp_heartbeat(&rig->m, 60000, &session, &rig->err), BF_OK);
    assert_int_equal(session, -1); /* there was no need to ask */
    assert_int_equal(xcp_heartbeat(&rig->m, 0, &session, &rig->err), BF_OK);
    assert_int_equal(session, 0);
    atomic_store(&rig->fake.deaf, true);
    rig->m.timeout_ms = 50;
    assert_int_equal(xcp_heartbeat(&rig->m, 0, &session, &rig->err), BF_DEVICE);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(a_good_board),
        CASE(lost_answers_are_asked_for_again),
        CASE(lost_once_is_lost),
        CASE(a_late_answer_is_nobodys),
        CASE(an_answer_hidden_in_a_false_frame_is_found),
        CASE(a_pending_command_is_waited_for),
        CASE(a_busy_board_is_asked_later),
        CASE(one_error_is_not_believed),
        CASE(two_errors_are_said_in_words),
        CASE(samples_do_not_extend_a_deadline),
        CASE(a_heartbeat_finds_silence),
    };
    return cmocka_run_group_tests_name("xcp_master", tests, NULL, NULL);
}
