/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report.c — the page from its title to its end; its parts are in report_*.c. */
#include "show.h"
#include "report_work.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "ground/ground.h"

/* ---- What the parts share ---- */

double report_prefix(double x, const char *unit, char format[40])
{
    static const char *const taking[] = {"V", "N", "m", "m/s", "m/s²", "rad", "rad/s", "Pa", "A", "N·m"};
    static const struct {
        const char *prefix;
        double size;
    } prefixes[] = {{"n", 1e-9}, {"µ", 1e-6}, {"m", 1e-3}, {"", 1.0}, {"k", 1e3}};
    enum { PREFIXES = sizeof prefixes / sizeof *prefixes, PLAIN = 3 };
    size_t k = 0;
    bool takes = false;
    for (size_t i = 0; i < sizeof taking / sizeof *taking; i++)
        takes = takes || strcmp(unit, taking[i]) == 0;
    while (k + 1 < PREFIXES && fabs(x) >= 0.9995 * prefixes[k + 1].size)
        k++;
    if (!takes || !(fabs(x) >= 1e-9 && fabs(x) < 1e6))
        k = PLAIN;
    (void)snprintf(format, 40, "%%.3g%s%s%s", unit[0] ? " " : "", prefixes[k].prefix, unit);
    return 1.0 / prefixes[k].size;
}

void report_error_cells(FILE *out, double nrmse, double noise_ratio)
{
    html_number_cell(out, nrmse, 100.0, 100.0 * nrmse < 999.95 ? "%#.4g %%" : "%.4g %%");
    html_number_cell(out, noise_ratio, 1.0, noise_ratio < 999.95 ? "%#.4g ×" : "%.4g ×");
}

const struct fit_record *report_fit_record(const struct report *r, size_t record)
{
    const struct fit_info *fit = &r->model->fit;
    const char *sha256 = r->comparison->records[record].sha256;
    for (size_t i = 0; fit->present && i < fit->n_records; i++)
        if (sha256[0] && strcmp(fit->records[i].sha256, sha256) == 0)
            return &fit->records[i];
    return NULL;
}

const char *report_group(const struct report *r)
{
    const struct comparison *all = r->comparison;
    const size_t n = all->n_records - all->n_held_out;
    size_t fitted = 0;
    for (size_t i = 0; i < n; i++) {
        const struct fit_record *record = report_fit_record(r, i);
        fitted += record != NULL && !record->held_out;
    }
    return n > 0 && fitted == n ? "fitted" : "compared";
}

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

enum bf_status page_figure(struct page *page, const char *file, const char *caption, struct bf_error *err)
{
    const size_t size = strlen(page->pictures->directory) + strlen(file) + 2;
    char *path = bf_alloc(size, 1);
    (void)snprintf(path, size, "%s/%s", page->pictures->directory, file);
    (void)fputs("<figure>", page->out);
    const enum bf_status status = html_png(page->out, path, caption, err);
    (void)fprintf(page->out, "\n<figcaption><b>Figure %zu.</b> ", ++page->n_figures);
    html_text(page->out, caption);
    (void)fputs("</figcaption></figure>\n", page->out);
    free(path);
    return status;
}

/* ---- Verdict ---- */

static void say(char text[REPORT_TEXT], const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(char text[REPORT_TEXT], const char *format, ...)
{
    const size_t n = strlen(text);
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text + n, REPORT_TEXT - n, format, args);
    va_end(args);
}

static void say_total(char text[REPORT_TEXT], double ratio, double nrmse, size_t n, const char *group)
{
    const char *plural = n == 1 ? "" : "s";
    if (isfinite(ratio))
        say(text, "%.3g times the noise (%.3g %% of the signal) in %zu %s record%s", ratio, 100.0 * nrmse, n, group,
            plural);
    else
        say(text, "%.3g %% of the signal in %zu %s record%s, whose noise could not be told", 100.0 * nrmse, n, group,
            plural);
}

/* The channel with the largest noise ratio; NULL when no noise is known. unknown: channels without one. */
static const struct comparison_channel *worst_channel(const struct comparison *all, size_t *unknown)
{
    const struct comparison_channel *worst = NULL;
    *unknown = 0;
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        *unknown += isfinite(c->noise_ratio) ? 0 : 1;
        if (isfinite(c->noise_ratio) && (worst == NULL || c->noise_ratio > worst->noise_ratio))
            worst = c;
    }
    return worst;
}

bool report_leaves_more(const struct report *r)
{
    size_t unknown;
    const struct comparison_channel *worst = worst_channel(r->comparison, &unknown);
    return worst != NULL && !compare_is_noise(worst->noise_ratio);
}

void report_verdict(const struct report *r, char text[REPORT_TEXT])
{
    const struct comparison *all = r->comparison;
    const size_t n = all->n_records - all->n_held_out;
    size_t unknown;
    const struct comparison_channel *worst = worst_channel(all, &unknown);
    text[0] = '\0';
    say(text, "The model leaves ");
    if (n > 0)
        say_total(text, all->noise_ratio, all->nrmse, n, report_group(r));
    if (n > 0 && all->n_held_out > 0)
        say(text, ", and ");
    if (all->n_held_out > 0)
        say_total(text, all->check_noise_ratio, all->check_nrmse, all->n_held_out, "held-out");
    if (worst == NULL)
        say(text, ". The noise of no channel is known, so it is open whether more than noise is left.");
    else if (compare_is_noise(worst->noise_ratio))
        say(text, ": nothing that could be told from the noise is left to explain%s.",
            unknown > 0 ? ", in the channels whose noise is known" : "");
    else if (all->n_channels > 1)
        say(text, "; at most %.3g times, in %s of %.200s", worst->noise_ratio, worst->name,
            text_base_name(all->records[worst->record].path));
    if (report_leaves_more(r))
        say(text, ". More than the noise is left: `beamfit diagnose` with the same records is the next step.");
}

/* ---- Title ---- */

static void print_time(FILE *out)
{
    const char *epoch = getenv("SOURCE_DATE_EPOCH"); /* reproducible-builds.org */
    const time_t now = epoch != NULL ? (time_t)strtoll(epoch, NULL, 10) : time(NULL);
    struct tm tm;
    char text[64] = "";
    if (gmtime_r(&now, &tm) != NULL)
        (void)strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &tm);
    html_text(out, text);
}

static void write_title(struct page *page, const char *title)
{
    const struct model *m = page->report->model;
    FILE *out = page->out;
    char verdict[REPORT_TEXT];
    (void)fputs("<header>\n<h1>", out);
    html_text(out, title);
    (void)fputs("</h1>\n<p class=\"meta\">Model file ", out);
    html_name(out, m->path != NULL ? m->path : "");
    (void)fputs(" · ", out);
    print_time(out);
    (void)fputs(" · beamfit " BEAMFIT_VERSION "</p>\n<p class=\"meta\">SHA-256 <span class=\"hash\">", out);
    html_text(out, m->sha256);
    (void)fputs("</span></p>\n", out);
    report_verdict(page->report, verdict);
    (void)fputs("<p class=\"verdict\">", out);
    page_text(page, verdict);
    (void)fputs("</p>\n", out);
    if (!m->fit.present)
        page_note(
            page,
            "The values of this model are as its file gives them: it was not fitted since it was made or changed.");
    else if (!m->fit.converged)
        (void)fputs(
            "<p class=\"warning\">The fit that made this model did not converge: its values and standard errors are "
            "not to be relied on.</p>\n",
            out);
    (void)fputs("</header>\n", out);
}

static void write_legend(struct page *page)
{
    page_note(
        page,
        "Error: root mean square of measured minus predicted over that of the measured signal; of several channels "
        "the root mean square of their errors. Times the noise: the same difference over the channel's noise, "
        "which is estimated from the recording alone; 1 means that nothing is left to explain. A standard error "
        "holds for this model and these records; it knows nothing of what the model lacks.");
}

enum bf_status report_write(const struct report *r, const struct report_pictures *pictures, FILE *out,
                            struct bf_error *err)
{
    struct page page = {.out = out, .report = r, .pictures = pictures};
    char title[512];
    (void)snprintf(title, sizeof title, "Model of a beam: %.400s", text_base_name(r->model->path));
    html_begin(out, r->title != NULL ? r->title : title, "beamfit " BEAMFIT_VERSION);
    write_title(&page, r->title != NULL ? r->title : title);
    report_beam(&page);
    report_parameters(&page);
    report_modes(&page);
    report_records(&page);
    report_errors(&page);
    write_legend(&page);
    if (report_figures(&page, err) != BF_OK || report_chain(&page, err) != BF_OK)
        return err->status;
    (void)fputs("<footer>Made by beamfit " BEAMFIT_VERSION ". Everything on this page is inside this file.</footer>\n",
                out);
    html_end(out);
    return BF_OK;
}
