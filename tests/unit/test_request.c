/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which requests of a browser are answered: token, host, origin, path, method, size; and fields of forms. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include "serve/request.h"

#define TOKEN "0123456789abcdef0123456789abcdef"
enum { PORT = 8765 };

static const struct raw_request good = {.method = "GET", .url = "/" TOKEN "/state", .host = "127.0.0.1:8765"};

static int judged(struct raw_request raw, struct serve_request *out)
{
    static const char token[SERVE_TOKEN] = TOKEN;
    return request_judge(&raw, token, PORT, out);
}

static void a_good_request(void **state)
{
    (void)state;
    struct serve_request request;
    struct raw_request raw = good;
    assert_int_equal(judged(raw, &request), 0);
    assert_string_equal(request.name, "state");
    assert_false(request.post);
    raw.url = "/" TOKEN "/";
    assert_int_equal(judged(raw, &request), 0);
    assert_string_equal(request.name, "");
    raw.host = "LocalHost:8765";
    raw.origin = "http://localhost:8765";
    assert_int_equal(judged(raw, &request), 0);
    raw.method = "POST";
    raw.url = "/" TOKEN "/add";
    raw.type = "application/x-www-form-urlencoded;charset=UTF-8";
    assert_int_equal(judged(raw, &request), 0);
    assert_true(request.post);
}

/* Each character of the token counts, and what is no token is 403 whatever else is wrong with it. */
static void a_wrong_token(void **state)
{
    (void)state;
    struct serve_request request;
    struct raw_request raw = good;
    char url[80];
    raw.url = url;
    for (size_t i = 1; i <= strlen(TOKEN); i++) {
        (void)snprintf(url, sizeof url, "%s", good.url);
        url[i] = url[i] == 'x' ? 'y' : 'x';
        assert_int_equal(judged(raw, &request), 403);
    }
    static const char *const urls[] = {
        "/", "/favicon.ico", "/0123", "/x" TOKEN "/", "//" TOKEN "/", "/x" TOKEN "/state"};
    for (size_t i = 0; i < sizeof urls / sizeof *urls; i++) {
        raw.url = urls[i];
        const int status = judged(raw, &request);
        assert_true(status == 403 || status == 400);
    }
}

/* A name of somebody else's that resolves to this machine (DNS rebinding), and pages of others. */
static void a_foreign_host_or_origin(void **state)
{
    (void)state;
    struct serve_request request;
    static const char *const hosts[] = {NULL,
                                        "",
                                        "evil.example:8765",
                                        "127.0.0.1",
                                        "127.0.0.1:8766",
                                        "127.0.0.1:87650",
                                        "127.0.0.1:8765.evil.example",
                                        "localhost",
                                        "[::1]:8765"};
    static const char *const origins[] = {
        "", "null", "http://evil.example", "https://127.0.0.1:8765", "http://127.0.0.1:8766", "127.0.0.1:8765"};
    for (size_t i = 0; i < sizeof hosts / sizeof *hosts; i++) {
        struct raw_request raw = good;
        raw.host = hosts[i];
        assert_int_equal(judged(raw, &request), 403);
    }
    for (size_t i = 0; i < sizeof origins / sizeof *origins; i++) {
        struct raw_request raw = good;
        raw.origin = origins[i];
        assert_int_equal(judged(raw, &request), 403);
    }
}

static void paths_reach_no_file(void **state)
{
    (void)state;
    struct serve_request request;
    static const char *const urls[] = {"/" TOKEN,
                                       "/" TOKEN "/../etc/passwd",
                                       "/" TOKEN "/a/b",
                                       "/" TOKEN "/State",
                                       "/" TOKEN "/state/",
                                       "/" TOKEN "/%2e%2e",
                                       "/" TOKEN "//",
                                       "/" TOKEN "/.",
                                       "/" TOKEN "/aaaaaaaaaaaaaaaaaaaaaaaa"};
    for (size_t i = 0; i < sizeof urls / sizeof *urls; i++) {
        struct raw_request raw = good;
        raw.url = urls[i];
        assert_int_equal(judged(raw, &request), 404);
    }
}

static void methods_and_bodies(void **state)
{
    (void)state;
    struct serve_request request;
    static const char *const methods[] = {"PUT", "DELETE", "HEAD", "OPTIONS", "get", ""};
    struct raw_request raw = good;
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        raw.method = methods[i];
        assert_int_equal(judged(raw, &request), 405);
    }
    raw.method = "POST";
    assert_int_equal(judged(raw, &request),
                     415); /* a form of another page's has this type too, but its origin is foreign */
    raw.type = "application/json";
    assert_int_equal(judged(raw, &request), 415);
    raw.type = "application/x-www-form-urlencoded";
    raw.n_body = SERVE_BODY;
    assert_int_equal(judged(raw, &request), 0);
    raw.n_body = SERVE_BODY + 1;
    assert_int_equal(judged(raw, &request), 413);
}

static bool field(const char *form, const char *name, char out[16])
{
    return form_field(form, strlen(form), name, out, 16);
}

static void fields_of_forms(void **state)
{
    (void)state;
    char out[16];
    assert_true(field("argument=a+b%2Fc", "argument", out));
    assert_string_equal(out, "a b/c");
    assert_true(field("x=1&argument=&y=2", "argument", out));
    assert_string_equal(out, "");
    assert_true(field("y=0123456789abcde", "y", out));
    assert_false(field("y=0123456789abcdef", "y", out)); /* no room for the NUL */
    assert_false(field("y=%", "y", out));
    assert_false(field("y=%4", "y", out));
    assert_false(field("y=%zz", "y", out));
    assert_false(field("y=%00", "y", out));
    assert_false(field("y=%0a", "y", out));
    assert_false(field("yy=1", "y", out));
    assert_false(field("", "y", out));
    assert_false(field("&&&", "y", out));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_request),           cmocka_unit_test(a_wrong_token),
        cmocka_unit_test(a_foreign_host_or_origin), cmocka_unit_test(paths_reach_no_file),
        cmocka_unit_test(methods_and_bodies),       cmocka_unit_test(fields_of_forms),
    };
    return cmocka_run_group_tests_name("request", tests, NULL, NULL);
}
