/* SPDX-License-Identifier: MIT */
/* The one file of the firmware that sees BearSSL. */
#include "authentic.h"
#include <bearssl.h>

_Static_assert(sizeof(br_hmac_context) <= sizeof(struct authentic), "room for BearSSL's context");
_Static_assert(_Alignof(br_hmac_context) <= _Alignof(struct authentic), "alignment of BearSSL's context");

void authentic_begin(struct authentic *a, const uint8_t key[AUTHENTIC_KEY_BYTES])
{
    br_hmac_key_context prepared;
    br_hmac_key_init(&prepared, &br_sha256_vtable, key, AUTHENTIC_KEY_BYTES);
    br_hmac_init((br_hmac_context *)a->room, &prepared, 0);
    authentic_wipe(sizeof prepared, &prepared);
}

void authentic_feed(struct authentic *a, size_t n, const uint8_t bytes[])
{
    br_hmac_update((br_hmac_context *)a->room, bytes, n);
}

void authentic_end(struct authentic *a, uint8_t code[AUTHENTIC_CODE_BYTES])
{
    br_hmac_out((br_hmac_context *)a->room, code);
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
