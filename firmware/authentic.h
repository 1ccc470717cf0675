/* SPDX-License-Identifier: MIT */
/* authentic.h — HMAC-SHA256 in slices: the code of an image, the seed of a session and its key. */
#ifndef AUTHENTIC_H
#define AUTHENTIC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { AUTHENTIC_KEY_BYTES = 32, AUTHENTIC_CODE_BYTES = 32 };

/* A computation under way; it holds what depends on the key, so authentic_end() wipes it. */
struct authentic {
    uint64_t room[16];
};

/* The key stays where it is until authentic_end(). */
void authentic_begin(struct authentic *a, const uint8_t key[AUTHENTIC_KEY_BYTES]);
void authentic_feed(struct authentic *a, size_t n, const uint8_t bytes[]);
void authentic_end(struct authentic *a, uint8_t code[AUTHENTIC_CODE_BYTES]);

/* Zeroes that the compiler does not leave out. */
void authentic_wipe(size_t n, void *bytes);

/* In a time that does not depend on the contents. */
bool authentic_equal(size_t n, const uint8_t a[], const uint8_t b[]);

#endif
