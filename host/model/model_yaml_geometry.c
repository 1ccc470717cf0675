/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_geometry.c — lengths and places that may be parameters, read. */
#include "model_parts.h"
#include "model_yaml.h"

#include <math.h>
#include <string.h>

#include "ground/ground.h"

/* The standard deviation of a place that was measured, in metres: `prior_m`, or `sd` where no fit has been. Kept relative. */
static enum bf_status read_prior_m(const struct yaml_reader *r, const struct yaml_node *node, struct parameter *at)
{
    const struct yaml_node *own = yaml_get(node, "prior_m", NULL), *sd = yaml_get(node, "sd", NULL);
    const struct yaml_node *stated = own ? own : sd; /* beside `prior` an sd is what the last fit found */
    double prior_m = 0.0;
    if (!stated || (!own && yaml_get(node, "prior", NULL)))
        return BF_OK;
    const enum bf_status status = yaml_number(r, stated, own ? "prior_m" : "sd", &prior_m);
    if (status == BF_OK && !(prior_m > 0.0 && isfinite(prior_m)))
        return yaml_fail(r, stated, "the standard deviation of a place is %g; write metres above 0, e.g. 0.002",
                         prior_m);
    const struct yaml_node *centre = yaml_get(node, "prior_value", NULL);
    at->prior_value = at->value;
    if (status == BF_OK && centre && yaml_number(r, centre, "prior_value", &at->prior_value) != BF_OK)
        return BF_BAD_FILE;
    if (status == BF_OK && !(at->prior_value > 0.0))
        return yaml_fail(r, stated, "%s is %g m with a standard deviation; write at least 1e-6 m, or hold it", at->name,
                         at->prior_value);
    at->prior = prior_m / at->prior_value;
    if (status == BF_OK && !(at->prior > 0.0 && isfinite(at->prior)))
        return yaml_fail(r, stated, "the standard deviation of a place at %g m is %g m; write metres, e.g. 0.002",
                         at->prior_value, prior_m);
    if (status == BF_OK && own && !(at->sd >= 0.0 && isfinite(at->sd)))
        return yaml_fail(r, sd, "%s: sd is %g; a standard error is at least 0", at->name, at->sd);
    at->sd = own ? at->sd : 0.0;
    return status;
}

enum { MOST_PLACES = 10000 };

enum bf_status yaml_stated_places(const struct yaml_reader *r, const struct yaml_node *at, const char *channel)
{
    const struct yaml_node *list = yaml_get(at, "per_record", NULL);
    struct model *m = r->model;
    if (!list || yaml_is_nothing(list))
        return BF_OK;
    enum bf_status status = yaml_expect(r, list, YAML_MAPPING, "per_record");
    if (status == BF_OK && m->n_stated + list->n > MOST_PLACES)
        return yaml_fail(r, list, "more than %d records; delete some", MOST_PLACES);
    for (size_t i = 0; status == BF_OK && i < list->n; i++) {
        struct stated_place place = {0};
        (void)snprintf(place.channel, sizeof place.channel, "%s", channel);
        status = yaml_name(r, list->key[i], "a record's name", sizeof place.record, place.record);
        if (status == BF_OK)
            status = yaml_number(r, list->value[i], place.record, &place.at_m);
        if (status == BF_OK && !(place.at_m >= 0.0 && place.at_m <= m->length_m))
            status =
                yaml_fail(r, list->value[i], "%s is at %g m in %.60s, outside the beam (0 … %g m); is it in metres?",
                          channel, place.at_m, place.record, m->length_m);
        m->stated = bf_grow(m->stated, m->n_stated + 1, sizeof *m->stated);
        m->stated[m->n_stated++] = place;
    }
    return status;
}

enum bf_status yaml_length(const struct yaml_reader *r, const struct yaml_node *node, struct parameter *out,
                           bool *listed)
{
    static const char *const known[] = {"value", "prior", "prior_m", "prior_value", "fixed",
                                        "min",   "max",   "sd",      "per_record"};
    const bool of_channel = strcmp(out->name, "at_m") == 0;
    *listed = node->kind == YAML_MAPPING;
    out->fixed = !*listed;
    enum bf_status status = BF_OK;
    if (*listed)
        status = yaml_known_keys(r, node, out->name, known, of_channel ? 9 : 8);
    if (status == BF_OK)
        status = yaml_place(r, node, out);
    if (status == BF_OK && *listed)
        status = read_prior_m(r, node, out);
    return status;
}

enum bf_status yaml_read_length(const struct yaml_reader *r, const struct yaml_node *node)
{
    struct geometry_parameters *own = &r->model->own;
    model_parameter_init(&own->length, "length_m", "m", false);
    const enum bf_status status = yaml_length(r, node, &own->length, &own->lists_length);
    r->model->length_m = own->length.value;
    return status;
}

enum bf_status yaml_read_patch(const struct yaml_reader *r, const struct yaml_node *node, double *from_m, double *to_m)
{
    struct geometry_parameters *own = &r->model->own;
    model_parameter_init(&own->from, "patch_from_m", "m", false);
    model_parameter_init(&own->to, "patch_to_m", "m", false);
    if (node->kind != YAML_SEQUENCE || node->n != 2)
        return yaml_interval(r, node, "patch_m", from_m, to_m);
    enum bf_status status = yaml_length(r, node->value[0], &own->from, &own->lists_from);
    if (status == BF_OK)
        status = yaml_length(r, node->value[1], &own->to, &own->lists_to);
    *from_m = own->from.value;
    *to_m = own->to.value;
    return status == BF_OK ? yaml_check_interval(r, node, "patch_m", *from_m, *to_m) : status;
}
