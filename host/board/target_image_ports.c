/* SPDX-License-Identifier: GPL-3.0-or-later */
/* target_image_ports.c — uses and ports of the effects that a step calls. */
#include "response/response.h"
#include "deployment.h"

#include <math.h>
#include <string.h>

static enum bf_status too_many(const char *what, int most, struct bf_error *err)
{
    return bf_fail(err, BF_BAD_FILE, "the model's effects need more %s than the %d a controller carries; drop one",
                   what, most);
}

static enum bf_status add_use(struct deployment *d, size_t e, bool channels, struct bf_error *err)
{
    static const unsigned first_channel = 1u, no_channel = 1u << 31;
    if (d->out.n_uses == BEAM_USES)
        return too_many("uses of effects", BEAM_USES, err);
    struct beam_use *use = &d->out.use[d->out.n_uses++];
    use->effect = d->model.effects[e].effect;
    use->channels = channels ? first_channel : no_channel;
    target_values(&d->model.effects[e], use->p);
    return BF_OK;
}

static enum bf_status add_port(struct deployment *d, double weight, const double vector[], struct bf_error *err)
{
    if (d->out.n_ports == BEAM_IMAGE_PORTS)
        return too_many("law coordinates", BEAM_IMAGE_PORTS, err);
    struct beam_port *port = &d->out.port[d->out.n_ports++];
    *port = (struct beam_port){.use = d->out.n_uses - 1, .coordinate = 0, .weight = weight};
    memcpy(port->vector, vector, sizeof port->vector);
    return BF_OK;
}

/* Nodes and weights of Gauss and Legendre's rule on [−1, 1]: Newton on P_n from Chebyshev's nodes. */
static void gauss_legendre(int n, double x[], double w[])
{
    const double pi = acos(-1.0);
    for (int i = 0; i < n; i++) {
        double z = cos(pi * (i + 0.75) / (n + 0.5)), slope = 1.0;
        for (int turn = 0; turn < 20; turn++) {
            double p = 1.0, before = 0.0;
            for (int k = 1; k <= n; k++) {
                const double next = ((2.0 * k - 1.0) * z * p - (k - 1.0) * before) / k;
                before = p;
                p = next;
            }
            slope = n * (z * p - before) / (z * z - 1.0);
            z -= p / slope;
        }
        x[i] = z;
        w[i] = 2.0 / ((1.0 - z * z) * slope * slope);
    }
}

/* So many quadrature points to each region: one, and further ones where the points stand farthest apart. */
static void share_points(const struct model *model, int points, int share[])
{
    for (size_t r = 0; r < model->n_regions; r++)
        share[r] = 1;
    for (int given = (int)model->n_regions; given < points; given++) {
        size_t widest = 0;
        double gap = 0.0;
        for (size_t r = 0; r < model->n_regions; r++) {
            const double mean = (model->regions[r].to_m - model->regions[r].from_m) / share[r];
            if (mean > gap) {
                gap = mean;
                widest = r;
            }
        }
        share[widest]++;
    }
}

static enum bf_status add_span_ports(struct deployment *d, const struct beam_law_place *place, int points,
                                     struct bf_error *err)
{
    const int derivative = place->points == BEAM_LAW_OVER_DEFLECTION ? 0 : 2;
    int share[BEAM_IMAGE_PORTS] = {0};
    double x[BEAM_IMAGE_PORTS], w[BEAM_IMAGE_PORTS], vector[BEAM_N];
    enum bf_status status = BF_OK;
    share_points(&d->model, points, share);
    for (size_t r = 0; r < d->model.n_regions; r++) {
        const double from = d->model.regions[r].from_m, half = 0.5 * (d->model.regions[r].to_m - from);
        gauss_legendre(share[r], x, w);
        for (int q = 0; status == BF_OK && q < share[r]; q++) {
            reduced_point(&d->reduced, derivative, from + half * (1.0 + x[q]), vector);
            status = add_port(
                d,
                half * w[q] *
                    model_weight(&d->model, model_material(&d->model, d->model.regions[r].name), place->weight),
                vector, err);
        }
    }
    return status;
}

static bool is_span(enum beam_law_points points)
{
    return points == BEAM_LAW_OVER_DEFLECTION || points == BEAM_LAW_OVER_CURVATURE ||
           points == BEAM_LAW_OVER_SLOPE_AND_CURVATURE;
}

static enum bf_status law_place_of(const struct deployment *d, size_t e, struct beam_law_place *out,
                                   struct bf_error *err)
{
    const struct beam_effect *effect = d->model.effects[e].effect;
    const struct beam_place place = model_place(&d->model);
    double p[BEAM_EFFECT_PARAMETERS];
    *out = (struct beam_law_place){.points = BEAM_LAW_NONE};
    target_values(&d->model.effects[e], p);
    if (effect->law != NULL && effect->law_place(p, &place, out) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
    return BF_OK;
}

/* What laws at points leave of the ports, shared by the laws over the span. */
static enum bf_status count_points(const struct deployment *d, int *per_span, struct bf_error *err)
{
    int at_points = 0, spans = 0;
    for (size_t e = 0; e < d->model.n_effects; e++) {
        struct beam_law_place place;
        const enum bf_status status = law_place_of(d, e, &place, err);
        if (status != BF_OK)
            return status;
        spans += is_span(place.points);
        at_points += place.points != BEAM_LAW_NONE && !is_span(place.points);
    }
    *per_span = spans > 0 ? (BEAM_IMAGE_PORTS - at_points) / spans : 0;
    const int least = d->model.n_regions > 4 ? (int)d->model.n_regions : 4;
    if (at_points > BEAM_IMAGE_PORTS || (spans > 0 && *per_span < least))
        return too_many("law coordinates", BEAM_IMAGE_PORTS, err);
    return BF_OK;
}

static enum bf_status add_law(struct deployment *d, size_t e, int per_span, struct target_effect *said,
                              struct bf_error *err)
{
    struct beam_law_place place;
    enum bf_status status = law_place_of(d, e, &place, err);
    if (status != BF_OK)
        return status;
    if (place.points == BEAM_LAW_OVER_SLOPE_AND_CURVATURE)
        return bf_fail(err, BF_BAD_FILE,
                       "effect %s needs two coordinates at each point, which a controller has not; "
                       "give --without %s",
                       said->id, said->id);
    if (is_span(place.points)) {
        target_say(said, true, "a law at %d points over the span", per_span);
        return add_span_ports(d, &place, per_span, err);
    }
    struct beam_operator at = {.kind = BEAM_AT_SLOPE_DIFFERENCE,
                               .at_m = place.at_m,
                               .from_m = place.at_m - 0.5 * place.width_m,
                               .to_m = place.at_m + 0.5 * place.width_m};
    double vector[BEAM_N], unused[BEAM_N];
    if (place.points == BEAM_LAW_AT_POINT)
        at.kind = BEAM_AT_POINT;
    else if (place.points == BEAM_LAW_AT_PATCH)
        at.kind = BEAM_AT_PATCH;
    reduced_place(&d->reduced, &at, &d->model, vector, unused);
    target_say(said, true, "a law at 1 point");
    return add_port(d, 1.0, vector, err);
}

/* (π f/f_s)²/3 = (f/f₀)² */
static void note_lines(const struct beam_effect *effect, struct target_image *image)
{
    const double f0_Hz = image->board.sample_Hz * sqrt(3.0) / acos(-1.0);
    target_note(image, "%s draws straight lines between samples: what it changes at f Hz is off by about (f/%.0f)^2",
                effect->id, f0_Hz);
}

/* Filters before maps and signals, as the host's prediction has them; each kind in the model's order. */
static enum bf_status deploy_effect(struct deployment *d, size_t e, bool second_turn, int per_span,
                                    struct target_image *image, struct bf_error *err)
{
    const struct beam_effect *effect = d->model.effects[e].effect;
    struct target_effect *said = &image->effects[d->origin[e]];
    const bool late = effect->map != NULL || effect->signal != NULL;
    const bool on_sensor = effect_on_output(&d->model, e, 0),
               on_drive = effect->drive != NULL && effect_on_input(&d->model, e, 0);
    if (late != second_turn)
        return BF_OK;
    if (effect->law == NULL && !on_sensor && !on_drive) {
        if (!said->fate[0])
            target_say(said, false, "in the matrices");
        return BF_OK;
    }
    enum bf_status status = add_use(d, e, on_sensor || on_drive, err);
    if (status == BF_OK && on_sensor && ++d->n_links > BEAM_CHAIN)
        status = too_many("effects on the sensor", BEAM_CHAIN, err);
    if (status == BF_OK && (effect->law != NULL || effect->filter != NULL))
        note_lines(effect, image);
    if (status == BF_OK && effect->law != NULL)
        return add_law(d, e, per_span, said, err);
    target_say(said, true, "%s %s",
               effect->filter != NULL ? "a filter on"
               : on_drive             ? "acts on"
                                      : "a map on",
               on_drive ? image->board.drive : image->board.sensor);
    return status;
}

enum bf_status deploy_effects(struct deployment *d, struct target_image *image, struct bf_error *err)
{
    int per_span = 0;
    enum bf_status status = count_points(d, &per_span, err);
    for (int turn = 0; turn < 2; turn++)
        for (size_t e = 0; status == BF_OK && e < d->model.n_effects; e++)
            status = deploy_effect(d, e, turn == 1, per_span, image, err);
    return status;
}
