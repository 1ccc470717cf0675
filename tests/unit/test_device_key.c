/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Key files, HMAC-SHA256, device identities. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <sys/stat.h>

#include "ground/ground.h"
#include "ground/hash.h"
#include "test_files.h"

static const char digits[] = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F";

/* Status of reading this content with this mode; the key in *key, the message in text. */
static enum bf_status read_as(const void *content, size_t n, mode_t mode, struct device_key *key, char text[256])
{
    struct bf_error err = {BF_OK, ""};
    char *path = temporary_file("some.key", content, n);
    assert_int_equal(chmod(path, mode), 0);
    const enum bf_status status = device_key_read(path, key, &err);
    snprintf(text, 256, "%.255s", err.text);
    unlink(path);
    free(path);
    return status;
}

static void both_forms(void **state)
{
    struct device_key key;
    uint8_t raw[DEVICE_KEY_BYTES];
    char text[256], line[80];
    (void)state;
    for (int i = 0; i < DEVICE_KEY_BYTES; i++)
        raw[i] = (uint8_t)i;
    assert_int_equal(read_as(raw, sizeof raw, 0600, &key, text), BF_OK);
    assert_memory_equal(key.bytes, raw, sizeof raw);
    static const char *const ends[] = {"", "\n", "\r\n"};
    for (int i = 0; i < 3; i++) {
        const int n = snprintf(line, sizeof line, "%s%s", digits, ends[i]);
        assert_int_equal(read_as(line, (size_t)n, 0400, &key, text), BF_OK);
        assert_memory_equal(key.bytes, raw, sizeof raw);
    }
    device_key_wipe(&key);
    for (int i = 0; i < DEVICE_KEY_BYTES; i++)
        assert_int_equal(key.bytes[i], 0);
}

static void what_others_could_read_is_refused(void **state)
{
    struct device_key key;
    char text[256];
    (void)state;
    static const mode_t bad[] = {0644, 0640, 0620, 0610, 0604, 0602, 0601, 0660, 0777};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(read_as(digits, 64, bad[i], &key, text), BF_BAD_FILE);
        assert_contains(text, "chmod 600");
        assert_int_equal(key.bytes[5], 0);
    }
    static const mode_t good[] = {0600, 0400, 0700};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        assert_int_equal(read_as(digits, 64, good[i], &key, text), BF_OK);
}

static void what_is_no_key(void **state)
{
    struct device_key key;
    char text[256], wrong[80];
    (void)state;
    snprintf(wrong, sizeof wrong, "%s", digits);
    wrong[63] = 'g';
    assert_int_equal(read_as(wrong, 64, 0600, &key, text), BF_BAD_FILE);
    assert_int_equal(key.bytes[0] | key.bytes[1] | key.bytes[5], 0); /* nothing of it is left */
    static const size_t sizes[] = {0, 1, 31, 33, 63, 65, 66, 67, 200};
    char long_text[200];
    memset(long_text, 'a', sizeof long_text);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        assert_int_equal(read_as(long_text, sizes[i], 0600, &key, text), BF_BAD_FILE);
    assert_contains(text, "64 hexadecimal digits or 32 bytes");
    struct bf_error err;
    assert_int_equal(device_key_read("/nowhere/at/all", &key, &err), BF_BAD_FILE);
    assert_int_equal(device_key_read("/tmp", &key, &err), BF_BAD_FILE);
    assert_int_equal(device_key_read("/dev/zero", &key, &err), BF_BAD_FILE); /* a device, not a file */
}

/* RFC 4231, test cases 1, 3 and 6. */
static void hmac_vectors(void **state)
{
    static const struct {
        int key_byte;
        size_t key_bytes;
        const char *data;
        int data_byte;
        size_t data_bytes;
        const char *code;
    } cases[] = {
        {0x0b, 20, "Hi There", 0, 8, "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7"},
        {0xaa, 20, NULL, 0xdd, 50, "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe"},
        {0xaa, 131, "Test Using Larger Than Block-Size Key - Hash Key First", 0, 54,
         "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t key[131], data[64], code[HASH_CODE_BYTES];
        char hex[2 * HASH_CODE_BYTES + 1];
        memset(key, cases[i].key_byte, sizeof key);
        memset(data, cases[i].data_byte, sizeof data);
        if (cases[i].data)
            memcpy(data, cases[i].data, cases[i].data_bytes);
        for (size_t cut = 0; cut <= cases[i].data_bytes; cut += 4) { /* in two pieces alike */
            hash_hmac(key, cases[i].key_bytes, cut ? data : NULL, cut, data + cut, cases[i].data_bytes - cut, code);
            for (int b = 0; b < HASH_CODE_BYTES; b++)
                snprintf(hex + 2 * b, 3, "%02x", code[b]);
            assert_string_equal(hex, cases[i].code);
        }
    }
}

static void codes_and_equality(void **state)
{
    struct device_key key = {{0}};
    uint8_t a[DEVICE_CODE_BYTES], b[DEVICE_CODE_BYTES];
    (void)state;
    for (int i = 0; i < DEVICE_KEY_BYTES; i++)
        key.bytes[i] = (uint8_t)(3 * i);
    device_key_code(&key, "seed", 4, NULL, 0, a);
    hash_hmac(key.bytes, DEVICE_KEY_BYTES, "se", 2, "ed", 2, b);
    assert_true(device_key_equal(a, b, sizeof a));
    for (size_t i = 0; i < sizeof a; i++) {
        b[i] ^= 0x80;
        assert_false(device_key_equal(a, b, sizeof a));
        assert_true(device_key_equal(a, b, i));
        b[i] ^= 0x80;
    }
}

static void identities(void **state)
{
    uint8_t id[DEVICE_ID_BYTES];
    char text[DEVICE_ID_TEXT];
    struct bf_error err;
    (void)state;
    assert_int_equal(device_id_read("0123456789abcdefABCDEF00", id, &err), BF_OK);
    device_id_print(id, text);
    assert_string_equal(text, "0123456789abcdefabcdef00");
    static const char *const wrong[] = {"",
                                        "0123",
                                        "0123456789abcdef0123456",
                                        "0123456789abcdef012345678",
                                        "0123456789abcdef0123456x",
                                        "0x23456789abcdef01234567"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_int_equal(device_id_read(wrong[i], id, &err), BF_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_forms),         cmocka_unit_test(what_others_could_read_is_refused),
        cmocka_unit_test(what_is_no_key),     cmocka_unit_test(hmac_vectors),
        cmocka_unit_test(codes_and_equality), cmocka_unit_test(identities),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
