/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <bearssl.h>
#include "ground.h"
#include "hash.h"

_Static_assert(sizeof(br_sha256_context) <= sizeof(struct hash), "struct hash must hold BearSSL's SHA-256 state");
_Static_assert(_Alignof(br_sha256_context) <= _Alignof(struct hash), "struct hash must be aligned for BearSSL");

void hash_start(struct hash *hash)
{
    br_sha256_context context;
    br_sha256_init(&context);
    memset(hash, 0, sizeof *hash);
    memcpy(hash->state, &context, sizeof context);
}

void hash_add(struct hash *hash, const void *data, size_t n)
{
    br_sha256_context context;
    memcpy(&context, hash->state, sizeof context);
    br_sha256_update(&context, data, n);
    memcpy(hash->state, &context, sizeof context);
}

void hash_end(struct hash *hash, char hex[65])
{
    static const char digits[] = "0123456789abcdef";
    unsigned char sum[br_sha256_SIZE];
    br_sha256_context context;
    memcpy(&context, hash->state, sizeof context);
    br_sha256_out(&context, sum);
    for (size_t i = 0; i < sizeof sum; i++) {
        hex[2 * i] = digits[sum[i] >> 4];
        hex[2 * i + 1] = digits[sum[i] & 15];
    }
    hex[64] = '\0';
}

void hash_sha256_hex(const void *data, size_t n, char hex[65])
{
    struct hash hash;
    hash_start(&hash);
    hash_add(&hash, data, n);
    hash_end(&hash, hex);
}

enum bf_status hash_file(const char *path, char hex[65], struct bf_error *err)
{
    hex[0] = '\0';
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return bf_fail_at(err, path, 0, "cannot be read: %s; check the name and the permissions", strerror(errno));
    struct hash hash;
    hash_start(&hash);
    char piece[65536];
    size_t n;
    while ((n = fread(piece, 1, sizeof piece, f)) > 0)
        hash_add(&hash, piece, n);
    int failed = ferror(f), error_number = errno;
    fclose(f);
    if (failed != 0)
        return bf_fail_at(err, path, 0, "cannot be read: %s; give a file, not a directory", strerror(error_number));
    hash_end(&hash, hex);
    return BF_OK;
}

void hash_hmac(const uint8_t *key, size_t key_bytes, const void *first, size_t n_first, const void *second,
               size_t n_second, uint8_t code[HASH_CODE_BYTES])
{
    br_hmac_key_context keyed;
    br_hmac_context context;
    br_hmac_key_init(&keyed, &br_sha256_vtable, key, key_bytes);
    br_hmac_init(&context, &keyed, HASH_CODE_BYTES);
    if (n_first > 0)
        br_hmac_update(&context, first, n_first);
    if (n_second > 0)
        br_hmac_update(&context, second, n_second);
    (void)br_hmac_out(&context, code);
    explicit_bzero(&keyed, sizeof keyed);
    explicit_bzero(&context, sizeof context);
}
