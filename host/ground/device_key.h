/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * device_key.h — the secret that a controller and the owner of its models share, and what it signs. The key comes from
 * a file that nobody but its owner can read, never from the command line; wipe it after use.
 */
#ifndef BEAMFIT_DEVICE_KEY_H
#define BEAMFIT_DEVICE_KEY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "error.h"

enum { DEVICE_KEY_BYTES = 32, DEVICE_CODE_BYTES = 32, DEVICE_ID_BYTES = 12, DEVICE_ID_TEXT = 2 * DEVICE_ID_BYTES + 1 };

struct device_key {
    uint8_t bytes[DEVICE_KEY_BYTES];
};

/*
 * A file of 32 raw bytes, or of 64 hexadecimal digits and at most a line end. BF_BAD_FILE when it holds anything else,
 * is no regular file, belongs to another user, or can be read or written by group or others.
 */
enum bf_status device_key_read(const char *path, struct device_key *out, struct bf_error *err);
void device_key_wipe(struct device_key *key);

/* HMAC-SHA256 of two pieces in a row; a NULL piece has n 0. */
void device_key_code(const struct device_key *key, const void *first, size_t n_first, const void *second,
                     size_t n_second, uint8_t code[DEVICE_CODE_BYTES]);

/* In a time that depends on n only. */
bool device_key_equal(const uint8_t a[], const uint8_t b[], size_t n);

/* Identity of a controller from 24 hexadecimal digits, and back. BF_USAGE. */
enum bf_status device_id_read(const char *text, uint8_t out[DEVICE_ID_BYTES], struct bf_error *err);
void device_id_print(const uint8_t id[DEVICE_ID_BYTES], char text[DEVICE_ID_TEXT]);

#endif
