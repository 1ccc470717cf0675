/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "show/html.h"
#include "show/page_assets.h"
#include "test_files.h"

/* What was written to `f` of open_memstream(). */
struct sink {
    FILE *f;
    char *text;
    size_t n;
};

static void sink_open(struct sink *s)
{
    *s = (struct sink){0};
    s->f = open_memstream(&s->text, &s->n);
    assert_non_null(s->f);
}

static void sink_is(struct sink *s, const char *wanted)
{
    assert_int_equal(fclose(s->f), 0);
    assert_string_equal(s->text, wanted);
    free(s->text);
}

static void text_is(const char *text, const char *wanted)
{
    struct sink s;
    sink_open(&s);
    html_text(s.f, text);
    sink_is(&s, wanted);
}

static void markup_is_text(void **state)
{
    (void)state;
    text_is("<script>alert(1)</script>", "&lt;script&gt;alert(1)&lt;/script&gt;");
    text_is("a\" onload='x' & b", "a&quot; onload=&#39;x&#39; &amp; b");
    text_is("&lt;", "&amp;lt;");
    text_is("--><!--", "--&gt;&lt;!--");
    text_is("", "");
    text_is("N·m² → φ(ℓ) 漢 𝄞", "N·m² → φ(ℓ) 漢 𝄞"); /* one, two, three, four bytes */
}

#define BAD "\xEF\xBF\xBD" /* U+FFFD */

static void what_is_no_text_is_marked(void **state)
{
    (void)state;
    text_is("a\tb\nc\rd\x01", "a b c" BAD "d" BAD);
    text_is("\x80x", BAD "x");                        /* a continuation alone */
    text_is("\xC0\xBCscript>", BAD BAD "script&gt;"); /* '<' in two bytes */
    text_is("\xE0\x80\xBC", BAD BAD BAD);             /* and in three */
    text_is("\xED\xA0\x80", BAD BAD BAD);             /* a surrogate */
    text_is("\xF4\x90\x80\x80", BAD BAD BAD BAD);     /* beyond U+10FFFF */
    text_is("\xC3<", BAD "&lt;");                     /* cut short: what follows stays markup-free */
    text_is("\xE2\x82", BAD BAD);                     /* cut by the end */
    const char override[] = {'g', 'p', 'j', '.', '\xE2', '\x80', '\xAE', 'e', 'x', 'e', '\0'}; /* right to left */
    text_is(override, "gpj." BAD "exe");
    text_is("\xC2\x85", BAD); /* a control character of two bytes */
    text_is("\x7F", BAD);
}

static void formatted_text_of_any_length(void **state)
{
    (void)state;
    struct sink s;
    char longer[5001];
    memset(longer, '<', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    sink_open(&s);
    html_textf(s.f, "%s%d", longer, 7);
    assert_int_equal(fclose(s.f), 0);
    assert_int_equal(s.n, 4 * 5000 + 1);
    assert_string_equal(s.text + s.n - 5, "&lt;7");
    free(s.text);
}

static void names_break_where_they_are_long(void **state)
{
    (void)state;
    struct sink s;
    sink_open(&s);
    html_name(s.f, "tap_1.csv");
    sink_is(&s, "tap_1.csv");
    sink_open(&s);
    html_name(s.f, "recordings/day_two/a<b-0123456789012345678901234567.csv");
    sink_is(&s, "recordings/<wbr>day_<wbr>two/<wbr>a&lt;b-<wbr>012345678901234567890123<wbr>4567.csv");
}

/* RFC 4648, section 10, and the bytes at both ends of the alphabet. */
static void base64_vectors(void **state)
{
    (void)state;
    static const struct {
        const char *bytes;
        size_t n;
        const char *text;
    } vectors[] = {{"", 0, ""},
                   {"f", 1, "Zg=="},
                   {"fo", 2, "Zm8="},
                   {"foo", 3, "Zm9v"},
                   {"foob", 4, "Zm9vYg=="},
                   {"fooba", 5, "Zm9vYmE="},
                   {"foobar", 6, "Zm9vYmFy"},
                   {"\0\0\0", 3, "AAAA"},
                   {"\xFF\xFF\xFF", 3, "////"},
                   {"\xFB\xEF\xBE", 3, "++++"},
                   {"\xFF", 1, "/w=="}};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        struct sink s;
        sink_open(&s);
        html_base64(s.f, vectors[i].bytes, vectors[i].n);
        sink_is(&s, vectors[i].text);
    }
}

static void number_is(double x, double factor, const char *format, const char *wanted)
{
    struct sink s;
    sink_open(&s);
    html_number(s.f, x, factor, format);
    sink_is(&s, wanted);
}

static void numbers_as_a_person_writes_them(void **state)
{
    (void)state;
    number_is(0.25, 100.0, "%.3g %%", "<data value=\"0.25\">25 %</data>");
    number_is(-0.5, 1.0, "%.1f V", "<data value=\"-0.5\">−0.5 V</data>");
    number_is(6.5e-6, 1.0, "%.3g", "<data value=\"6.4999999999999996e-06\">6.5 × 10<sup>−6</sup></data>");
    number_is(-2e7, 1.0, "%.3g N/m", "<data value=\"-20000000\">−2 × 10<sup>7</sup> N/m</data>");
    number_is(4e-9, 1.0, "± %.2g", "<data value=\"4.0000000000000002e-09\">± 4 × 10<sup>−9</sup></data>");
    number_is(1.0, 1.0, "%.3g metre-like", "<data value=\"1\">1 metre-like</data>"); /* an 'e' that is no exponent */
    number_is(1.0, 1.0, "%.3g <V>", "<data value=\"1\">1 &lt;V&gt;</data>");
    number_is((double)NAN, 1.0, "%.3g", "–");
    number_is((double)INFINITY, 1.0, "%.3g", "–");
}

static void tables(void **state)
{
    (void)state;
    struct sink s;
    sink_open(&s);
    html_table_begin(s.f, "id", "A & B|>Value (<V>)|Last");
    html_cell(s.f, "%s", "<td>");
    html_number_cell(s.f, 2.0, 1.0, "%g");
    html_table_end(s.f);
    sink_is(&s,
            "<div class=\"scroll\"><table id=\"id\">\n"
            "<thead><tr><th>A &amp; B</th><th class=\"n\">Value (&lt;V&gt;)</th><th>Last</th></tr></thead>\n<tbody>\n"
            "<td>&lt;td&gt;</td><td class=\"n\"><data value=\"2\">2</data></td></tbody></table></div>\n");
}

static void a_page_loads_nothing(void **state)
{
    (void)state;
    struct sink s;
    sink_open(&s);
    static const char *const scripts[] = {"start.js", NULL};
    html_begin(s.f, "</title><script>", "p\"q", scripts, false);
    html_end(s.f);
    assert_int_equal(fclose(s.f), 0);
    assert_int_equal(strncmp(s.text, "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n", 62), 0);
    assert_contains(s.text, "<title>&lt;/title&gt;&lt;script&gt;</title>");
    assert_contains(s.text, "content=\"p&quot;q\"");
    assert_contains(s.text, "default-src 'none'");
    assert_contains(s.text, "script-src 'sha256-");
    assert_null(strstr(s.text, "connect-src"));
    assert_contains(s.text, "@media print");
    assert_null(strstr(s.text, "http:"));
    assert_null(strstr(s.text, "url("));
    assert_null(strstr(s.text, "<link"));
    assert_string_equal(s.text + s.n - 16, "</body>\n</html>\n");
    free(s.text);
}

/* Data cannot end its element, whatever a name in it is. */
static void data_stays_data(void **state)
{
    (void)state;
    struct sink s;
    struct json *tree = json_new_object();
    json_put_text(tree, "name", "</script><script>alert(1)</script>");
    sink_open(&s);
    html_data(s.f, "id", tree);
    assert_int_equal(fclose(s.f), 0);
    assert_contains(s.text, "<script type=\"application/json\" id=\"id\">{");
    assert_contains(s.text, "\\u003c/script>\\u003cscript>alert(1)\\u003c/script>");
    assert_int_equal(strlen(strstr(s.text, "</script>")), strlen("</script>\n"));
    free(s.text);
}

/* SHA-256 of each script as Content Security Policy 3 wants it. */
static void a_policy_names_scripts(void **state)
{
    (void)state;
    static const char *const scripts[] = {"curves.js", "start.js", NULL};
    struct sink s;
    sink_open(&s);
    page_policy(s.f, scripts);
    assert_int_equal(fclose(s.f), 0);
    assert_int_equal(strlen(s.text), strlen("script-src") + 2 * (strlen(" 'sha256-'") + 44));
    free(s.text);
}

static void scripts_are_written_whole(void **state)
{
    (void)state;
    static const char *const scripts[] = {"curves.js", "start.js", NULL};
    struct sink s;
    sink_open(&s);
    page_scripts(s.f, scripts);
    assert_int_equal(fclose(s.f), 0);
    assert_int_equal(strncmp(s.text, "<script>/* SPDX", 15), 0);
    assert_contains(s.text, "Explore.show(");
    free(s.text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(markup_is_text),
        cmocka_unit_test(what_is_no_text_is_marked),
        cmocka_unit_test(formatted_text_of_any_length),
        cmocka_unit_test(names_break_where_they_are_long),
        cmocka_unit_test(base64_vectors),
        cmocka_unit_test(numbers_as_a_person_writes_them),
        cmocka_unit_test(tables),
        cmocka_unit_test(a_page_loads_nothing),
        cmocka_unit_test(data_stays_data),
        cmocka_unit_test(a_policy_names_scripts),
        cmocka_unit_test(scripts_are_written_whole),
    };
    return cmocka_run_group_tests_name("html", tests, NULL, NULL);
}
