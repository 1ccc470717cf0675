/* SPDX-License-Identifier: GPL-3.0-or-later */
/* request.h — what of a request decides whether it is answered. Private to serve/. */
#ifndef BEAMFIT_REQUEST_H
#define BEAMFIT_REQUEST_H

#include "serve.h"

/* A request as it came; NULL: there is no such header. */
struct raw_request {
    const char *method, *url, *host, *origin, *type;
    size_t n_body;
};

/* 0 and *out (without its body), or the HTTP status that it deserves: 400, 403, 404, 405, 413, 415. */
int request_judge(const struct raw_request *raw, const char token[SERVE_TOKEN], unsigned port,
                  struct serve_request *out);

#endif
