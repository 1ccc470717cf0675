/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_figures.c — the pictures: which ones, drawing them, and what is written below each. */
#include "compare_plot.h"
#include "compare_text.h"
#include "report_parts.h"
#include "show.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "ground/ground.h"

/* ---- Drawing ---- */

static void stem_of(size_t channel, char stem[32])
{
    (void)snprintf(stem, 32, "channel%zu", channel + 1);
}

/* How much the reader wants to see it: times the noise; what has no noise ratio first. */
static double urgency(const struct comparison_channel *c)
{
    return isfinite(c->noise_ratio) ? c->noise_ratio : HUGE_VAL;
}

/* The most urgent of those that can be drawn, at most `most`; of equals the first. */
static size_t choose(const struct comparison *all, size_t most, bool *chosen)
{
    size_t n = 0;
    for (; n < most; n++) {
        size_t best = all->n_channels;
        for (size_t i = 0; i < all->n_channels; i++)
            if (!chosen[i] && all->channels[i].n >= COMPARE_PLOT &&
                (best == all->n_channels || urgency(&all->channels[i]) > urgency(&all->channels[best])))
                best = i;
        if (best == all->n_channels)
            break;
        chosen[best] = true;
    }
    return n;
}

static enum bf_status make_place(struct report_pictures *out, struct bf_error *err)
{
    const char *base = getenv("TMPDIR");
    if (base == NULL || base[0] == '\0')
        base = "/tmp";
    const size_t size = strlen(base) + 32;
    out->directory = bf_alloc(size, 1);
    (void)snprintf(out->directory, size, "%s/beamfit-report-XXXXXX", base);
    if (mkdtemp(out->directory) != NULL)
        return BF_OK;
    const int why = errno;
    free(out->directory);
    out->directory = NULL;
    return bf_fail(err, BF_BAD_FILE, "%s: no directory for the pictures can be made there (%s); set TMPDIR to another",
                   base, strerror(why));
}

enum bf_status report_draw(const struct report *r, struct report_pictures *out, struct bf_error *err)
{
    const struct comparison *all = r->comparison;
    *out = (struct report_pictures){.drawn = bf_alloc(all->n_channels, sizeof *out->drawn)};
    out->n_channels = choose(all, r->most_channels, out->drawn);
    const bool chain = r->most_channels > 0 && r->history != NULL && history_fits(r->history) > 1;
    if (out->n_channels == 0 && !chain)
        return BF_OK;
    enum bf_status status = make_place(out, err);
    struct progress *progress = progress_begin("Drawing");
    const double whole = (double)out->n_channels + (chain ? 0.5 : 0.0);
    double done = 0.0;
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++) {
        char stem[32];
        if (!out->drawn[i])
            continue;
        progress_update(progress, done / whole, all->channels[i].name);
        stem_of(i, stem);
        status = compare_plot_channel(all, i, out->directory, stem, err);
        done += 1.0;
        if (status == BF_OK && progress_interrupted())
            status = bf_fail(err, BF_NUMERIC, "interrupted; no report was written");
    }
    if (status == BF_OK && chain)
        status = history_plot(r->history, out->directory, err);
    progress_end(progress);
    out->history = status == BF_OK && chain;
    out->n = status == BF_OK ? 2 * out->n_channels + chain : 0;
    return status;
}

/* Only files that gnuplot and the plots made are in there; no directories. */
void report_pictures_free(struct report_pictures *pictures)
{
    DIR *d = pictures->directory != NULL ? opendir(pictures->directory) : NULL;
    for (struct dirent *entry = d != NULL ? readdir(d) : NULL; entry != NULL; entry = readdir(d))
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            (void)unlinkat(dirfd(d), entry->d_name, 0);
    if (d != NULL) {
        (void)closedir(d);
        (void)rmdir(pictures->directory);
    }
    free(pictures->directory);
    free(pictures->drawn);
    *pictures = (struct report_pictures){0};
}

/* ---- In the page ---- */

static void residual_caption(const struct page *page, const struct comparison_channel *c, char *text, size_t size)
{
    const struct comparison_band *band = compare_worst_band(c);
    char unit[24], format[40], rms[64], noise[64] = "not known", share[120] = "", white[24];
    report_unit(c->name, unit);
    double factor = report_prefix(c->residual_rms, unit, format);
    (void)snprintf(rms, sizeof rms, format, factor * c->residual_rms);
    factor = report_prefix(c->noise.rms, unit, format);
    if (c->noise.rms > 0.0)
        (void)snprintf(noise, sizeof noise, format, factor * c->noise.rms);
    if (band != NULL)
        (void)snprintf(share, sizeof share, " The largest share, %.0f %%, lies between %.3g and %.3g Hz.",
                       100.0 * band->share, band->from_Hz, band->to_Hz);
    (void)snprintf(white, sizeof white, c->whiteness.p_value < 1e-4 ? "below %.4f" : "%.2g",
                   fmax(c->whiteness.p_value, 1e-4));
    (void)snprintf(
        text, size,
        "%.120s %s, measured minus predicted: rms %s, of the noise %s.%s Probability that white noise looks like "
        "this: %s. In time, its spectral density, its correlation with itself and with the input, its share per "
        "band.",
        text_base_name(page->report->comparison->records[c->record].path), c->name, rms, noise, share, white);
}

static enum bf_status channel_figures(struct page *page, size_t i, struct bf_error *err)
{
    const struct comparison *all = page->report->comparison;
    const struct comparison_channel *c = &all->channels[i];
    char stem[32], file[64], summary[1200], caption[1600];
    (void)fputs("<h3 class=\"channel\">", page->out);
    html_textf(page->out, "%s, %s%s", text_base_name(all->records[c->record].path), c->name,
               c->held_out ? " (held out)" : "");
    (void)fputs("</h3>\n", page->out);
    stem_of(i, stem);
    compare_finding(all, c, summary, sizeof summary);
    (void)snprintf(
        caption, sizeof caption,
        "%s (a) measured, (b) predicted, (c) amplitude spectra of both with the noise, (d) both in a short interval.",
        summary);
    (void)snprintf(file, sizeof file, "%s.png", stem);
    if (page_figure(page, file, caption, err) != BF_OK)
        return err->status;
    residual_caption(page, c, caption, sizeof caption);
    (void)snprintf(file, sizeof file, "%s-residual.png", stem);
    return page_figure(page, file, caption, err);
}

/* Which channels have no picture, and by which rule. */
static void list_left_out(struct page *page)
{
    const struct comparison *all = page->report->comparison;
    size_t left = 0;
    for (size_t i = 0; i < all->n_channels; i++)
        left += !page->pictures->drawn[i];
    if (left == 0)
        return;
    page_note(
        page,
        "Without pictures, because the page has those of at most %zu channel%s (--pictures N; the furthest from their "
        "noise come first) and a channel needs %d samples:",
        page->report->most_channels, page->report->most_channels == 1 ? "" : "s", COMPARE_PLOT);
    (void)fputs("<ul class=\"note\">\n", page->out);
    for (size_t i = 0; i < all->n_channels; i++) {
        char summary[1200];
        if (page->pictures->drawn[i])
            continue;
        compare_finding(all, &all->channels[i], summary, sizeof summary);
        (void)fputs("<li>", page->out);
        html_text(page->out, summary);
        (void)fputs("</li>\n", page->out);
    }
    (void)fputs("</ul>\n", page->out);
}

enum bf_status report_figures(struct page *page, struct bf_error *err)
{
    page_heading(page, "Measured and predicted");
    for (size_t i = 0; i < page->report->comparison->n_channels; i++)
        if (page->pictures->drawn[i] && channel_figures(page, i, err) != BF_OK)
            return err->status;
    list_left_out(page);
    return BF_OK;
}

/* ---- The chain of models ---- */

static void chain_table(struct page *page)
{
    const struct history *h = page->report->history;
    html_table_begin(page->out, "history",
                     "Model|>Error, fitted|>Times the noise|>Error, held out|>Times the noise|Step|SHA-256 …");
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

/* From the first fit of the chain to the last; "" when there is none. */
static void chain_caption(const struct history *h, char *text, size_t size)
{
    const struct fit_info *first = NULL, *last = NULL;
    for (int k = 0; k < h->n; k++) {
        const struct fit_info *fit = &h->entries[h->order[k]].model.fit;
        first = first == NULL && fit->present ? fit : first;
        last = fit->present ? fit : last;
    }
    text[0] = '\0';
    if (first == NULL || last == NULL)
        return;
    int n = snprintf(text, size,
                     "Error of each fitted model of the chain and of noise alone: from %.3g %% to %.3g %% on fitted "
                     "records",
                     100.0 * first->nrmse, 100.0 * last->nrmse);
    if (first->check_nrmse > 0.0 && last->check_nrmse > 0.0)
        n += snprintf(text + n, size - (size_t)n, ", from %.3g %% to %.3g %% on held-out ones",
                      100.0 * first->check_nrmse, 100.0 * last->check_nrmse);
    (void)snprintf(text + n, size - (size_t)n, ".");
}

enum bf_status report_chain(struct page *page, struct bf_error *err)
{
    const struct history *h = page->report->history;
    if (h == NULL || h->n < 2)
        return BF_OK;
    page_heading(page, "How the model came about");
    chain_table(page);
    if (!page->pictures->history)
        return BF_OK;
    char caption[500];
    chain_caption(h, caption, sizeof caption);
    return page_figure(page, "history.png", caption, err);
}
