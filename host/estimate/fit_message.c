/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_message.h"

#include <stdlib.h>
#include <string.h>

void message_add(struct fit_message *message, const void *bytes, size_t n)
{
    if (n == 0)
        return;
    message->bytes = bf_grow(message->bytes, message->n + n, 1);
    memcpy(message->bytes + message->n, bytes, n);
    message->n += n;
}

enum bf_status message_take(const struct fit_message *message, size_t *at, void *bytes, size_t n, struct bf_error *err)
{
    if (n > message->n - *at)
        return bf_fail(err, BF_NUMERIC, "a share of the records answered with %zu bytes where more were due",
                       message->n);
    if (n > 0)
        memcpy(bytes, message->bytes + *at, n);
    *at += n;
    return BF_OK;
}
