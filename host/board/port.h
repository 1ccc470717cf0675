/* SPDX-License-Identifier: GPL-3.0-or-later */
/* port.h — a serial port opened, read and written. */
#ifndef BEAMFIT_PORT_H
#define BEAMFIT_PORT_H

#include "board.h"

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

#endif
