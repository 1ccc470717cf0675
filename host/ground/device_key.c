/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ground.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hash.h"

static int digit_of(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* 2 n digits; false when one is none. */
static bool read_hex(const char *text, size_t n, uint8_t out[])
{
    for (size_t i = 0; i < n; i++) {
        const int high = digit_of(text[2 * i]), low = high < 0 ? -1 : digit_of(text[2 * i + 1]);
        if (low < 0)
            return false;
        out[i] = (uint8_t)(high * 16 + low);
    }
    return true;
}

static enum bf_status check_owner(int fd, const char *path, struct bf_error *err)
{
    struct stat about;
    if (fstat(fd, &about) != 0)
        return bf_fail_at(err, path, 0, "cannot be read: %s; check the name and the permissions", strerror(errno));
    if (!S_ISREG(about.st_mode))
        return bf_fail_at(err, path, 0, "is no file; give a file that holds the device's key");
    if (about.st_uid != geteuid())
        return bf_fail_at(err, path, 0, "belongs to another user; a key must belong to whoever uses it (chown)");
    if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
        return bf_fail_at(err, path, 0, "can be used by others (mode %04o); run: chmod 600 %s", about.st_mode & 07777u,
                          path);
    return BF_OK;
}

static enum bf_status parse(const char *path, const char text[], size_t n, struct device_key *out, struct bf_error *err)
{
    if (n == DEVICE_KEY_BYTES) {
        memcpy(out->bytes, text, DEVICE_KEY_BYTES);
        return BF_OK;
    }
    const size_t digits = 2 * (size_t)DEVICE_KEY_BYTES;
    const bool ends = n == digits || (n == digits + 1 && text[digits] == '\n') ||
                      (n == digits + 2 && text[digits] == '\r' && text[digits + 1] == '\n');
    if (ends && read_hex(text, DEVICE_KEY_BYTES, out->bytes))
        return BF_OK;
    device_key_wipe(out);
    return bf_fail_at(err, path, 0, "is no key; it must hold 64 hexadecimal digits or 32 bytes, nothing else");
}

enum bf_status device_key_read(const char *path, struct device_key *out, struct bf_error *err)
{
    char text[2 * DEVICE_KEY_BYTES + 3]; /* one more than the longest key */
    size_t n = 0;
    ssize_t got = 0;
    memset(out, 0, sizeof *out);
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (fd < 0)
        return bf_fail_at(err, path, 0, "cannot be read: %s; check the name and the permissions", strerror(errno));
    outputs_note_input(path);
    enum bf_status status = check_owner(fd, path, err);
    while (status == BF_OK && n < sizeof text && (got = read(fd, text + n, sizeof text - n)) > 0)
        n += (size_t)got;
    if (status == BF_OK && got < 0)
        status = bf_fail_at(err, path, 0, "cannot be read: %s", strerror(errno));
    close(fd);
    if (status == BF_OK)
        status = parse(path, text, n, out, err);
    explicit_bzero(text, sizeof text);
    return status;
}

void device_key_wipe(struct device_key *key)
{
    explicit_bzero(key, sizeof *key);
}

void device_key_code(const struct device_key *key, const void *first, size_t n_first, const void *second,
                     size_t n_second, uint8_t code[DEVICE_CODE_BYTES])
{
    hash_hmac(key->bytes, sizeof key->bytes, first, n_first, second, n_second, code);
}

bool device_key_equal(const uint8_t a[], const uint8_t b[], size_t n)
{
    volatile uint8_t differs = 0;
    for (size_t i = 0; i < n; i++)
        differs |= a[i] ^ b[i];
    return differs == 0;
}

enum bf_status device_id_read(const char *text, uint8_t out[DEVICE_ID_BYTES], struct bf_error *err)
{
    if (strlen(text) != 2 * (size_t)DEVICE_ID_BYTES || !read_hex(text, DEVICE_ID_BYTES, out))
        return bf_fail(err, BF_USAGE,
                       "'%.40s' is no device identity; give its 24 hexadecimal digits (beamfit info prints them)",
                       text);
    return BF_OK;
}

void device_id_print(const uint8_t id[DEVICE_ID_BYTES], char text[DEVICE_ID_TEXT])
{
    for (size_t i = 0; i < DEVICE_ID_BYTES; i++)
        (void)snprintf(text + 2 * i, 3, "%02x", id[i]);
}
