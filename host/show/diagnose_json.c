/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of diagnose for programs; its keys stand in `beamfit diagnose --help`. */
#include "show.h"
#include "diagnose_next.h"
#include "explain/explain.h"

#include <math.h>
#include <stdlib.h>

static const struct answer_field localisation_fields[] = {
    ANSWER_ROW(TEXT, "file", "the record"),
    ANSWER_ROW(TEXT, "channel", "of it"),
    ANSWER_ROW(NUMBER, "from_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "to_Hz", "of the band"),
    ANSWER_ROW(NUMBER, "share", "of the misfit's power"),
    ANSWER_ROW(TEXT, "amplitude", "all, large or small: at which size of the motion"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over noise there"),
    ANSWER_ROW(NUMBER, "relative", "misfit over signal there"),
    ANSWER_ROW(NUMBER, "late_share", "of it in the later half"),
    {0},
};

static const struct answer_field parameter_fields[] = {
    ANSWER_ROW(NUMBER, "value", "in SI units"),
    ANSWER_ROW(NUMBER, "sd", "standard error"),
    {ANSWER_NUMBERS, "ci95", "interval of 95 %: from, to", NULL, ANSWER_MAYBE, NULL},
    {0},
};

static const struct answer_field candidate_fields[] = {
    ANSWER_ROW(TEXTS, "effects", "ids"),
    ANSWER_ROW(TEXTS, "channels", "on which each sits; empty: on the beam"),
    ANSWER_ROW(NUMBER, "p_value", "of the improvement by chance"),
    ANSWER_ROW(NUMBER, "bic_gain", "evidence"),
    ANSWER_ROW(NUMBER, "nrmse_after", "error with it"),
    ANSWER_ROW(NUMBER, "check_nrmse_after", "of held-out records"),
    ANSWER_ROW(NUMBER, "noise_ratio_after", "in units of the noise"),
    ANSWER_ROW(NUMBER, "check_noise_ratio_after", "of held-out records"),
    ANSWER_ROW(NUMBER, "probability", "that it is the cause"),
    ANSWER_ROW(NUMBER, "score", "by which candidates are ranked"),
    ANSWER_ROW(NUMBER, "explained", "share of the misfit's power above the noise"),
    ANSWER_ROW(NUMBER, "held_out_explained", "the same of held-out records"),
    ANSWER_ROW(BOOL, "explains", "nothing that matters is left"),
    ANSWER_ROW(BOOL, "rival", "as good as the best"),
    ANSWER_ROW(BOOL, "converged", "its fit did"),
    ANSWER_ROW(NUMBER, "other_at_m", "another place that does as well; null: none"),
    {ANSWER_NUMBER, "seconds", "its fit took", NULL, 0, "s"},
    ANSWER_ROW_OF(MAP, "parameters", "of its effects, by name", parameter_fields),
    {0},
};

static const struct answer_field decision_fields[] = {
    ANSWER_ROW(TEXTS, "effects", "one of these is there"),
    ANSWER_ROW(TEXTS, "with", "the best explanation with one"),
    ANSWER_ROW(TEXTS, "without", "and without"),
    ANSWER_ROW(NUMBER, "probability", "that one is there"),
    ANSWER_ROW(NUMBER_MAP, "features", "from which the probability is computed (docs/calibration.md)"),
    {0},
};

static const struct answer_field remains_fields[] = {
    ANSWER_ROW(NUMBER, "noise_ratio", "in units of the noise"),
    ANSWER_ROW(NUMBER, "nrmse", "error"),
    ANSWER_ROW_OF(LIST, "where", "bands of channels", localisation_fields),
    ANSWER_ROW(TEXT, "text", "in words"),
    {0},
};

static const struct answer_field linearity_fields[] = {
    ANSWER_ROW(TEXT, "verdict", "of the records alone"),
    ANSWER_ROW(NUMBER, "ratio", "of the pair that shows most"),
    ANSWER_ROW(TEXT, "text", "in words"),
    {0},
};

static const struct answer_field rig_channel_fields[] = {
    ANSWER_ROW(TEXT, "channel", "of the model"),      ANSWER_ROW(NUMBER, "at_m", "found"),
    ANSWER_ROW(NUMBER, "stated_at_m", "in the file"), ANSWER_ROW(NUMBER, "gain", "found"),
    ANSWER_ROW(NUMBER, "stated_gain", "in the file"), {0},
};

static const struct answer_field rig_fields[] = {
    ANSWER_ROW(BOOL, "free", "places and gains were fitted although the file holds them"),
    ANSWER_ROW_OF(LIST, "channels", "with what was found", rig_channel_fields),
    {0},
};

static const struct answer_field numerics_fields[] = {
    ANSWER_ROW(NUMBER, "change_over_noise", "of a computation twice as fine"),
    ANSWER_ROW(TEXT, "file", "the record where it is largest"),
    ANSWER_ROW(TEXT, "channel", "of it"),
    ANSWER_ROW(BOOL, "converged", "the change does not matter"),
    ANSWER_ROW(BOOL, "fine", "the finer computation was taken"),
    {0},
};

static const struct answer_field reconstruction_fields[] = {
    ANSWER_ROW(TEXT, "place", "point, patch or spread"),
    ANSWER_ROW(NUMBER, "at_m", "of a point"),
    ANSWER_ROW(BOOL, "located", "the place is certain"),
    ANSWER_ROW(NUMBER, "unexplained", "share of the misfit that such a force leaves"),
    ANSWER_ROW(NUMBER, "linear", "share of the force"),
    ANSWER_ROW(NUMBER, "elastic_odd", "share of the force"),
    ANSWER_ROW(NUMBER, "elastic_even", "share of the force"),
    ANSWER_ROW(NUMBER, "dissipative", "share of the force"),
    ANSWER_ROW(NUMBER, "memory", "share of the force"),
    ANSWER_ROW(NUMBER, "amplitude_power", "with which it grows"),
    ANSWER_ROW(NUMBER, "frequency_Hz", "of its resonance"),
    ANSWER_ROW(BOOL, "resonant", "it has one"),
    ANSWER_ROW(BOOL, "sensor_like", "it is rather in the sensor"),
    ANSWER_ROW(TEXT, "text", "in words"),
    {0},
};

const struct answer_field diagnose_fields[] = {
    ANSWER_ROW(TEXT, "verdict", "complete, missing, ambiguous or unknown"),
    ANSWER_ROW(TEXTS, "effects", "that are named"),
    ANSWER_ROW(NUMBER, "probability", "that they are the cause"),
    ANSWER_ROW(NUMBER, "explained",
               "share of the misfit's power above the noise, of held-out records where there are any"),
    ANSWER_ROW(NUMBER, "nrmse_before", "error of the fitted model"),
    ANSWER_ROW(NUMBER, "nrmse_after", "with the best explanation"),
    ANSWER_ROW(NUMBER, "noise_ratio_before", "in units of the noise"),
    ANSWER_ROW(NUMBER, "noise_ratio_after", "in units of the noise"),
    ANSWER_ROW(NUMBER, "check_nrmse_before", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_nrmse_after", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_noise_ratio_before", "of held-out records"),
    ANSWER_ROW(NUMBER, "check_noise_ratio_after", "of held-out records"),
    {ANSWER_OBJECT, "attainable", "what the best linear model with as many modes leaves; null: not known",
     attainable_fields, ANSWER_NULL, NULL},
    ANSWER_ROW_OF(OBJECT, "rig", "the rig", rig_fields),
    ANSWER_ROW(TEXT, "check_kind", "records, cross-validation or none: what held-out numbers are of"),
    ANSWER_ROW_OF(LIST, "where", "the misfit is", localisation_fields),
    ANSWER_ROW_OF(LIST, "candidates", "best first", candidate_fields),
    ANSWER_ROW_OF(LIST, "decision", "effects that are there, each with its probability", decision_fields),
    ANSWER_ROW_OF(OBJECT, "remains", "what the best answer leaves", remains_fields),
    ANSWER_ROW_OF(OBJECT, "numerics", "how far the computation can be trusted", numerics_fields),
    ANSWER_ROW_OF(OBJECT, "linearity", "of the beam, from the records alone", linearity_fields),
    {ANSWER_OBJECT, "reconstruction", "the missing force", reconstruction_fields, ANSWER_MAYBE, NULL},
    ANSWER_ROW(TEXT, "text", "the answer in a paragraph"),
    ANSWER_ROW(BOOL, "converged", "the computation is fine enough"),
    ANSWER_ROW(BOOL, "interrupted", "by Ctrl-C"),
    ANSWER_ROW(COUNT, "evaluations", "of models"),
    {ANSWER_NUMBER, "seconds", "it took", NULL, 0, "s"},
    ANSWER_ROW_OF(LIST, "channel_factors", "wrong signs and units of channels", channel_factor_fields),
    {ANSWER_TEXTS, "notes", "on what looks ordinary", NULL, ANSWER_MAYBE, NULL},
    {0},
};

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

static void put_next(struct json *root, const struct diagnosis *d, const char *written)
{
    struct json *list = json_put(root, "next", json_new_array());
    struct diagnose_next next;
    diagnose_next(d, written, &next);
    for (size_t i = 0; i < next.n; i++)
        json_push_text(list, next.command[i]);
    diagnose_next_free(&next);
}

struct json *diagnose_json(const struct diagnosis *d, const char *written)
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
    attainable_json(root, &d->attainable);
    put_rig(root, d);
    json_put_text(root, "check_kind", check_kind_name(d->check_kind));
    struct misfit_channel *channels = hypothesis_channels(d, before);
    (void)json_put(root, "where", localise_json(&d->where, channels));
    free(channels);
    struct json *candidates = json_put(root, "candidates", json_new_array());
    for (size_t i = 0; i < d->n_hypotheses; i++)
        put_candidate(candidates, d, &d->hypotheses[i]);
    put_decisions(root, d);
    put_remains(root, d, after);
    put_numerics(root, d);
    put_linearity(root, &d->linearity);
    if (d->reconstructed)
        put_reconstruction(root, &d->reconstruction);
    put_next(root, d, written);
    json_put_text(root, "text", d->text);
    json_put_bool(root, "converged", d->converged);
    json_put_bool(root, "interrupted", d->interrupted);
    json_put_number(root, "evaluations", (double)d->evaluations);
    json_put_number(root, "seconds", d->seconds);
    return root;
}
