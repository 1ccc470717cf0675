/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_answer.c — the values of the answer of diagnose; diagnose_fields.c says what they are. */
#include "diagnose_answer.h"
#include "diagnose_next.h"
#include "show.h"
#include "explain/explain.h"

#include <math.h>
#include <stdlib.h>

static void put_effects(struct json *object, const struct hypothesis *h)
{
    struct json *list = json_put(object, "effects", json_new_array());
    for (size_t i = 0; i < h->n_effects; i++)
        json_push_text(list, h->effects[i]->id);
}

static void put_parameters(struct json *object, const struct diagnosis *d, const struct hypothesis *h)
{
    struct json *list = json_put(object, "parameters", json_new_object());
    const char **names = record_base_names(d->records, d->n_records);
    struct parameter_ref *refs;
    const size_t n = model_parameters(&h->model, names, d->n_records, &refs);
    for (size_t i = 0; i < n; i++) {
        if (refs[i].role != ROLE_EFFECT || refs[i].owner < h->n_base)
            continue;
        struct json *one = json_put(list, refs[i].label, json_new_object());
        json_put_number(one, "value", h->fit.value[i]);
        json_put_number(one, "sd", h->fit.sd[i]);
        if (h->fit.estimated[i]) {
            struct json *interval = json_put(one, "ci95", json_new_array());
            json_push_number(interval, h->fit.value[i] - 1.96 * h->fit.sd[i]);
            json_push_number(interval, h->fit.value[i] + 1.96 * h->fit.sd[i]);
        }
    }
    free(refs), free(names);
}

static void put_candidate(struct json *list, const struct diagnosis *d, const struct hypothesis *h)
{
    struct json *one = json_push(list, json_new_object());
    char name[256] = "";
    FILE *out = fmemopen(name, sizeof name, "w");
    if (out != NULL) {
        hypothesis_name(out, h);
        (void)fclose(out);
    }
    json_put_text(one, "name", name);
    put_effects(one, h);
    struct json *channels = json_put(one, "channels", json_new_array());
    for (size_t i = 0; i < h->n_effects; i++) /* "": the effect's default channels, or none */
        json_push_text(channels, h->model.effects[h->n_base + i].channel);
    json_put_number(one, "p_value", h->p_value);
    json_put_number(one, "bic_gain", h->evidence.bic_gain);
    json_put_number(one, "nrmse_after", h->fitted.nrmse);
    json_put_number(one, "check_nrmse_after", h->check.nrmse);
    json_put_number(one, "noise_ratio_after", h->fitted.noise_ratio);
    json_put_number(one, "check_noise_ratio_after", h->check.noise_ratio);
    json_put_number(one, "probability", h->probability);
    json_put_number(one, "score", h->score);
    json_put_number(one, "explained", h->explained);
    json_put_number(one, "held_out_explained", h->held_out_explained);
    json_put_bool(one, "explains", h->explains);
    json_put_bool(one, "open_values", h->open_values);
    json_put_bool(one, "rival", h->rival);
    json_put_bool(one, "converged", h->fit.converged);
    json_put_number(one, "other_at_m", h->has_other_place ? h->other_at_m : nan(""));
    json_put_number(one, "seconds", h->fit.seconds);
    put_parameters(one, d, h);
}

/* What the best answer leaves, and where. */
static void put_remains(struct json *root, const struct diagnosis *d, const struct hypothesis *after)
{
    const bool added = after != &d->baseline;
    const struct localisation *where = added ? &d->remains : &d->where;
    struct json *object = json_put(root, "remains", json_new_object());
    struct misfit_channel *channels = hypothesis_channels(d, after);
    json_put_number(object, "noise_ratio", after->fitted.noise_ratio);
    json_put_number(object, "nrmse", after->fitted.nrmse);
    (void)json_put(object, "where", localise_json(where, channels));
    json_put_text(object, "text", where->text);
    free(channels);
}

/* Of hypothesis i; n_hypotheses: the model as it is. */
static void put_ids(struct json *list, const struct diagnosis *d, size_t i)
{
    for (size_t e = 0; i < d->n_hypotheses && e < d->hypotheses[i].n_effects; e++)
        json_push_text(list, d->hypotheses[i].effects[e]->id);
}

static void put_decisions(struct json *root, const struct diagnosis *d)
{
    struct json *list = json_put(root, "decision", json_new_array());
    for (size_t k = 0; k < d->n_decisions; k++) {
        const struct decision *decision = &d->decisions[k];
        struct json *one = json_push(list, json_new_object()), *all = json_put(one, "effects", json_new_array());
        for (size_t i = 0; i < decision->n; i++)
            json_push_text(all, decision->among[i]->id);
        struct json *beside = json_put(one, "beside", json_new_array());
        for (size_t i = 0; i < decision->n_beside; i++)
            json_push_text(beside, decision->beside[i]->id);
        put_ids(json_put(one, "with", json_new_array()), d, decision->with);
        put_ids(json_put(one, "without", json_new_array()), d, decision->without);
        json_put_number(one, "probability", decision->probability);
        struct json *features = json_put(one, "features", json_new_object());
        for (int f = 0; f < FEATURES; f++)
            json_put_number(features, feature_name((enum feature)f), decision->feature[f]);
    }
}

static void put_linearity(struct json *root, const struct linearity *linearity)
{
    struct json *object = json_put(root, "linearity", json_new_object());
    json_put_text(object, "verdict", linearity_verdict_text(linearity->verdict));
    json_put_number(object, "ratio", linearity->n_pairs > 0 ? linearity->pairs[0].ratio : nan(""));
    json_put_text(object, "text", linearity->text);
}

static void put_channel(struct json *list, const char *name, const struct channel_parameters *own, double at_m)
{
    if (!own->lists_at && !own->lists_gain)
        return;
    struct json *object = json_push(list, json_new_object());
    json_put_text(object, "channel", name);
    json_put_number(object, "at_m", at_m);
    json_put_number(object, "stated_at_m", own->lists_at ? own->at.prior_value : at_m);
    json_put_number(object, "gain", own->gain.value);
    json_put_number(object, "stated_gain", own->lists_gain ? own->gain.prior_value : own->gain.value);
}

/* Places and gains that were fitted although the file holds them, in the model of the answer. */
static void put_rig(struct json *root, const struct diagnosis *d)
{
    const struct model *model = d->n_named > 0 ? &d->hypotheses[0].model : &d->baseline.model;
    struct json *object = json_put(root, "rig", json_new_object());
    json_put_bool(object, "free", d->free_rig);
    struct json *list = json_put(object, "channels", json_new_array());
    for (size_t i = 0; i < model->n_inputs && d->free_rig; i++)
        put_channel(list, model->inputs[i].name, &model->inputs[i].own, model->inputs[i].at_m);
    for (size_t o = 0; o < model->n_outputs && d->free_rig; o++)
        put_channel(list, model->outputs[o].name, &model->outputs[o].own, model->outputs[o].at_m);
}

static void put_numerics(struct json *root, const struct diagnosis *d)
{
    const struct predict_channel *worst = &d->baseline.fit.channels[d->numerics.channel];
    struct json *object = json_put(root, "numerics", json_new_object());
    json_put_number(object, "change_over_noise", d->numerics.change);
    json_put_text(object, "file", d->records[worst->record].path);
    json_put_text(object, "channel", d->model->outputs[worst->output].name);
    json_put_bool(object, "converged", d->converged);
    json_put_bool(object, "fine", d->numerics.fine);
}

static void put_reconstruction(struct json *root, const struct reconstruction *r)
{
    static const char *const places[] = {"point", "patch", "spread"};
    struct json *object = json_put(root, "reconstruction", json_new_object());
    json_put_text(object, "place", places[r->best.place]);
    json_put_number(object, "at_m", r->best.place == RECONSTRUCT_POINT ? r->best.at_m : nan(""));
    json_put_bool(object, "located", r->located);
    json_put_number(object, "unexplained", r->is_law ? r->best.by_law : r->best.by_history);
    json_put_number(object, "linear", r->linear);
    json_put_number(object, "elastic_odd", r->elastic_odd);
    json_put_number(object, "elastic_even", r->elastic_even);
    json_put_number(object, "dissipative", r->dissipative);
    json_put_number(object, "memory", r->memory);
    json_put_number(object, "amplitude_power", r->amplitude_power);
    json_put_number(object, "frequency_Hz", r->frequency_Hz);
    json_put_bool(object, "resonant", r->resonant);
    json_put_bool(object, "sensor_like", r->sensor_like);
    json_put_text(object, "text", r->text);
}

static void put_by_record(struct json *root, const struct diagnosis *d)
{
    struct json *list = json_put(root, "by_record", json_new_array());
    for (size_t i = 0; i < d->n_by_record; i++) {
        const struct hypothesis *h = &d->by_record[i];
        const struct model_effect *own = &h->model.effects[h->n_base];
        const int slot = diagnose_own_slot(h);
        struct json *one = json_push(list, json_new_object()), *values;
        json_put_text(one, "effect", own->effect->id);
        json_put_text(one, "parameter", own->effect->parameters[slot].name);
        json_put_text(one, "unit", own->effect->parameters[slot].unit);
        json_put_number(one, "noise_ratio_after", h->fitted.noise_ratio);
        json_put_number(one, "check_noise_ratio_after", h->check.noise_ratio);
        json_put_number(one, "explained", h->explained);
        values = json_put(one, "values", json_new_object());
        for (size_t k = 0; k < own->n_per_record; k++)
            if (own->per_record[k].parameter == slot)
                json_put_number(values, own->per_record[k].record, own->per_record[k].value);
    }
}

void diagnose_put_next(struct json *root, const struct diagnosis *d, const char *written,
                       const struct channel_factors *factors)
{
    struct json *list = json_put(root, "next", json_new_array());
    struct diagnose_next next;
    diagnose_next(d, written, factors, &next);
    for (size_t i = 0; i < next.n; i++)
        json_push_text(list, next.command[i]);
    diagnose_next_free(&next);
}

struct json *diagnose_json(const struct diagnosis *d, const char *written, const struct channel_factors *factors)
{
    const struct hypothesis *before = &d->baseline, *after = d->n_hypotheses > 0 ? &d->hypotheses[0] : before;
    if (d->verdict == VERDICT_COMPLETE)
        after = before;
    struct json *root = json_new_object();
    json_put_text(root, "verdict", verdict_name(d->verdict));
    struct json *effects = json_put(root, "effects", json_new_array());
    for (size_t i = 0; i < d->n_named; i++)
        json_push_text(effects, d->named[i]);
    json_put_number(root, "probability", d->probability);
    json_put_number(root, "explained",
                    d->n_named > 0
                        ? (isfinite(after->held_out_explained) ? after->held_out_explained : after->explained)
                        : nan(""));
    json_put_number(root, "nrmse_before", before->fitted.nrmse);
    json_put_number(root, "nrmse_after", after->fitted.nrmse);
    json_put_number(root, "noise_ratio_before", before->fitted.noise_ratio);
    json_put_number(root, "noise_ratio_after", after->fitted.noise_ratio);
    json_put_number(root, "check_nrmse_before", before->check.nrmse);
    json_put_number(root, "check_nrmse_after", after->check.nrmse);
    json_put_number(root, "check_noise_ratio_before", before->check.noise_ratio);
    json_put_number(root, "check_noise_ratio_after", after->check.noise_ratio);
    attainable_json(root, &d->attainable, before->fitted.nrmse);
    put_rig(root, d);
    json_put_text(root, "check_kind", check_kind_name(d->check_kind));
    json_put_text(
        root, "check_text",
        d->check_kind == CHECK_CROSS
            ? "Held out: each record in turn, predicted by a fit to the others; only of what the verdict hangs on."
            : "");
    json_put_text(root, "where_text", d->verdict != VERDICT_COMPLETE ? d->where.text : "");
    struct misfit_channel *channels = hypothesis_channels(d, before);
    (void)json_put(root, "where", localise_json(&d->where, channels));
    free(channels);
    struct json *candidates = json_put(root, "candidates", json_new_array());
    bool all_converged = true;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        put_candidate(candidates, d, &d->hypotheses[i]);
        all_converged = all_converged && (i >= DIAGNOSE_LISTED || d->hypotheses[i].fit.converged);
    }
    json_put_bool(root, "all_converged", all_converged);
    put_by_record(root, d);
    put_decisions(root, d);
    put_remains(root, d, after);
    put_numerics(root, d);
    put_linearity(root, &d->linearity);
    if (d->reconstructed)
        put_reconstruction(root, &d->reconstruction);
    diagnose_put_next(root, d, written, factors);
    json_put_text(root, "text", d->text);
    json_put_bool(root, "converged", d->converged);
    json_put_bool(root, "interrupted", d->interrupted);
    json_put_number(root, "evaluations", (double)d->evaluations);
    json_put_number(root, "refits_failed", (double)d->n_failed);
    json_put_number(root, "seconds", d->seconds);
    return root;
}
