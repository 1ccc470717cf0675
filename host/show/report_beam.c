/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report_beam.c — what the model says of the beam: geometry, channels, parameters, effects. */
#include "report_parts.h"
#include "report_verdict.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Geometry and channels ---- */

static const char *support_text(enum model_support support)
{
    static const char *const texts[] = {"clamped at x = 0, free at the other end", "clamped at both ends",
                                        "pinned at both ends", "free at both ends"};
    return (size_t)support < sizeof texts / sizeof *texts ? texts[support] : "";
}

static void write_geometry(struct page *page)
{
    const struct model *m = page->report->model;
    double from_m, to_m;
    (void)fputs("<p>", page->out);
    html_textf(page->out, "Length %.6g m, %s. ", m->length_m, support_text(m->support));
    if (model_patch(m, &from_m, &to_m))
        html_textf(page->out, "Patch from %.6g m to %.6g m.", from_m, to_m);
    else
        html_text(page->out, "No patch.");
    (void)fputs("</p>\n", page->out);
    report_sketch(page);
    (void)fputs("<div class=\"side\">\n", page->out);
    html_table_begin(page->out, "regions", "Region|>From (m)|>To (m)");
    for (size_t i = 0; i < m->n_regions; i++) {
        (void)fputs("<tr>", page->out);
        html_cell(page->out, "%s", m->regions[i].name);
        html_number_cell(page->out, m->regions[i].from_m, 1.0, "%.6g");
        html_number_cell(page->out, m->regions[i].to_m, 1.0, "%.6g");
        (void)fputs("</tr>\n", page->out);
    }
    html_table_end(page->out);
}

static void write_channel(struct page *page, const char *name, const char *use, const char *what, double from_m,
                          double to_m)
{
    (void)fputs("<tr>", page->out);
    html_name_cell(page->out, name);
    html_cell(page->out, "%s", use);
    html_cell(page->out, "%s", what);
    if (to_m > from_m)
        html_cell(page->out, "%.6g … %.6g m", from_m, to_m);
    else
        html_cell(page->out, "%.6g m", from_m);
    (void)fputs("</tr>\n", page->out);
}

static void write_channels(struct page *page)
{
    static const char *const inputs[] = {"force at a point", "moment of the patch"};
    static const char *const outputs[] = {"displacement", "velocity", "acceleration", "strain of the patch"};
    const struct model *m = page->report->model;
    html_table_begin(page->out, "channels", "Channel|Use|What it is|Place");
    for (size_t i = 0; i < m->n_inputs; i++) {
        const struct model_input *in = &m->inputs[i];
        const bool patch = in->kind == INPUT_PATCH_MOMENT;
        write_channel(page, in->name, "input", inputs[in->kind], patch ? in->from_m : in->at_m, patch ? in->to_m : 0.0);
    }
    for (size_t i = 0; i < m->n_outputs; i++) {
        const struct model_output *o = &m->outputs[i];
        const bool patch = o->kind == OUTPUT_PATCH_STRAIN;
        write_channel(page, o->name, "output", outputs[o->kind], patch ? o->from_m : o->at_m, patch ? o->to_m : 0.0);
    }
    html_table_end(page->out);
    (void)fputs("</div>\n", page->out);
}

void report_beam(struct page *page)
{
    page_heading(page, "The beam");
    write_geometry(page);
    write_channels(page);
}

/* ---- Parameters ---- */

/* The value to the second digit of its standard error, and that error; six digits where there is none. */
static void value_cells(FILE *out, double value, double sd)
{
    char format[16] = "%.6g", error_format[24] = "";
    const double size = fabs(value);
    if (sd > 0.0 && isfinite(sd) && size > 0.0) {
        const int last = (int)floor(log10(sd)) - 1; /* power of ten of the last digit to show */
        const int decimals = last > 0 ? 0 : last < -12 ? 12 : -last, digits = (int)floor(log10(size)) - last;
        const bool plain = size >= 1e-3 && size < 1e6 && sd < 1e6;
        (void)snprintf(format, sizeof format, plain ? "%%.%df" : "%%.%de",
                       plain         ? decimals
                       : digits < 0  ? 0
                       : digits > 12 ? 12
                                     : digits);
        (void)snprintf(error_format, sizeof error_format, plain ? "± %%.%df" : "± %%.%de", plain ? decimals : 1);
    }
    if (isinf(value))
        (void)fputs(value < 0.0 ? "<td class=\"n\">−∞</td>" : "<td class=\"n\">∞</td>", out);
    else
        html_number_cell(out, value, 1.0, format);
    html_number_cell(out, error_format[0] ? sd : (double)NAN, 1.0, error_format);
    html_number_cell(out, error_format[0] ? sd / size : (double)NAN, 100.0, sd < size ? "%.2g %%" : "%.0f %%");
}

/* How the value came about: held, fitted, prior, bounds. */
static void source_cell(FILE *out, const struct model *m, const struct parameter *p, double value, double sd)
{
    (void)fputs("<td>", out);
    if (p->fixed)
        html_text(out, "held");
    else if (sd > 0.0)
        html_text(out, m->fit.present ? "fitted" : "from an earlier fit");
    else
        html_text(out, m->fit.present ? "not determined by the fitted records" : "free, not fitted yet");
    if (p->prior > 0.0 && !p->fixed)
        html_textf(out, "; prior %.4g %s%s± %.3g %%", p->prior_value, p->unit, p->unit[0] ? " " : "", 100.0 * p->prior);
    if (!p->fixed && (value <= p->min || value >= p->max))
        html_text(out, "; at its bound");
    (void)fputs("</td>", out);
}

static void parameter_row(FILE *out, const struct model *m, const struct parameter *p, const char *label,
                          const char *what, double value, double sd)
{
    (void)fputs("<tr>", out);
    html_name_cell(out, label);
    html_cell(out, "%s", what);
    value_cells(out, value, sd);
    html_cell(out, "%s", p->unit[0] ? p->unit : "1");
    source_cell(out, m, p, value, sd);
    (void)fputs("</tr>\n", out);
}

/* At 0, and nobody estimated it: a parameter that the file lacks. */
static bool is_absent(const struct parameter *p)
{
    return !(p->value > 0.0) && !(p->value < 0.0) && !(p->sd > 0.0);
}

static void what_it_is(const struct model *m, const struct parameter_ref *ref, char text[200])
{
    static const char *const of_region[] = {"bending stiffness of", "mass per length of", "internal damping of"};
    static const char *const of_beam[] = {"air damping", "patch as sensor: per radian of slope difference",
                                          "patch as actuator: moment per volt"};
    if (ref->role <= ROLE_CDI)
        (void)snprintf(text, 200, "%s '%s'", of_region[ref->role], m->materials[ref->owner].name);
    else if (ref->role <= ROLE_KB)
        (void)snprintf(text, 200, "%s", of_beam[ref->role - ROLE_GAMMA]);
    else if (ref->role == ROLE_RESIDUAL)
        (void)snprintf(text, 200, "direct path from %s to %s", m->inputs[m->residuals[ref->owner].input].name,
                       m->outputs[m->residuals[ref->owner].output].name);
    else
        text[0] = '\0';
}

/* Every parameter of the beam itself, in the order of the file; effects have a table of their own. */
static void write_parameters(struct page *page)
{
    const struct model *m = page->report->model;
    char absent[1500] = "", what[200];
    struct parameter_ref *refs;
    const size_t n = model_parameters(m, NULL, 0, &refs);
    html_table_begin(page->out, "parameters",
                     "Parameter|What it is|>Value|>Standard error|>Relative|Unit|How it is known");
    for (size_t i = 0; i < n; i++) {
        const size_t used = strlen(absent);
        if (refs[i].role == ROLE_EFFECT)
            continue;
        if (is_absent(refs[i].info)) {
            (void)snprintf(absent + used, sizeof absent - used, "%s%s", used > 0 ? ", " : "", refs[i].label);
            continue;
        }
        what_it_is(m, &refs[i], what);
        parameter_row(page->out, m, refs[i].info, refs[i].label, what, refs[i].value, refs[i].info->sd);
    }
    html_table_end(page->out);
    if (absent[0] != '\0')
        page_note(page, "At 0: %s.", absent);
    free(refs);
}

/* ---- Effects ---- */

static void write_effect(struct page *page, const struct model_effect *e)
{
    const struct model *m = page->report->model;
    (void)fputs("<tr><td colspan=\"7\"><b>", page->out);
    html_text(page->out, e->effect->id);
    (void)fputs("</b>: ", page->out);
    html_textf(page->out, "%s%s%s; %s", e->effect->title, e->channel[0] ? ", on channel " : "", e->channel,
               e->effect->form);
    (void)fputs("</td></tr>\n", page->out);
    for (int j = 0; j < e->effect->n_parameters; j++) {
        const struct parameter *p = &e->parameters[j];
        const char *what = e->effect->parameters[j].what;
        char label[400];
        size_t own = 0;
        for (size_t k = 0; k < e->n_per_record; k++) {
            if (e->per_record[k].parameter != j)
                continue;
            own++;
            (void)snprintf(label, sizeof label, "%s, in %s", p->name, e->per_record[k].record);
            parameter_row(page->out, m, p, label, what, e->per_record[k].value, e->per_record[k].sd);
        }
        if (own == 0)
            parameter_row(page->out, m, p, p->name, what, p->value, p->sd);
    }
}

void report_parameters(struct page *page)
{
    const struct model *m = page->report->model;
    page_heading(page, "Parameters");
    write_parameters(page);
    if (report_leaves_more(page->report))
        page_note(page, "The model leaves more than the noise: these standard errors say nothing of what it lacks.");
    page_heading(page, "Effects beyond the plain beam");
    if (m->n_effects == 0) {
        page_note(page, "None: bending, mass, internal and air damping only.");
        return;
    }
    html_table_begin(page->out, "effects",
                     "Parameter|What it is|>Value|>Standard error|>Relative|Unit|How it is known");
    for (size_t i = 0; i < m->n_effects; i++)
        write_effect(page, &m->effects[i]);
    html_table_end(page->out);
}
