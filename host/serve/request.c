/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "request.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { TOKEN = SERVE_TOKEN - 1 };

/* In a time that does not depend on where they differ. text: at least TOKEN characters. */
static bool is_token(const char *text, const char token[SERVE_TOKEN])
{
    unsigned different = 0;
    for (int i = 0; i < TOKEN; i++)
        different |= (unsigned char)text[i] ^ (unsigned char)token[i];
    return different == 0;
}

/* "127.0.0.1:PORT" or "localhost:PORT", behind `scheme`: a name that somebody else has pointed here is not ours. */
static bool is_here(const char *text, const char *scheme, unsigned port)
{
    static const char *const names[] = {"127.0.0.1", "localhost"};
    char here[64];
    for (size_t i = 0; text != NULL && i < sizeof names / sizeof *names; i++) {
        (void)snprintf(here, sizeof here, "%s%s:%u", scheme, names[i], port);
        if (strcasecmp(text, here) == 0)
            return true;
    }
    return false;
}

static bool takes_name(const char *text, char name[SERVE_NAME])
{
    const size_t n = strlen(text);
    if (n >= SERVE_NAME || strspn(text, "abcdefghijklmnopqrstuvwxyz") != n)
        return false;
    memcpy(name, text, n + 1);
    return true;
}

static bool is_form(const char *type)
{
    static const char form[] = "application/x-www-form-urlencoded";
    return type != NULL && strncasecmp(type, form, sizeof form - 1) == 0;
}

int request_judge(const struct raw_request *raw, const char token[SERVE_TOKEN], unsigned port,
                  struct serve_request *out)
{
    enum { BAD = 400, FORBIDDEN = 403, NOT_FOUND = 404, NO_METHOD = 405, TOO_LARGE = 413, NO_FORM = 415 };
    *out = (struct serve_request){0};
    if (raw->url == NULL || raw->method == NULL || raw->url[0] != '/')
        return BAD;
    if (!is_here(raw->host, "", port) || (raw->origin != NULL && !is_here(raw->origin, "http://", port)))
        return FORBIDDEN;
    if (strlen(raw->url) < 1 + TOKEN || !is_token(raw->url + 1, token))
        return FORBIDDEN;
    out->post = strcmp(raw->method, "POST") == 0;
    if (!out->post && strcmp(raw->method, "GET") != 0)
        return NO_METHOD;
    if (raw->url[1 + TOKEN] != '/' || !takes_name(raw->url + 2 + TOKEN, out->name))
        return NOT_FOUND;
    if (raw->n_body > SERVE_BODY)
        return TOO_LARGE;
    return out->post && !is_form(raw->type) ? NO_FORM : 0;
}
