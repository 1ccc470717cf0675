/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_tables.c — modes, records, and the error of each channel. */
#include "report_parts.h"
#include "report_verdict.h"

#include <math.h>
#include <string.h>

#include "show.h"
#include "ground/ground.h"

/* ---- Modes ---- */

void report_modes(struct page *page)
{
    const struct modes *modes = page->report->modes;
    page_heading(page, "Natural frequencies and damping");
    html_table_begin(page->out, "modes",
                     ">Mode|>Frequency (Hz)|>Damping ratio (%)|>Frequency error on a controller (%)");
    for (size_t k = 0; k < modes->n; k++) {
        const struct mode *mode = &modes->mode[k];
        (void)fprintf(page->out, "<tr><td class=\"n\">%zu</td>", k + 1);
        html_number_cell(page->out, mode->undamped_Hz, 1.0, "%.3f");
        html_number_cell(page->out, mode->damping_ratio, 100.0, "%.3g");
        html_number_cell(page->out, k < modes->in_band ? mode->deployed_error : (double)NAN, 100.0, "%+.2g");
        (void)fputs("</tr>\n", page->out);
    }
    html_table_end(page->out);
    (void)fputs("<p class=\"note\">", page->out);
    html_textf(
        page->out,
        "Undamped frequencies with the linear effects. The last column: what %zu dimensions (%zu modes and %zu static "
        "responses), which is what beamfit export puts on a controller, make of the same frequency; a dash is a mode "
        "beyond them. Doubling the splines of the computation moves these frequencies by at most ",
        modes->deployed_modes + modes->deployed_statics, modes->deployed_modes, modes->deployed_statics);
    html_number(page->out, modes->convergence, 100.0, "%.1g %%");
    (void)fputs(".</p>\n", page->out);
}

/* ---- Records ---- */

static bool moves(const double *u, size_t n)
{
    return u != NULL && root_mean_square(u, n) > 0.0;
}

/* "hammer_N", "free decay from 1.175 s, initial state solved for". */
static void excitation_cell(struct page *page, const struct record *record, double level)
{
    const struct model *m = page->report->model;
    size_t n = 0;
    (void)fputs("<td>", page->out);
    if (record_is_free_decay(record)) {
        const char *from = record_meta(record, "free_from_s");
        html_textf(page->out, "free decay%s%s%s, initial state solved for", from != NULL ? " from " : "",
                   from != NULL ? from : "", from != NULL ? " s" : "");
    } else {
        for (size_t i = 0; i < m->n_inputs; i++)
            if (moves(record_column(record, m->inputs[i].name), record->n))
                html_textf(page->out, "%s%s", n++ > 0 ? ", " : "", m->inputs[i].name);
        if (n == 0)
            html_text(page->out, "none");
        if (level > 1.0 || level < 1.0)
            html_textf(page->out, " times %.5g (solved for)", level);
    }
    (void)fputs("</td>", page->out);
}

static void record_row(struct page *page, size_t r)
{
    const struct comparison *all = page->report->comparison;
    const struct record *record = &all->records[r];
    size_t n = 0;
    (void)fputs("<tr>", page->out);
    html_name_cell(page->out, record->path != NULL ? record->path : "");
    html_cell(page->out, "%s", r >= all->n_records - all->n_held_out ? "held out" : report_group(page->report));
    (void)fputs("<td>", page->out);
    for (size_t i = 0; i < all->n_channels; i++)
        if (all->channels[i].record == r)
            html_textf(page->out, "%s%s", n++ > 0 ? ", " : "", all->channels[i].name);
    (void)fputs("</td>", page->out);
    excitation_cell(page, record, all->level[r]);
    (void)fprintf(page->out, "<td class=\"n\">%zu</td>", record->n);
    html_number_cell(page->out, 1.0 / record->dt_s, 1.0, "%.6g");
    html_number_cell(page->out, (double)record->n * record->dt_s, 1.0, "%.4g");
    (void)fputs("<td class=\"hash\">", page->out);
    html_textf(page->out, "%.12s", record->sha256);
    (void)fputs("</td></tr>\n", page->out);
}

/* Where the command line and the model's own account of its fit disagree. */
static void record_warnings(struct page *page)
{
    const struct comparison *all = page->report->comparison;
    const struct fit_info *fit = &page->report->model->fit;
    for (size_t r = 0; fit->present && r < all->n_records; r++) {
        const bool held_out = r >= all->n_records - all->n_held_out;
        const struct fit_record *known = report_fit_record(page->report, r);
        const char *file = text_base_name(all->records[r].path);
        const bool was_fitted = known != NULL && !known->held_out;
        if (was_fitted != held_out)
            continue;
        (void)fputs("<p class=\"warning\">", page->out);
        if (held_out)
            html_textf(page->out, "%s is called held out here, but the model was fitted to it: it checks nothing.",
                       file);
        else
            html_textf(page->out, "%s is not among the records that this model was fitted to.", file);
        (void)fputs("</p>\n", page->out);
    }
}

void report_records(struct page *page)
{
    const struct comparison *all = page->report->comparison;
    page_heading(page, "Records");
    html_table_begin(page->out, "records", "File|Use|Measured|Excitation|>Samples|>Rate (Hz)|>Duration (s)|SHA-256 …");
    for (size_t r = 0; r < all->n_records; r++)
        record_row(page, r);
    html_table_end(page->out);
    record_warnings(page);
}

/* ---- Errors ---- */

static void band_cell(FILE *out, const struct comparison_channel *c)
{
    const struct comparison_band *band = compare_worst_band(c);
    if (band == NULL) {
        (void)fputs("<td>–</td>", out);
        return;
    }
    (void)fputs("<td>", out);
    html_textf(out, "%.0f %% in %.3g–%.3g Hz", 100.0 * band->share, band->from_Hz, band->to_Hz);
    if (band->mode > 0)
        html_textf(out, " (mode %zu)", band->mode);
    if (isfinite(band->noise_ratio))
        html_textf(out, ", %.3g × noise", band->noise_ratio);
    (void)fputs("</td>", out);
}

static void error_row(FILE *out, const struct comparison *all, const struct comparison_channel *c)
{
    char unit[24], format[40];
    report_unit(c->name, unit);
    const double factor = report_prefix(c->noise.rms, unit, format);
    (void)fputs("<tr>", out);
    html_name_cell(out, text_base_name(all->records[c->record].path));
    html_name_cell(out, c->name);
    report_error_cells(out, c->nrmse, c->noise_ratio);
    html_number_cell(out, c->noise.rms > 0.0 ? c->noise.rms : (double)NAN, factor, format);
    band_cell(out, c);
    (void)fputs("</tr>\n", out);
}

static void total_row(FILE *out, const char *group, double nrmse, double noise_ratio)
{
    (void)fputs("<tr class=\"total\"><td colspan=\"2\">", out);
    html_textf(out, "all %s records", group);
    (void)fputs("</td>", out);
    report_error_cells(out, nrmse, noise_ratio);
    (void)fputs("<td></td><td></td></tr>\n", out);
}

void report_errors(struct page *page)
{
    const struct comparison *all = page->report->comparison;
    page_heading(page, "What the model leaves, per record and channel");
    html_table_begin(page->out, "errors",
                     "Record|Channel|>Error|>Times the noise|>Noise, rms|Largest share of the misfit");
    for (int held_out = 0; held_out < 2; held_out++) {
        size_t n = 0;
        for (size_t i = 0; i < all->n_channels; i++)
            if (all->channels[i].held_out == (held_out == 1)) {
                error_row(page->out, all, &all->channels[i]);
                n++;
            }
        if (n > 0)
            total_row(page->out, held_out ? "held-out" : report_group(page->report),
                      held_out ? all->check_nrmse : all->nrmse, held_out ? all->check_noise_ratio : all->noise_ratio);
    }
    html_table_end(page->out);
    for (size_t i = 0; i < all->n_channels; i++)
        if (all->channels[i].warning[0] != '\0') {
            (void)fputs("<p class=\"warning\">", page->out);
            html_textf(page->out, "%s: %s", text_base_name(all->records[all->channels[i].record].path),
                       all->channels[i].warning);
            (void)fputs("</p>\n", page->out);
        }
    for (size_t i = 0; i < all->n_notes; i++)
        page_note(page, "%s.", all->notes[i]);
}
