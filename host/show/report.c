/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report.c — the page from its title to its end; report_parts.h names the files of its parts. */
#include "report_page.h"
#include "report_parts.h"
#include "report_verdict.h"
#include "show.h"

#include <stdlib.h>
#include <time.h>

#include "ground/ground.h"

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

void report_write(const struct report *r, FILE *out)
{
    struct page page = {.out = out, .report = r};
    char title[512];
    (void)snprintf(title, sizeof title, "Model of a beam: %.400s", text_base_name(r->model->path));
    html_begin(out, r->title != NULL ? r->title : title, "beamfit " BEAMFIT_VERSION, report_scripts, false);
    write_title(&page, r->title != NULL ? r->title : title);
    report_explore(&page);
    report_errors(&page);
    write_legend(&page);
    report_beam(&page);
    report_parameters(&page);
    report_modes(&page);
    report_records(&page);
    report_chain(&page);
    (void)fputs("<footer>Made by beamfit " BEAMFIT_VERSION
                ". Everything on this page is inside this file; the curves are drawn by dygraphs "
                "(MIT licence).</footer>\n",
                out);
    html_end(out);
}
