/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * report_sketch.c — the beam seen from the side, drawn in the page itself (SVG): regions, patch, supports; inputs above,
 * outputs and effects that have a place below. Lengths along the beam are to scale, its thickness is not.
 */
#include "report_parts.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "ground/ground.h"

enum { WIDTH = 720, LEFT = 70, RIGHT = 650, ROW = 17, HALF = 6, MOST_ITEMS = 24, LONGEST = 30 };

struct item {
    const char *name;
    double x_m;
    bool patch; /* the place is the patch's middle */
    size_t row; /* of its label, away from the beam */
};

struct items {
    size_t n;
    struct item item[MOST_ITEMS];
};

static void add_item(struct items *items, const char *name, double x_m, bool patch)
{
    if (items->n < MOST_ITEMS)
        items->item[items->n++] = (struct item){.name = name, .x_m = x_m, .patch = patch};
}

static double place(const struct model *m, double x_m)
{
    return LEFT + (RIGHT - LEFT) * x_m / m->length_m;
}

static struct items inputs_of(const struct model *m)
{
    struct items items = {0};
    for (size_t i = 0; i < m->n_inputs; i++) {
        const struct model_input *in = &m->inputs[i];
        const bool patch = in->kind == INPUT_PATCH_MOMENT;
        add_item(&items, in->name, patch ? 0.5 * (in->from_m + in->to_m) : in->at_m, patch);
    }
    return items;
}

static struct items outputs_of(const struct model *m)
{
    struct items items = {0};
    for (size_t i = 0; i < m->n_outputs; i++) {
        const struct model_output *o = &m->outputs[i];
        const bool patch = o->kind == OUTPUT_PATCH_STRAIN;
        add_item(&items, o->name, patch ? 0.5 * (o->from_m + o->to_m) : o->at_m, patch);
    }
    for (size_t i = 0; i < m->n_effects; i++)
        for (int j = 0; j < m->effects[i].effect->n_parameters; j++)
            if (m->effects[i].effect->parameters[j].role == BEAM_ROLE_PLACE) {
                add_item(&items, m->effects[i].effect->id, m->effects[i].parameters[j].value, false);
                break;
            }
    return items;
}

/* Labels of the left half run to the right of their line, those of the right half to the left. */
static bool runs_right(const struct model *m, const struct item *item)
{
    return item->x_m < 0.5 * m->length_m;
}

/* From where to where a label goes, in the units of the picture. */
static void extent(const struct model *m, const struct item *item, double *from, double *to)
{
    const size_t length = text_width(item->name);
    const double x = place(m, item->x_m), width = 7.6 * (double)(length < LONGEST ? length : LONGEST) + 12.0;
    *from = runs_right(m, item) ? x - 4.0 : x - width;
    *to = runs_right(m, item) ? x + width : x + 4.0;
}

/* Nearest the beam: what is nearest to its middle, so that the lines of the others pass beside it. */
static int compare_items(const void *a, const void *b, void *model)
{
    const struct model *m = model;
    const double middle = 0.5 * m->length_m;
    const double p = fabs(((const struct item *)a)->x_m - middle), q = fabs(((const struct item *)b)->x_m - middle);
    return (p > q) - (p < q);
}

/* Each label in the first row where it meets none that is there; behind those of its half. Returns the number of rows. */
static size_t arrange(const struct model *m, struct items *items)
{
    size_t most = 0;
    qsort_r(items->item, items->n, sizeof *items->item, compare_items, (void *)(uintptr_t)m);
    for (size_t i = 0; i < items->n; i++) {
        struct item *item = &items->item[i];
        double from, to, other_from, other_to;
        extent(m, item, &from, &to);
        for (size_t k = 0; k < i; k++) { /* nearer ones are placed: their rows only grow along each half */
            extent(m, &items->item[k], &other_from, &other_to);
            const bool same_half = runs_right(m, item) == runs_right(m, &items->item[k]);
            if ((same_half || (from < other_to && other_from < to)) && item->row <= items->item[k].row)
                item->row = items->item[k].row + 1;
        }
        most = item->row + 1 > most ? item->row + 1 : most;
    }
    return most;
}

static double label_y(const struct item *item, double y_beam, int direction)
{
    return y_beam + direction * (2.0 * ROW + (double)ROW * (double)item->row);
}

/* Lines from the beam to the labels, then the labels; `direction` −1 above (inputs: arrows), +1 below (dots). */
static void draw_items(struct page *page, const struct items *items, double y_beam, int direction)
{
    const struct model *m = page->report->model;
    const char *colour = direction < 0 ? "#d55e00" : "#0072b2";
    for (size_t i = 0; i < items->n; i++) {
        const struct item *item = &items->item[i];
        const double x = place(m, item->x_m), edge = y_beam + direction * (HALF + (item->patch ? 4.0 : 0.0));
        (void)fprintf(page->out,
                      "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" stroke-width=\"1.2\"/>\n", x,
                      edge, x, label_y(item, y_beam, direction), colour);
        if (direction < 0)
            (void)fprintf(page->out, "<path d=\"M%.1f %.1fl-3.5 -8h7z\" fill=\"%s\"/>\n", x, edge, colour);
        else
            (void)fprintf(page->out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3\" fill=\"%s\"/>\n", x, edge + 1.0, colour);
    }
    for (size_t i = 0; i < items->n; i++) {
        const struct item *item = &items->item[i];
        const bool right = runs_right(m, item);
        const size_t length = text_width(item->name);
        (void)fprintf(page->out, "<text class=\"label\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">",
                      place(m, item->x_m) + (right ? 5.0 : -5.0),
                      label_y(item, y_beam, direction) + (direction < 0 ? 8.0 : 2.0), right ? "start" : "end");
        html_textf(page->out, "%.*s%s", LONGEST, item->name, length > LONGEST ? "…" : "");
        (void)fputs("</text>\n", page->out);
    }
}

static void draw_wall(FILE *out, double x, double y, int outward)
{
    (void)fprintf(
        out, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"currentColor\" stroke-width=\"2\"/>\n", x,
        y - 22.0, x, y + 22.0);
    for (int k = 0; k < 6; k++)
        (void)fprintf(out, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"currentColor\"/>\n", x,
                      y - 22.0 + 8.0 * k, x + 9.0 * outward, y - 14.0 + 8.0 * k);
}

static void draw_supports(struct page *page, double y)
{
    const enum model_support support = page->report->model->support;
    if (support == SUPPORT_CLAMPED_FREE || support == SUPPORT_CLAMPED_CLAMPED)
        draw_wall(page->out, LEFT, y, -1);
    if (support == SUPPORT_CLAMPED_CLAMPED)
        draw_wall(page->out, RIGHT, y, 1);
    if (support == SUPPORT_PINNED_PINNED)
        for (int end = 0; end < 2; end++)
            (void)fprintf(page->out, "<path d=\"M%d %.1fl-8 14h16z\" fill=\"none\" stroke=\"currentColor\"/>\n",
                          end ? RIGHT : LEFT, y + HALF);
}

static void draw_beam(struct page *page, double y)
{
    static const char *const fills[] = {"#e3e7eb", "#cfd6dd"};
    const struct model *m = page->report->model;
    double from_m, to_m;
    for (size_t i = 0; i < m->n_regions; i++)
        (void)fprintf(page->out,
                      "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%d\" fill=\"%s\" stroke=\"currentColor\" "
                      "stroke-width=\"0.8\"/>\n",
                      place(m, m->regions[i].from_m), y - HALF,
                      place(m, m->regions[i].to_m) - place(m, m->regions[i].from_m), 2 * HALF, fills[i % 2]);
    if (!model_patch(m, &from_m, &to_m))
        return;
    for (int side = 0; side < 2; side++)
        (void)fprintf(
            page->out,
            "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"4\" fill=\"#e69f00\" stroke=\"currentColor\" "
            "stroke-width=\"0.8\"/>\n",
            place(m, from_m), side ? y + HALF : y - HALF - 4.0, place(m, to_m) - place(m, from_m));
}

void report_sketch(struct page *page)
{
    const struct model *m = page->report->model;
    struct items inputs = inputs_of(m), outputs = outputs_of(m);
    const double y = 26.0 + (double)ROW * (1.0 + (double)arrange(m, &inputs));
    const double height = y + 44.0 + (double)ROW * (double)arrange(m, &outputs);
    (void)fprintf(
        page->out,
        "<figure><svg viewBox=\"0 0 %d %.0f\" role=\"img\" aria-label=\"the beam from the side\" font-size=\"13\" "
        "font-family=\"sans-serif\">\n",
        WIDTH, height);
    draw_items(page, &inputs, y, -1);
    draw_items(page, &outputs, y, 1);
    draw_beam(page, y);
    draw_supports(page, y);
    (void)fprintf(page->out,
                  "<text x=\"%d\" y=\"%.0f\" text-anchor=\"middle\">x = 0</text>\n<text x=\"%d\" y=\"%.0f\" "
                  "text-anchor=\"middle\">%.4g m</text>\n</svg>\n",
                  LEFT, height - 6.0, RIGHT, height - 6.0, m->length_m);
    (void)fputs("<figcaption>", page->out);
    html_text(page->out,
              "The beam from the side; lengths along it to scale, thickness not. Arrows: inputs. Dots: outputs, and "
              "effects that have a place. Orange: the patch.");
    (void)fputs("</figcaption></figure>\n", page->out);
}
