/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The population of a fleet as one page. */
#include "fleet_words.h"
#include "html.h"
#include "show.h"

#include <math.h>
#include <stdlib.h>

enum { WIDTH = 720, HEIGHT = 170, LEFT = 78, RIGHT = 706, TOP = 12, BOTTOM = 146, MOST_ROWS = 2000 };

static const char *const no_scripts[] = {NULL};

/* ---- Pictures ---- */

/* One parameter over units, or against a column: y in the parameter's x (ln θ or θ). */
struct panel {
    FILE *out;
    const struct fleet_population *p;
    size_t k;
    double low, high; /* of y */
};

static double place_y(const struct panel *panel, double y)
{
    const double share = (y - panel->low) / (panel->high - panel->low);
    return BOTTOM - (BOTTOM - TOP) * fmin(fmax(share, -0.05), 1.05);
}

static double middle_sd(const struct panel *panel)
{
    return sqrt(panel->p->mixed.spread[panel->k + panel->k * panel->p->estimates.p]);
}

static bool stands_out(const struct fleet_population *p, size_t i)
{
    for (size_t k = 0; k < p->n_outliers; k++)
        if (p->outliers[k].unit == i)
            return true;
    return false;
}

static void find_range(struct panel *panel)
{
    const struct fleet_estimates *e = &panel->p->estimates;
    const double mean = panel->p->mixed.mean[panel->k], sd = middle_sd(panel);
    panel->low = mean - 3.0 * sd, panel->high = mean + 3.0 * sd;
    for (size_t i = 0; i < e->n; i++) { /* one that is far off lies on the edge */
        const double x = e->x[i * e->p + panel->k];
        if (isfinite(x) && fabs(x - mean) < 12.0 * sd) {
            panel->low = fmin(panel->low, x - 0.5 * sd);
            panel->high = fmax(panel->high, x + 0.5 * sd);
        }
    }
}

static void draw_frame(const struct panel *panel)
{
    const struct fleet_estimates *e = &panel->p->estimates;
    const double mean = panel->p->mixed.mean[panel->k], sd = middle_sd(panel),
                 marks[] = {mean - 2 * sd, mean, mean + 2 * sd};
    FILE *out = panel->out;
    (void)fprintf(out,
                  "<figure><svg viewBox=\"0 0 %d %d\" role=\"img\" font-size=\"12\" font-family=\"sans-serif\" "
                  "aria-label=\"",
                  WIDTH, HEIGHT);
    html_text(out, e->parameters[panel->k]);
    (void)fprintf(out,
                  "\">\n<rect x=\"%d\" y=\"%.1f\" width=\"%d\" height=\"%.1f\" fill=\"#0072b2\" opacity=\"0.12\"/>\n",
                  LEFT, place_y(panel, marks[2]), RIGHT - LEFT, place_y(panel, marks[0]) - place_y(panel, marks[2]));
    (void)fprintf(out, "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\" stroke=\"#0072b2\"/>\n", LEFT,
                  place_y(panel, mean), RIGHT, place_y(panel, mean));
    for (int i = 0; i < 3; i++)
        (void)fprintf(out, "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\" fill=\"currentColor\">%.4g</text>\n",
                      LEFT - 6, place_y(panel, marks[i]) + 4.0, e->logarithmic[panel->k] ? exp(marks[i]) : marks[i]);
}

static void draw_unit(const struct panel *panel, size_t i, double at)
{
    const struct fleet_estimates *e = &panel->p->estimates;
    const double x = e->x[i * e->p + panel->k], sd = sqrt(e->S[(i * e->p + panel->k) * e->p + panel->k]);
    if (!isfinite(x))
        return;
    const char *colour = stands_out(panel->p, i) ? "#d55e00" : "currentColor";
    (void)fprintf(panel->out,
                  "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" opacity=\"0.5\"/><circle "
                  "cx=\"%.1f\" cy=\"%.1f\" r=\"2.4\" fill=\"%s\"><title>",
                  at, place_y(panel, x - 2.0 * sd), at, place_y(panel, x + 2.0 * sd), colour, at, place_y(panel, x),
                  colour);
    html_textf(panel->out, "%s: %.6g", e->units[i], e->logarithmic[panel->k] ? exp(x) : x);
    (void)fputs("</title></circle>\n", panel->out);
}

static void end_panel(const struct panel *panel, const char *x_label)
{
    const struct fleet_estimates *e = &panel->p->estimates;
    (void)fprintf(panel->out, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\" fill=\"currentColor\">",
                  (LEFT + RIGHT) / 2, HEIGHT - 6);
    html_text(panel->out, x_label);
    (void)fputs("</text>\n</svg><figcaption>", panel->out);
    html_textf(panel->out, "%s, %s", e->parameters[panel->k], e->si_units[panel->k]);
    (void)fputs("</figcaption></figure>\n", panel->out);
}

static void draw_parameter(FILE *out, const struct fleet_population *p, size_t k)
{
    struct panel panel = {.out = out, .p = p, .k = k};
    find_range(&panel);
    draw_frame(&panel);
    for (size_t i = 0; i < p->estimates.n; i++)
        draw_unit(&panel, i, LEFT + (RIGHT - LEFT) * (0.5 + (double)i) / (double)p->estimates.n);
    end_panel(&panel, "units, in the manifest's order");
}

static void draw_drift(FILE *out, const struct fleet_population *p, const struct fleet_drift *drift)
{
    const double *t = drift->t;
    struct panel panel = {.out = out, .p = p, .k = drift->parameter};
    double low = HUGE_VAL, high = -HUGE_VAL;
    char label[160];
    for (size_t i = 0; i < p->estimates.n; i++)
        if (isfinite(t[i]))
            low = fmin(low, t[i]), high = fmax(high, t[i]);
    find_range(&panel);
    draw_frame(&panel);
    const double scale = (RIGHT - LEFT - 20.0) / (high - low), mean = p->mixed.mean[drift->parameter];
    for (size_t i = 0; i < p->estimates.n; i++)
        if (isfinite(t[i]))
            draw_unit(&panel, i, LEFT + 10.0 + scale * (t[i] - low));
    (void)fprintf(out,
                  "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#d55e00\" stroke-width=\"1.5\"/>\n",
                  LEFT + 10.0, place_y(&panel, mean + drift->slope * (low - drift->middle)), RIGHT - 10.0,
                  place_y(&panel, mean + drift->slope * (high - drift->middle)));
    (void)snprintf(label, sizeof label, "%.60s, %.6g to %.6g", drift->column, low, high);
    end_panel(&panel, label);
}

/* ---- Tables ---- */

static void paragraph(FILE *out, const char *class, const char *text)
{
    (void)fprintf(out, "<p class=\"%s\">", class);
    html_text(out, text);
    (void)fputs("</p>\n", out);
}

static void write_parameters(FILE *out, const struct fleet_population *p)
{
    html_table_begin(out, "population", "Parameter|>Mean|>Standard error|>Spread|Unit");
    for (size_t k = 0; k < p->estimates.p; k++) {
        const struct fleet_value_words v = fleet_parameter(p, k);
        (void)fputs("<tr>", out);
        html_name_cell(out, p->estimates.parameters[k]);
        html_number_cell(out, v.mean, 1.0, "%.5g");
        html_number_cell(out, v.sd, 1.0, "%.2g");
        html_number_cell(out, v.spread, v.relative ? 100.0 : 1.0, v.relative ? "%.3g %%" : "%.3g");
        html_cell(out, "%s", p->estimates.si_units[k]);
        (void)fputs("</tr>\n", out);
    }
    html_table_end(out);
    for (size_t k = 0; k < p->estimates.p; k++)
        draw_parameter(out, p, k);
}

static void write_unit(FILE *out, const struct fleet_population *p, size_t i, double work[])
{
    const struct fleet_estimates *e = &p->estimates;
    double *best = work, *sd = work + e->p, *borrowed = work + 2 * e->p;
    struct bf_error ignored;
    if (fleet_mixed_unit(e, &p->mixed, i, best, sd, borrowed, &ignored) != BF_OK)
        return;
    (void)fputs("<tr>", out);
    html_name_cell(out, e->units[i]);
    for (size_t k = 0; k < e->p; k++) {
        html_number_cell(out, e->logarithmic[k] ? exp(best[k]) : best[k], 1.0, "%.5g");
        html_number_cell(out, borrowed[k], 100.0, "%.0f %%");
    }
    (void)fputs("</tr>\n", out);
}

static void write_units(FILE *out, const struct fleet_population *p)
{
    const struct fleet_estimates *e = &p->estimates;
    char headings[4096] = "Unit";
    size_t n = 4;
    double *work = bf_alloc(3 * e->p, sizeof *work);
    for (size_t k = 0; k < e->p && n < sizeof headings; k++)
        n += (size_t)snprintf(headings + n, sizeof headings - n, "|>%.100s|>borrowed", e->parameters[k]);
    (void)fputs("<h2>Units, with what the fleet knows</h2>\n", out);
    paragraph(out, "note",
              "Each value weighs the unit's own estimate with the fleet by their errors; borrowed: the share that the "
              "fleet decides.");
    html_table_begin(out, "units", headings);
    for (size_t i = 0; i < e->n && i < MOST_ROWS; i++)
        write_unit(out, p, i, work);
    html_table_end(out);
    free(work);
}

static void write_findings(FILE *out, const struct fleet_population *p)
{
    char text[FLEET_SENTENCE];
    (void)fputs("<h2>Units that stand out</h2>\n<ul>\n", out);
    for (size_t i = 0; i < p->n_outliers; i++) {
        fleet_outlier_words(p, &p->outliers[i], text);
        (void)fputs("<li>", out);
        html_text(out, text);
        (void)fputs("</li>\n", out);
    }
    (void)fprintf(out, "</ul>\n%s<h2>Drift</h2>\n", p->n_outliers == 0 ? "<p>None.</p>\n" : "");
    if (p->n_drifts == 0)
        paragraph(out, "", "None against any column that has numbers or dates.");
    for (size_t i = 0; i < p->n_drifts; i++) {
        fleet_drift_words(p, &p->drifts[i], text);
        paragraph(out, "", text);
        draw_drift(out, p, &p->drifts[i]);
    }
    fleet_alarm_words(p, text);
    paragraph(out, "note", text);
}

void population_page(FILE *out, const char *results, const struct fleet_population *p)
{
    char text[FLEET_SENTENCE];
    (void)snprintf(text, sizeof text, "Fleet: %.400s", text_base_name(results));
    html_begin(out, text, "beamfit " BEAMFIT_VERSION, no_scripts, false);
    (void)fputs("<header>\n<h1>", out);
    html_text(out, text);
    (void)fputs("</h1>\n", out);
    (void)snprintf(text, sizeof text, "%zu units, %zu without a result · beamfit " BEAMFIT_VERSION, p->n_units,
                   p->n_failed);
    paragraph(out, "meta", text);
    fleet_diagnosis_words(p, text);
    if (text[0] != '\0')
        paragraph(out, "verdict", text);
    (void)fputs("</header>\n<h2>Over the fleet</h2>\n", out);
    if (p->has_mixed) {
        paragraph(
            out, "note",
            "Mean and spread over the units, the errors of their own estimates taken off (restricted maximum "
            "likelihood), without units that stand out. Pictures: each unit with twice its own standard error; the "
            "band is twice the spread; orange: stands out.");
        write_parameters(out, p);
        write_findings(out, p);
        write_units(out, p);
    } else {
        (void)snprintf(text, sizeof text, "None: %s.", p->why_not);
        paragraph(out, "warning", text);
    }
    (void)fputs("<footer>Made by beamfit " BEAMFIT_VERSION ". Everything on this page is inside this file.</footer>\n",
                out);
    html_end(out);
}
