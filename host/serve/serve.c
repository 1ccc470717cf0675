/* SPDX-License-Identifier: GPL-3.0-or-later */
/* serve.c — libmicrohttpd: connections in, answers out. What may be answered is decided in request.c. */
#include "serve.h"

#include <arpa/inet.h>
#include <errno.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/random.h>

#include "request.h"

struct server {
    struct MHD_Daemon *daemon;
    serve_handler *handler;
    void *context;
    char *policy;
    _Atomic unsigned port; /* 0 until it is known: then no request is from here */
    char token[SERVE_TOKEN], address[SERVE_ADDRESS];
};

/* A body on its way; beyond SERVE_BODY only its length is kept. */
struct body {
    size_t n;
    char bytes[SERVE_BODY];
};

static enum MHD_Result send_answer(const struct server *server, struct MHD_Connection *connection,
                                   const struct serve_answer *answer)
{
    const char *const headers[][2] = {
        {"Content-Type", answer->type},
        {"Content-Security-Policy", server->policy},
        {"Cache-Control", "no-store"},
        {"X-Content-Type-Options", "nosniff"},
        {"Referrer-Policy", "no-referrer"},
        {"X-Frame-Options", "DENY"},
        {"Cross-Origin-Opener-Policy", "same-origin"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
    };
    struct MHD_Response *response = MHD_create_response_from_buffer(answer->n, answer->text, MHD_RESPMEM_MUST_FREE);
    if (response == NULL) {
        free(answer->text);
        return MHD_NO;
    }
    for (size_t i = 0; i < sizeof headers / sizeof *headers; i++)
        (void)MHD_add_response_header(response, headers[i][0], headers[i][1]);
    const enum MHD_Result sent = MHD_queue_response(connection, (unsigned)answer->status, response);
    MHD_destroy_response(response);
    return sent;
}

static enum MHD_Result refuse(const struct server *server, struct MHD_Connection *connection, int status)
{
    struct serve_answer answer = {.status = status, .type = "text/plain", .text = bf_strdup("refused\n"), .n = 8};
    return send_answer(server, connection, &answer);
}

static const char *header(struct MHD_Connection *connection, const char *name)
{
    return MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
}

static int judge(const struct server *server, struct MHD_Connection *connection, const char *url, const char *method,
                 size_t n_body, struct serve_request *request)
{
    const struct raw_request raw = {.method = method,
                                    .url = url,
                                    .host = header(connection, "Host"),
                                    .origin = header(connection, "Origin"),
                                    .type = header(connection, "Content-Type"),
                                    .n_body = n_body};
    return request_judge(&raw, server->token, server->port, request);
}

static enum MHD_Result answer_request(const struct server *server, struct MHD_Connection *connection,
                                      struct serve_request *request, const struct body *body)
{
    struct serve_answer answer = {.status = MHD_HTTP_OK, .type = "application/json"};
    request->body = body->bytes;
    request->n = body->n;
    server->handler(server->context, request, &answer);
    if (answer.text == NULL)
        answer.text = bf_strdup("");
    return send_answer(server, connection, &answer);
}

/* MHD calls this with the headers, with each piece of the body, and at its end. What is refused is so before its body comes. */
static enum MHD_Result on_request(void *context, struct MHD_Connection *connection, const char *url, const char *method,
                                  const char *version, const char *upload, size_t *n_upload, void **kept)
{
    struct server *server = context;
    struct body *body = *kept;
    struct serve_request request;
    (void)version;
    const int refused = judge(server, connection, url, method, body != NULL ? body->n : 0, &request);
    if (body == NULL && refused == 0) {
        *kept = bf_alloc(1, sizeof *body);
        return MHD_YES;
    }
    if (body != NULL && *n_upload > 0) {
        if (body->n + *n_upload <= SERVE_BODY)
            memcpy(body->bytes + body->n, upload, *n_upload);
        body->n = body->n + *n_upload <= SERVE_BODY ? body->n + *n_upload : SERVE_BODY + 1;
        *n_upload = 0;
        return MHD_YES;
    }
    return refused != 0 ? refuse(server, connection, refused) : answer_request(server, connection, &request, body);
}

static void on_end(void *context, struct MHD_Connection *connection, void **kept, enum MHD_RequestTerminationCode why)
{
    (void)context, (void)connection, (void)why;
    free(*kept);
    *kept = NULL;
}

static enum bf_status make_token(char token[SERVE_TOKEN], struct bf_error *err)
{
    unsigned char bytes[(SERVE_TOKEN - 1) / 2];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes)
        return bf_fail(err, BF_NUMERIC, "this machine gives no random numbers (%s)", strerror(errno));
    for (size_t i = 0; i < sizeof bytes; i++)
        (void)snprintf(token + 2 * i, 3, "%02x", bytes[i]);
    return BF_OK;
}

enum bf_status server_start(unsigned port, const char *policy, serve_handler *handler, void *context,
                            struct server **out, struct bf_error *err)
{
    enum { CONNECTIONS = 32, IDLE_S = 30, MEMORY = 65536 };
    const struct sockaddr_in here = {
        .sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    struct server *server = bf_alloc(1, sizeof *server);
    *server = (struct server){.handler = handler, .context = context, .policy = bf_strdup(policy)};
    *out = NULL;
    if (make_token(server->token, err) == BF_OK) {
        server->daemon =
            MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD, (uint16_t)port, NULL, NULL, on_request, server,
                             MHD_OPTION_SOCK_ADDR, &here, MHD_OPTION_CONNECTION_LIMIT, (unsigned)CONNECTIONS,
                             MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)IDLE_S, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                             (size_t)MEMORY, MHD_OPTION_NOTIFY_COMPLETED, on_end, NULL, MHD_OPTION_END);
        if (server->daemon == NULL)
            (void)bf_fail(err, BF_USAGE, "port %u of 127.0.0.1 cannot be used (%s); choose another with --port", port,
                          strerror(errno));
    }
    if (server->daemon == NULL) {
        server_stop(server);
        return err->status;
    }
    server->port = MHD_get_daemon_info(server->daemon, MHD_DAEMON_INFO_BIND_PORT)->port;
    (void)snprintf(server->address, sizeof server->address, "http://127.0.0.1:%u/%s/", server->port, server->token);
    *out = server;
    return BF_OK;
}

void server_stop(struct server *server)
{
    if (server == NULL)
        return;
    if (server->daemon != NULL)
        MHD_stop_daemon(server->daemon);
    free(server->policy);
    free(server);
}

const char *server_address(const struct server *server)
{
    return server->address;
}
