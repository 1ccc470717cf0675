/* SPDX-License-Identifier: GPL-3.0-or-later */
/* hash.h — SHA-256 of bytes and files, as 64 lower-case hexadecimal digits, and HMAC-SHA256. Only hash.c sees BearSSL. */
#ifndef BEAMFIT_HASH_H
#define BEAMFIT_HASH_H

#include <stddef.h>
#include <stdint.h>
#include "error.h"

void hash_sha256_hex(const void *data, size_t n, char hex[65]);

/* Piece by piece: start, any number of add, end. Plain memory: copy it to fork a hash. */
struct hash {
    uint64_t state[16];
};
void hash_start(struct hash *hash);
void hash_add(struct hash *hash, const void *data, size_t n);
void hash_end(struct hash *hash, char hex[65]);

/* BF_BAD_FILE when the file cannot be read; hex is "" then. */
enum bf_status hash_file(const char *path, char hex[65], struct bf_error *err);

/* HMAC-SHA256 (RFC 2104) of two pieces in a row; a NULL piece has n 0. */
enum { HASH_CODE_BYTES = 32 };
void hash_hmac(const uint8_t *key, size_t key_bytes, const void *first, size_t n_first, const void *second,
               size_t n_second, uint8_t code[HASH_CODE_BYTES]);

#endif
