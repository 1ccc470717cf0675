/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Any bytes as a key file and as a device's identity: one of the two forms of a key, or refused and nothing kept. */
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "ground/ground.h"
#include "fuzz_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static const struct device_key none;
    char path[32], text[64], again[DEVICE_ID_TEXT];
    struct device_key key;
    struct bf_error err = {0};
    int fd = fuzz_file(data, n, path);
    if (fchmod(fd, 0600) != 0)
        abort();
    const enum bf_status status = device_key_read(path, &key, &err);
    close(fd);
    if (status == BF_OK ? n != 32 && (n < 64 || n > 66) : status != BF_BAD_FILE || memcmp(&key, &none, sizeof key) != 0)
        abort();
    uint8_t id[DEVICE_ID_BYTES];
    const size_t length = n < sizeof text - 1 ? n : sizeof text - 1;
    memcpy(text, data, length);
    text[length] = '\0';
    if (device_id_read(text, id, &err) != BF_OK)
        return 0;
    device_id_print(id, again);
    if (strcasecmp(again, text) != 0)
        abort();
    return 0;
}
