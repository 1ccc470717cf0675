/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Any bytes as a list of measured frequencies: refused with one line of text, or ascending frequencies with errors below them. */
#include <math.h>
#include <string.h>
#include "fuzz_file.h"
#include "record/record.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    char path[32];
    struct frequency_list list;
    struct bf_error err = {0};
    const int fd = fuzz_file(data, n, path);
    const enum bf_status status = frequency_list_read(path, &list, &err);
    close(fd);
    if (status != BF_OK) {
        if (status != BF_BAD_FILE || err.text[0] == '\0' || strchr(err.text, '\n') != NULL || list.modes != NULL)
            abort();
        return 0;
    }
    double before_Hz = 0.0;
    for (size_t i = 0; i < list.n; before_Hz = list.modes[i++].frequency_Hz)
        if (!(list.modes[i].frequency_Hz > before_Hz && isfinite(list.modes[i].frequency_Hz)) ||
            !(list.modes[i].sd_Hz >= 0.0 && list.modes[i].sd_Hz < list.modes[i].frequency_Hz))
            abort();
    if (list.n == 0 || list.n > FREQUENCY_LIST_MOST)
        abort();
    frequency_list_free(&list);
    return 0;
}
