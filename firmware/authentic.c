/* SPDX-License-Identifier: MIT */
/* The one file of the firmware that sees BearSSL. */
#include "authentic.h"
#include <bearssl.h>

/* HMAC is two hashes; composed here, because BearSSL's own asks for 700 bytes more of stack: room for SHA-512. */
struct working {
    br_sha256_context hash;
    const uint8_t *key;
};
_Static_assert(sizeof(struct working) <= sizeof(struct authentic), "room for BearSSL's context");
_Static_assert(_Alignof(struct working) <= _Alignof(struct authentic), "alignment of BearSSL's context");

enum { BLOCK_BYTES = 64, PIECE_BYTES = 16, INNER = 0x36, OUTER = 0x5C };
_Static_assert((int)AUTHENTIC_CODE_BYTES == br_sha256_SIZE && (int)AUTHENTIC_KEY_BYTES <= (int)BLOCK_BYTES,
               "HMAC-SHA256");

/* A hash that begins with the key, filled with zeros to a block, each byte changed by `pad`. */
static void begin_hash(struct working *w, uint8_t pad)
{
    uint8_t piece[PIECE_BYTES];
    br_sha256_init(&w->hash);
    for (int at = 0; at < BLOCK_BYTES; at += PIECE_BYTES) {
        for (int i = 0; i < PIECE_BYTES; i++)
            piece[i] = (uint8_t)(pad ^ (at + i < AUTHENTIC_KEY_BYTES ? w->key[at + i] : 0));
        br_sha256_update(&w->hash, piece, sizeof piece);
    }
    authentic_wipe(sizeof piece, piece);
}

void authentic_begin(struct authentic *a, const uint8_t key[AUTHENTIC_KEY_BYTES])
{
    struct working *w = (struct working *)a->room;
    w->key = key;
    begin_hash(w, INNER);
}

void authentic_feed(struct authentic *a, size_t n, const uint8_t bytes[])
{
    br_sha256_update(&((struct working *)a->room)->hash, bytes, n);
}

void authentic_end(struct authentic *a, uint8_t code[AUTHENTIC_CODE_BYTES])
{
    struct working *w = (struct working *)a->room;
    br_sha256_out(&w->hash, code);
    begin_hash(w, OUTER);
    br_sha256_update(&w->hash, code, AUTHENTIC_CODE_BYTES);
    br_sha256_out(&w->hash, code);
    authentic_wipe(sizeof *a, a);
}

void authentic_wipe(size_t n, void *bytes)
{
    volatile uint8_t *at = bytes;
    for (size_t i = 0; i < n; i++)
        at[i] = 0;
}

bool authentic_equal(size_t n, const uint8_t a[], const uint8_t b[])
{
    volatile uint8_t different = 0;
    for (size_t i = 0; i < n; i++)
        different = (uint8_t)(different | (a[i] ^ b[i]));
    return different == 0;
}
