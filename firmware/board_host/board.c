/* SPDX-License-Identifier: MIT */
/* The board of a PC: one thread plays the sample interrupt and the background loop in turn. */
#include "board.h"
#include "host.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/timerfd.h>
#include <unistd.h>

enum { CODE_MAX = 4095, CODE_ZERO = 2048 };

static struct host_options options;
static struct board_facts facts;
static uint8_t key[32], session_key[32];
static uint64_t ticks;
static uint16_t drive_code = CODE_ZERO;
static int timer = -1, alarm_file = -1, turns;
static uint64_t due; /* ticks the clock says, not yet played */
static volatile sig_atomic_t stopped;

static void stop(int signal)
{
    (void)signal;
    stopped = 1;
}

const struct board_facts *board_init(void)
{
    if (options.key)
        host_key_read(options.key, key);
    else if (getrandom(key, sizeof key, 0) != sizeof key)
        return NULL;
    memcpy(session_key, key, sizeof session_key);
    if (options.unlock_key)
        host_key_read(options.unlock_key, session_key);
    facts = (struct board_facts){.key = key,
                                 .session_key = session_key,
                                 .sample_mHz = (uint32_t)(options.sample_Hz * 1000.0 + 0.5),
                                 .core_Hz = (uint32_t)(options.core_MHz * 1e6 + 0.5),
                                 .sensor_code_max = CODE_MAX,
                                 .drive_code_zero = CODE_ZERO,
                                 .nvm_slot_bytes = HOST_NVM_SLOT_BYTES};
    memcpy(facts.device, options.device, sizeof facts.device);
    host_nvm_open(options.nvm, options.power_cut);
    if (options.alarm) {
        alarm_file = open(options.alarm, O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
        if (alarm_file < 0)
            host_fail("%s: %s", options.alarm, strerror(errno));
        board_alarm(false);
    }
    host_sensor_open(options.plant, options.replay);
    host_port_open(options.pty_link);
    return &facts;
}

void board_start(void)
{
    const struct sigaction action = {.sa_handler = stop};
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    if (!options.is_virtual) {
        const long interval_ns = (long)(1e12 / facts.sample_mHz);
        const struct timespec interval = {interval_ns / 1000000000, interval_ns % 1000000000};
        const struct itimerspec every = {interval, interval};
        timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
        if (timer < 0 || timerfd_settime(timer, 0, &every, NULL) != 0)
            host_fail("timer: %s", strerror(errno));
    }
    puts("READY");
    fflush(stdout);
}

void board_drive(uint16_t code)
{
    drive_code = code;
}

/* The process has nobody to start it again. */
void board_alive(void) {}

/* No pin here: a file's first byte, which a person or a test may watch. */
void board_alarm(bool on)
{
    if (alarm_file >= 0 && pwrite(alarm_file, on ? "1\n" : "0\n", 2, 0) != 2)
        host_fail("%s: %s", options.alarm, strerror(errno));
}

uint32_t board_time_us(void)
{
    return (uint32_t)(ticks * 1000000000u / facts.sample_mHz);
}

/* One sample; false when there are no more. */
static bool tick(void)
{
    uint16_t sensor_code;
    if (options.ticks > 0 && ticks == options.ticks)
        return false;
    if (!host_sensor_next(drive_code, &sensor_code))
        return false;
    ticks++;
    app_sample(sensor_code);
    return true;
}

/* A line that is full holds time up, so that a slow host loses nothing; not for ever: it may have stopped reading. */
static bool idle_virtual(void)
{
    enum { LONGEST_WAIT_MS = 200 };
    if (++turns < HOST_TURNS_PER_TICK)
        return true;
    if (!host_port_wait(LONGEST_WAIT_MS) && turns < 2 * HOST_TURNS_PER_TICK)
        return true;
    turns = 0;
    return tick();
}

/* Waits for the clock or the port; late ticks follow each other, with turns of the background loop between them. */
static bool idle_real(bool busy)
{
    uint64_t expired = 0;
    struct pollfd fds[2] = {{.fd = timer, .events = POLLIN}, {.fd = host_port_fd(), .events = POLLIN}};
    if (due == 0 && !busy)
        poll(fds, 2, 100);
    if (read(timer, &expired, sizeof expired) == (ssize_t)sizeof expired)
        due += expired;
    if (due == 0 || ++turns < HOST_TURNS_PER_TICK)
        return true;
    turns = 0;
    due--;
    return tick();
}

bool board_idle(bool busy)
{
    return !stopped && (options.is_virtual ? idle_virtual() : idle_real(busy));
}

int firmware_main(void); /* main() of firmware/main.c, renamed by the Makefile */

int main(int argc, char **argv)
{
    host_options_read(argc, argv, &options);
    const int status = firmware_main();
    host_port_close();
    explicit_bzero(key, sizeof key);
    explicit_bzero(session_key, sizeof session_key);
    return status;
}
