/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * serve.h — one page for the person at this machine: HTTP on 127.0.0.1 behind a random token. Knows nothing of beams.
 *
 *     server_start()    port, and who answers;  server_address() is what to open in a browser
 *     server_stop()     ends its thread
 *
 * Every request must name this machine in `Host` (and in `Origin`, where there is one) and begin its path with the token, which is compared in constant
 * time; else the answer is 403 and the handler is not asked. Paths are the token and one word of letters, so that no path reaches a file. Bodies
 * are forms (application/x-www-form-urlencoded) of at most SERVE_BODY bytes. Only serve.c sees libmicrohttpd.
 */
#ifndef BEAMFIT_SERVE_H
#define BEAMFIT_SERVE_H

#include <stdbool.h>
#include <stddef.h>

#include "ground/ground.h"

enum { SERVE_TOKEN = 33, SERVE_NAME = 24, SERVE_BODY = 16384, SERVE_ADDRESS = 80 };

struct serve_request {
    bool post;             /* else GET */
    char name[SERVE_NAME]; /* the word behind the token; "" for the page itself */
    const char *body;      /* [n] of a POST */
    size_t n;
};

struct serve_answer {
    int status;       /* of HTTP, 200 at first */
    const char *type; /* "application/json" at first */
    char *text;       /* from malloc(), freed after it was sent */
    size_t n;
};

/* Called on the server's thread, one request at a time. */
typedef void serve_handler(void *context, const struct serve_request *request, struct serve_answer *answer);

struct server;

/* port 0: any free one. policy: the Content-Security-Policy of every answer. BF_USAGE: the port is taken; BF_NUMERIC: no thread, no random numbers. */
enum bf_status server_start(unsigned port, const char *policy, serve_handler *handler, void *context,
                            struct server **out, struct bf_error *err);
void server_stop(struct server *server); /* NULL: nothing */

/* "http://127.0.0.1:PORT/TOKEN/" */
const char *server_address(const struct server *server);

/* The value of a field of a form, decoded, into out[size]; false when there is none, it does not fit, or is no text. */
bool form_field(const char *form, size_t n, const char *name, char *out, size_t size);

#endif
