/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Requests to `beamfit watch`: five lines (method, url, host, origin, type), and a form behind them. Nobody without the token gets in. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "serve/request.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char token[SERVE_TOKEN] = "0123456789abcdef0123456789abcdef";
    char *text = malloc(size + 1), *rest = text, *lines[5] = {0}, value[40];
    struct serve_request request;
    if (text == NULL)
        return 0;
    memcpy(text, data, size);
    text[size] = '\0';
    for (int i = 0; i < 5 && rest != NULL; i++)
        lines[i] = strsep(&rest, "\n");
    const size_t n = rest != NULL ? (size_t)(text + size - rest) : 0;
    const struct raw_request raw = {lines[0], lines[1], lines[2], lines[3], lines[4], n};
    if (request_judge(&raw, token, 8765, &request) == 0) {
        assert(strncmp(lines[1] + 1, token, SERVE_TOKEN - 1) == 0);
        assert(strpbrk(request.name, "/.%\\") == NULL);
    }
    if (rest != NULL && form_field(rest, n, "argument", value, sizeof value))
        assert(strlen(value) < sizeof value);
    free(text);
    return 0;
}
