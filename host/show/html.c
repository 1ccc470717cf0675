/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "html.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

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

static const char *const style[] = {
    ":root{--ink:#1b1f23;--quiet:#5b6570;--line:#d5dae0;--wash:#f5f7f9;--mark:#0072b2}",
    "*{box-sizing:border-box}",
    "body{font:16px/1.5 'DejaVu Sans','Segoe UI',Helvetica,Arial,sans-serif;color:var(--ink);background:#fff;",
    "max-width:64rem;margin:0 auto;padding:1.5rem;overflow-wrap:break-word}",
    "h1{font-size:1.6rem;line-height:1.25;margin:0 0 .3rem}",
    "h2{font-size:1.2rem;margin:2.2rem 0 .6rem;padding-top:.4rem;border-top:2px solid var(--ink)}",
    "h3{font-size:1rem;margin:1.4rem 0 .4rem}",
    "h1,h2,h3{break-after:avoid}",
    "p{margin:.5rem 0;max-width:52rem}",
    ".verdict{font-size:1.05rem;background:var(--wash);border-left:4px solid var(--mark);",
    "padding:.7rem 1rem;margin:1rem 0}",
    ".warning{border-left:4px solid #d55e00;background:#fff6ef;padding:.4rem .8rem}",
    ".note,caption,.meta{color:var(--quiet);font-size:.88rem}",
    ".meta{overflow-wrap:anywhere;margin:.15rem 0}",
    ".scroll{overflow-x:auto;margin:.6rem 0 1rem}",
    "table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums}",
    "th,td{padding:.28rem .7rem .28rem 0;text-align:left;vertical-align:top;border-bottom:1px solid var(--line)}",
    "th{border-bottom:1.5px solid var(--ink);font-weight:600;vertical-align:bottom}",
    "th.n,td.n{text-align:right;white-space:nowrap}",
    "tr.total td{border-top:1.5px solid var(--ink);font-weight:600}",
    ".side{display:flex;flex-wrap:wrap;gap:0 3.5rem;align-items:flex-start}",
    "code,.hash{font-family:'DejaVu Sans Mono',Consolas,monospace;font-size:.88em}",
    "sup{font-size:.72em;line-height:0}",
    "figure{margin:1.2rem 0;break-inside:avoid}",
    "figure img{display:block;width:100%;max-width:52rem;height:auto}",
    "figure svg{display:block;width:100%;max-width:46rem;height:auto}",
    ".label{paint-order:stroke;stroke:#fff;stroke-width:4px}", /* a line behind it stays behind */
    "figcaption{font-size:.88rem;max-width:52rem;margin-top:.3rem}",
    "figcaption b{margin-right:.3em}",
    "ul{margin:.4rem 0;padding-left:1.3rem;max-width:52rem}",
    "footer{margin-top:2.5rem;padding-top:.6rem;border-top:1px solid var(--line);color:var(--quiet);font-size:.85rem}",
    "@page{margin:16mm 15mm}",
    /* paper: a channel's two pictures on one page; tables break with at least three rows on either side */
    "@media print{",
    "body{font-size:10pt;max-width:none;padding:0}",
    "h1{font-size:16pt}",
    "h2{font-size:12.5pt;margin-top:14pt}",
    "table{font-size:8.5pt}",
    ".scroll{overflow:visible}",
    "tr,.verdict,.warning{break-inside:avoid}",
    "thead,tbody tr:nth-child(-n+3){break-after:avoid}",
    "tbody tr:nth-last-child(-n+3){break-before:avoid}",
    "h3.channel{break-before:page}",
    "h2+h3.channel{break-before:auto}",
    "h2:has(+h3.channel){break-before:page}",
    "figure{margin:6pt 0}",
    "figure img{max-width:11.2cm}",
    "figcaption,.note{font-size:8.5pt}",
    ".verdict{border:1px solid var(--line);border-left:4px solid var(--mark)}",
    "}",
};

void html_begin(FILE *out, const char *title, const char *program)
{
    (void)fputs(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
        "'unsafe-inline'\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"generator\" content=\"",
        out);
    html_text(out, program);
    (void)fputs("\">\n<title>", out);
    html_text(out, title);
    (void)fputs("</title>\n<style>\n", out);
    for (size_t i = 0; i < sizeof style / sizeof *style; i++)
        (void)fprintf(out, "%s\n", style[i]);
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

/* ---- Pictures ---- */

void html_base64(FILE *out, const void *bytes, size_t n)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const unsigned char *b = bytes;
    for (size_t i = 0; i < n; i += 3) {
        const size_t left = n - i;
        const uint32_t three =
            (uint32_t)b[i] << 16 | (left > 1 ? (uint32_t)b[i + 1] << 8 : 0U) | (left > 2 ? b[i + 2] : 0U);
        (void)fputc(digit[three >> 18], out);
        (void)fputc(digit[three >> 12 & 63U], out);
        (void)fputc(left > 1 ? digit[three >> 6 & 63U] : '=', out);
        (void)fputc(left > 2 ? digit[three & 63U] : '=', out);
    }
}

static unsigned big_endian(const unsigned char b[4])
{
    return (unsigned)b[0] << 24 | (unsigned)b[1] << 16 | (unsigned)b[2] << 8 | b[3];
}

static enum bf_status read_whole(const char *path, unsigned char **bytes, size_t *n, struct bf_error *err)
{
    FILE *f = fopen(path, "rb");
    size_t room = 1 << 16, got = 0;
    if (f == NULL)
        return bf_fail_at(err, path, 0, "the picture cannot be read (%s); try again", strerror(errno));
    *bytes = bf_alloc(room, 1);
    *n = 0;
    while ((got = fread(*bytes + *n, 1, room - *n, f)) > 0) {
        *n += got;
        if (*n == room)
            *bytes = bf_grow(*bytes, room *= 2, 1);
    }
    const bool failed = ferror(f) != 0;
    (void)fclose(f);
    if (failed) {
        free(*bytes);
        return bf_fail_at(err, path, 0, "the picture cannot be read to its end; check the disk");
    }
    return BF_OK;
}

enum bf_status html_png(FILE *out, const char *path, const char *alt, struct bf_error *err)
{
    enum { HEAD = 24 }; /* signature, length and name of the first chunk, width, height */
    unsigned char *bytes = NULL;
    size_t n = 0;
    if (read_whole(path, &bytes, &n, err) != BF_OK)
        return err->status;
    if (n < HEAD || memcmp(bytes, "\x89PNG\r\n\x1a\n", 8) != 0 || memcmp(bytes + 12, "IHDR", 4) != 0) {
        free(bytes);
        return bf_fail_at(err, path, 0, "is not a PNG picture; draw it again");
    }
    (void)fprintf(out, "<img width=\"%u\" height=\"%u\" alt=\"", big_endian(bytes + 16), big_endian(bytes + 20));
    html_text(out, alt);
    (void)fputs("\" src=\"data:image/png;base64,", out);
    html_base64(out, bytes, n);
    (void)fputs("\">", out);
    free(bytes);
    return BF_OK;
}
