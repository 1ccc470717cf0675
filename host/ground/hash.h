/* SPDX-License-Identifier: GPL-3.0-or-later */
/* hash.h — the keyed hash behind device_key.c. */
#ifndef BEAMFIT_HASH_H
#define BEAMFIT_HASH_H

#include "ground.h"

/* HMAC-SHA256 (RFC 2104) of two pieces in a row; a NULL piece has n 0. */
enum { HASH_CODE_BYTES = 32 };
void hash_hmac(const uint8_t *key, size_t key_bytes, const void *first, size_t n_first, const void *second,
               size_t n_second, uint8_t code[HASH_CODE_BYTES]);

#endif
