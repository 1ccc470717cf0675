/* SPDX-License-Identifier: MIT */
/*
 * host.h — the board on a PC, for demos and tests: a pseudo terminal as serial port, a file as flash, a plant at a socket,
 * or codes from a file, as the beam. Time is counted in ticks, so a busy PC is late but never misses a sample.
 */
#ifndef HOST_H
#define HOST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { HOST_NVM_SLOTS = 3, HOST_NVM_SLOT_BYTES = 8192, HOST_TURNS_PER_TICK = 8 };

struct host_options {
    const char *pty_link, *key, *unlock_key, *nvm, *plant, *replay, *alarm;
    uint8_t device[12];
    double sample_Hz;
    double core_MHz;    /* of the controller that the PC stands for */
    bool is_virtual;    /* as fast as the plant answers */
    uint64_t power_cut; /* die within this operation of the flash; 0: never */
    uint64_t ticks;     /* power down after so many; 0: never */
};

/* Exits with usage on a mistake. */
void host_options_read(int argc, char **argv, struct host_options *out);

/* The key of a file that only its owner can read: 32 bytes, or 64 hexadecimal digits. Exits with the reason. */
void host_key_read(const char *path, uint8_t key[32]);

/* The port. Exits with the reason. */
void host_port_open(const char *link);
void host_port_close(void);
int host_port_fd(void);
/* Until the port takes bytes again, at most so long; false: it still does not. */
bool host_port_wait(int ms);

/* Flash of three slots; path NULL: it is forgotten at the end. Exits with the reason. */
void host_nvm_open(const char *path, uint64_t power_cut);

/* Where sensor codes come from. Exits with the reason. */
void host_sensor_open(const char *plant, const char *replay);
/* The code acts from this tick on; false: the plant is gone or the file has ended. */
bool host_sensor_next(uint16_t drive_code, uint16_t *sensor_code);

_Noreturn void host_fail(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
