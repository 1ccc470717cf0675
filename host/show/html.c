/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "html.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "page_assets.h"

/* ---- Text ---- */

/* One character of UTF-8 at *text, which moves behind it; a byte that begins none is U+FFFD. */
static uint32_t next_character(const unsigned char **text)
{
    static const uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000}; /* of so many bytes: no character has two forms */
    const unsigned char *s = *text, first = *s;
    const int n = first < 0x80 ? 1 : first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
    uint32_t c = n == 1 ? first : first & (0x7FU >> n);
    int k = 1;
    for (; k < n && (s[k] & 0xC0U) == 0x80U; k++)
        c = c << 6 | (s[k] & 0x3FU);
    const bool whole = n > 0 && k == n && c >= least[n] && c <= 0x10FFFF && !(c >= 0xD800 && c < 0xE000);
    *text += whole ? n : 1;
    return whole ? c : 0xFFFD;
}

static bool unprintable(uint32_t c)
{
    return c < 0x20 || (c >= 0x7F && c < 0xA0) || (c >= 0x200E && c <= 0x200F) || (c >= 0x2028 && c <= 0x202E) ||
           (c >= 0x2066 && c <= 0x2069) || (c & 0xFFFE) == 0xFFFE;
}

static void write_text(FILE *out, const char *text, bool breaks)
{
    enum { LONG_WORD = 24 };
    breaks = breaks && text_width(text) > LONG_WORD;
    const unsigned char *s = (const unsigned char *)text;
    int since_break = 0;
    while (*s != '\0') {
        const unsigned char *start = s;
        const uint32_t c = next_character(&s);
        if (c == '&')
            (void)fputs("&amp;", out);
        else if (c == '<')
            (void)fputs("&lt;", out);
        else if (c == '>')
            (void)fputs("&gt;", out);
        else if (c == '"')
            (void)fputs("&quot;", out);
        else if (c == '\'')
            (void)fputs("&#39;", out);
        else if (c == '\t' || c == '\n')
            (void)fputc(' ', out);
        else if (c == 0xFFFD || unprintable(c))
            (void)fputs("\xEF\xBF\xBD", out);
        else
            (void)fwrite(start, 1, (size_t)(s - start), out);
        since_break++;
        if (breaks && *s != '\0' && (c == '/' || c == '_' || c == '-' || since_break == LONG_WORD)) {
            (void)fputs("<wbr>", out);
            since_break = 0;
        }
    }
}

void html_text(FILE *out, const char *text)
{
    write_text(out, text, false);
}

void html_name(FILE *out, const char *name)
{
    write_text(out, name, true);
}

static void text_of(FILE *out, const char *format, va_list args)
{
    va_list again;
    va_copy(again, args);
    const int n = vsnprintf(NULL, 0, format, args);
    char *text = bf_alloc(n > 0 ? (size_t)n + 1 : 1, 1);
    if (n > 0)
        (void)vsnprintf(text, (size_t)n + 1, format, again);
    va_end(again);
    html_text(out, text);
    free(text);
}

void html_textf(FILE *out, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    text_of(out, format, args);
    va_end(args);
}

/* ---- The page ---- */

void html_policy(FILE *out, const char *const scripts[], bool live)
{
    (void)fputs("default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; ",
                out);
    page_policy(out, scripts);
    (void)fputs(live ? "; connect-src 'self'" : "", out);
}

void html_begin(FILE *out, const char *title, const char *program, const char *const scripts[], bool live)
{
    (void)fputs("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                "<meta http-equiv=\"Content-Security-Policy\" content=\"",
                out);
    html_policy(out, scripts, live);
    (void)fputs("\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                "<meta name=\"color-scheme\" content=\"light dark\">\n<meta name=\"generator\" content=\"",
                out);
    html_text(out, program);
    (void)fputs("\">\n<title>", out);
    html_text(out, title);
    (void)fputs("</title>\n", out);
    if (live) /* a browser asks for an icon otherwise */
        (void)fputs("<link rel=\"icon\" href=\"data:,\">\n", out);
    (void)fputs("<style>\n", out);
    page_styles(out);
    (void)fputs("</style>\n</head>\n<body>\n", out);
}

void html_end(FILE *out)
{
    (void)fputs("</body>\n</html>\n", out);
}

/* ---- Tables ---- */

void html_table_begin(FILE *out, const char *id, const char *headings)
{
    (void)fprintf(out, "<div class=\"scroll\"><table id=\"%s\">\n<thead><tr>", id);
    while (*headings != '\0') {
        const size_t n = strcspn(headings, "|");
        const bool number = *headings == '>';
        (void)fputs(number ? "<th class=\"n\">" : "<th>", out);
        html_textf(out, "%.*s", (int)(n - number), headings + number);
        (void)fputs("</th>", out);
        headings += headings[n] == '|' ? n + 1 : n;
    }
    (void)fputs("</tr></thead>\n<tbody>\n", out);
}

void html_table_end(FILE *out)
{
    (void)fputs("</tbody></table></div>\n", out);
}

void html_name_cell(FILE *out, const char *name)
{
    (void)fputs("<td>", out);
    html_name(out, name);
    (void)fputs("</td>", out);
}

void html_cell(FILE *out, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    (void)fputs("<td>", out);
    text_of(out, format, args);
    (void)fputs("</td>", out);
    va_end(args);
}

/* "-1.2e-05 kg" -> "−1.2 × 10<sup>−5</sup> kg": the first exponent behind a digit. */
static void print_powers(FILE *out, const char *text)
{
    const char *e = text;
    while (*e != '\0' && !((*e == 'e') && e > text && e[-1] >= '0' && e[-1] <= '9' && (e[1] == '-' || e[1] == '+')))
        e++;
    const char *start = *text == '-' ? text + 1 : text;
    if (start != text)
        (void)fputs("\xE2\x88\x92", out); /* − */
    html_textf(out, "%.*s", (int)(e - start), start);
    if (*e == '\0')
        return;
    char *rest = NULL;
    const long power = strtol(e + 1, &rest, 10);
    (void)fprintf(out, " × 10<sup>%s%ld</sup>", power < 0 ? "−" : "", labs(power));
    html_text(out, rest);
}

void html_number(FILE *out, double x, double factor, const char *format)
{
    char text[160];
    if (!isfinite(x)) {
        (void)fputs("–", out);
        return;
    }
    (void)snprintf(text, sizeof text, format, factor * x);
    (void)fprintf(out, "<data value=\"%.17g\">", x);
    print_powers(out, text);
    (void)fputs("</data>", out);
}

void html_number_cell(FILE *out, double x, double factor, const char *format)
{
    (void)fputs("<td class=\"n\">", out);
    html_number(out, x, factor, format);
    (void)fputs("</td>", out);
}

/* ---- Data ---- */

void html_data(FILE *out, const char *id, struct json *tree)
{
    char *text = NULL;
    size_t n = 0;
    struct bf_error ignored;
    FILE *f = open_memstream(&text, &n);
    (void)fprintf(out, "<script type=\"application/json\" id=\"%s\">", id);
    if (f == NULL) {
        json_discard(tree);
    } else {
        (void)json_print_line_and_free(tree, f, &ignored);
        (void)fclose(f);
    }
    for (size_t i = 0; i < n; i++)
        if (text[i] == '<') /* inside a string, there are no others */
            (void)fputs("\\u003c", out);
        else
            (void)fputc(text[i], out);
    free(text);
    (void)fputs("</script>\n", out);
}
