/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_explore.c — the curves of the channels, to be looked into, and the chain of models. */
#include "report_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compare_plot.h"
#include "compare_text.h"
#include "ground/ground.h"
#include "html.h"
#include "page_assets.h"
#include "report_page.h"

const char *const report_scripts[] = {"dygraph.min.js", "chart.js", "curves.js", "explore.js", "start.js", NULL};

/* Which channels have no curves, and by which rule. */
static void list_left_out(struct page *page, const bool drawn[])
{
    const struct comparison *all = page->report->comparison;
    const size_t most = page->report->curves.most_channels;
    size_t left = 0;
    for (size_t i = 0; i < all->n_channels; i++)
        left += !drawn[i];
    if (left == 0)
        return;
    page_note(
        page,
        "Without curves, because the page has those of at most %zu channel%s (--pictures N; the furthest from their "
        "noise come first) and a channel needs %d samples:",
        most, most == 1 ? "" : "s", COMPARE_PLOT);
    (void)fputs("<ul class=\"note\">\n", page->out);
    for (size_t i = 0; i < all->n_channels; i++) {
        char summary[1200];
        if (drawn[i])
            continue;
        compare_finding(all, &all->channels[i], summary, sizeof summary);
        (void)fputs("<li>", page->out);
        html_text(page->out, summary);
        (void)fputs("</li>\n", page->out);
    }
    (void)fputs("</ul>\n", page->out);
}

/* The curves of the model alone when nothing else was given. */
static struct json *curves_of(const struct report *r)
{
    const struct explanation itself = {text_base_name(r->model->path), r->comparison, NAN, NAN};
    const struct curves alone = {.n = 1, .explanations = &itself, .most_channels = r->curves.most_channels};
    return curves_json(r->curves.n > 0 ? &r->curves : &alone);
}

void report_explore(struct page *page)
{
    const struct comparison *all = page->report->comparison;
    bool *drawn = bf_alloc(all->n_channels, sizeof *drawn);
    const size_t n = curves_choose(all, page->report->curves.most_channels, drawn);
    page_heading(page, "Measured and predicted");
    if (n > 0) {
        (void)fputs("<noscript><p class=\"note\">The curves need a browser that runs the scripts of this page; "
                    "all numbers are in the tables.</p></noscript>\n<div id=\"explore\"></div>\n",
                    page->out);
        html_data(page->out, "curves", curves_of(page->report));
        page_scripts(page->out, report_scripts);
    }
    list_left_out(page, drawn);
    free(drawn);
}

/* ---- The chain of models ---- */

static void chain_table(struct page *page)
{
    const struct history *h = page->report->history;
    html_table_begin(
        page->out, "history",
        "Model|>Error, fitted|>Times the noise|>Error, held out|>Times the noise, held out|Step|SHA-256 …");
    for (int k = 0; k < h->n; k++) {
        const struct history_entry *e = &h->entries[h->order[k]];
        const struct fit_info *fit = &e->model.fit;
        char step[1024];
        history_step(h, h->order[k], step, sizeof step);
        (void)fprintf(page->out, "<tr><td style=\"padding-left:%.1fem\">", 1.2 * e->depth);
        html_name(page->out, text_base_name(e->file));
        (void)fputs("</td>", page->out);
        report_error_cells(page->out, history_error(fit->nrmse), history_error(fit->noise_ratio));
        report_error_cells(page->out, history_error(fit->check_nrmse), history_error(fit->check_noise_ratio));
        html_cell(page->out, "%s", step);
        (void)fputs("<td class=\"hash\">", page->out);
        html_textf(page->out, "%.12s", e->model.sha256);
        (void)fputs("</td></tr>\n", page->out);
    }
    html_table_end(page->out);
    page_note(page, "As each fit stated it then; nothing is computed again.");
}

void report_chain(struct page *page)
{
    const struct history *h = page->report->history;
    if (h == NULL || h->n < 2)
        return;
    page_heading(page, "How the model came about");
    chain_table(page);
}
