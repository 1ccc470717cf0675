/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report_page.h"
#include "plot.h"
#include "ground/ground.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

/* ---- Numbers with units ---- */

void report_unit(const char *name, char unit[24])
{
    char text[200];
    plot_quantity(name, "", text, sizeof text); /* "piezo (V)" where the unit is known, else the name itself */
    const char *open = strrchr(text, '(');
    unit[0] = '\0';
    if (strcmp(text, name) != 0 && open != NULL)
        (void)snprintf(unit, 24, "%.*s", (int)strcspn(open + 1, ")"), open + 1);
}

double report_prefix(double x, const char *unit, char format[40])
{
    double factor;
    const char *prefix = plot_prefix(x, unit, &factor);
    (void)snprintf(format, 40, "%%.3g%s%s%s", unit[0] ? " " : "", prefix, unit);
    return factor;
}

void report_error_cells(FILE *out, double nrmse, double noise_ratio)
{
    html_number_cell(out, nrmse, 100.0, 100.0 * nrmse < 999.95 ? "%#.4g %%" : "%.4g %%");
    html_number_cell(out, noise_ratio, 1.0, noise_ratio < 999.95 ? "%#.4g ×" : "%.4g ×");
}

/* ---- Text ---- */

void page_text(struct page *page, const char *text)
{
    for (bool code = false; *text != '\0'; code = !code) {
        const size_t n = strcspn(text, "`");
        (void)fputs(code ? "<code>" : "", page->out);
        html_textf(page->out, "%.*s", (int)n, text);
        (void)fputs(code ? "</code>" : "", page->out);
        text += text[n] == '`' ? n + 1 : n;
    }
}

void page_heading(struct page *page, const char *heading)
{
    (void)fputs("<h2>", page->out);
    html_text(page->out, heading);
    (void)fputs("</h2>\n", page->out);
}

void page_note(struct page *page, const char *format, ...)
{
    char text[2048];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    (void)fputs("<p class=\"note\">", page->out);
    page_text(page, text);
    (void)fputs("</p>\n", page->out);
}
