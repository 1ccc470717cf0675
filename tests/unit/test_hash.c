/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "ground/ground.h"
#include "test_files.h"

static void agrees_with_the_standard_vectors(void **state)
{
    (void)state;
    static const struct {
        const char *text, *hex;
    } vectors[] = {/* FIPS 180-2, appendix B, and the empty message */
                   {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
                   {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
                   {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
                    "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"}};
    char hex[65];
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        hash_sha256_hex(vectors[i].text, strlen(vectors[i].text), hex);
        assert_string_equal(hex, vectors[i].hex);
    }
}

/* A million times 'a' (FIPS 180-2, B.3), in pieces of every length, and from a file. */
static void pieces_and_files_give_the_same(void **state)
{
    (void)state;
    enum { N = 1000000 };
    static const char expected[] = "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0";
    char *data = malloc(N), hex[65];
    struct hash hash;
    struct bf_error err;
    memset(data, 'a', N);
    hash_start(&hash);
    for (size_t at = 0, piece = 0; at < N; at += piece, piece = (piece * 7 + 1) % 1000) {
        piece = at + piece < N ? piece : N - at;
        hash_add(&hash, data + at, piece);
    }
    hash_end(&hash, hex);
    assert_string_equal(hex, expected);
    char *path = temporary_file("million", data, N);
    assert_int_equal(hash_file(path, hex, &err), BF_OK);
    assert_string_equal(hex, expected);
    unlink(path);
    free(path);
    free(data);
}

static void a_copy_forks_a_hash(void **state)
{
    (void)state;
    struct hash one, two;
    char hex1[65], hex2[65];
    hash_start(&one);
    hash_add(&one, "ab", 2);
    two = one;
    hash_add(&one, "c", 1);
    hash_add(&two, "d", 1);
    hash_end(&one, hex1);
    hash_end(&two, hex2);
    assert_string_equal(hex1, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_string_not_equal(hex1, hex2);
}

static void unreadable_files_are_bad_files(void **state)
{
    (void)state;
    char hex[65] = "x";
    struct bf_error err;
    assert_int_equal(hash_file("/nonexistent", hex, &err), BF_BAD_FILE);
    assert_string_equal(hex, "");
    assert_contains(err.text, "/nonexistent: ");
    assert_int_equal(hash_file("/tmp", hex, &err), BF_BAD_FILE);
    assert_contains(err.text, "directory");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_the_standard_vectors),
        cmocka_unit_test(pieces_and_files_give_the_same),
        cmocka_unit_test(a_copy_forks_a_hash),
        cmocka_unit_test(unreadable_files_are_bad_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
