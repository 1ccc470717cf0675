/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * port.h — a serial port as bytes with deadlines: 8 data bits, no parity, 1 stop bit, no flow control.
 *
 * Two back ends: libserialport for real ports (port_serial.c), termios for the pseudo terminals of emulated boards
 * (port_pty.c), which libserialport cannot open. A path that leads to /dev/pts is a pseudo terminal. One program at a
 * time: the port is locked. Every failure is BF_DEVICE with a text that says what to do.
 */
#ifndef BEAMFIT_PORT_H
#define BEAMFIT_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "ground/error.h"

enum { PORT_BAUD = 115200 };

struct port;

/* On failure *out is NULL. baud: bit/s, > 0; a pseudo terminal takes any and has none. */
enum bf_status port_open(const char *path, long baud, struct port **out, struct bf_error *err);
/* NULL does nothing. */
void port_close(struct port *port);

/*
 * Up to n bytes, as soon as there are any: *got = 0 after timeout_ms (0: look and return) or a signal. The far end gone
 * (cable out, board's program ended) is BF_DEVICE.
 */
enum bf_status port_read(struct port *port, size_t n, uint8_t out[], size_t *got, int timeout_ms, struct bf_error *err);
/* All n bytes, however many pieces it takes, or BF_DEVICE after timeout_ms (> 0). */
enum bf_status port_write(struct port *port, size_t n, const uint8_t bytes[], int timeout_ms, struct bf_error *err);
/* Forgets what has arrived and was not read, and what was not sent yet. */
enum bf_status port_flush(struct port *port, struct bf_error *err);

const char *port_path(const struct port *port);
long port_baud(const struct port *port);
bool port_is_pty(const struct port *port);

/* "; ports here: /dev/ttyUSB0 (FT232R), …" or that none was found, cut to size: the end of a message. */
void port_list(size_t size, char text[]);

/* Milliseconds of a clock that never jumps. */
int64_t port_clock_ms(void);

#endif
