/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fleet_unit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compare/compare.h"
#include "explain/explain.h"
#include "factors_or_warn.h"
#include "record_sets.h"

/* ---- What it is made of ---- */

void fleet_settings_text(const struct fleet_settings *s, char text[FLEET_SETTINGS])
{
    static const char *const starts[] = {"given", "near", "search"}; /* order of enum fit_start */
    static const char *const between[] = {"bl", "zoh", "foh"};       /* order of enum intersample */
    (void)snprintf(text, FLEET_SETTINGS, "%sstart %s%s; intersample %s; splines %zu%s", s->diagnose ? "diagnose; " : "",
                   starts[s->fit.start], s->fit.never_search ? ", no search" : "", between[s->fit.predict.intersample],
                   s->fit.predict.fine_splines, s->fit.predict.uniform_splines ? ", uniform" : "");
}

static void add_text(struct hash *hash, const char *text)
{
    hash_add(hash, text, strlen(text) + 1);
}

/* A file that cannot be read is "missing", so that the unit is tried again when it is there. */
static void add_input(struct hash *hash, struct fleet_rows *rows, const char *role, const char *path)
{
    struct bf_error unread;
    char sha256[65];
    const bool there = hash_file(path, sha256, &unread) == BF_OK;
    add_text(hash, role);
    add_text(hash, text_base_name(path)); /* values of one record are found by its name */
    add_text(hash, there ? sha256 : "missing");
    fleet_row(rows, FLEET_INPUTS, role, path, there ? sha256 : NULL);
}

static void take_inputs(const struct fleet_unit *unit, const char *settings, struct fleet_rows *rows, char identity[65])
{
    struct hash hash;
    hash_start(&hash);
    add_text(&hash, "beamfit-fleet/1");
    add_text(&hash, BEAMFIT_VERSION);
    add_text(&hash, settings);
    add_input(&hash, rows, "model", unit->model);
    for (size_t i = 0; i < unit->records.n; i++)
        add_input(&hash, rows, "record", unit->records.names[i]);
    for (size_t i = 0; i < unit->checks.n; i++)
        add_input(&hash, rows, "check", unit->checks.names[i]);
    hash_end(&hash, identity);
}

static void take_warning(void *context, const char *text)
{
    fleet_row(context, FLEET_WARNINGS, text);
}

/* ---- The work ---- */

struct work {
    struct model model;
    struct record_sets sets;
    struct channel_factors factors; /* of the model as given */
    struct fit_result result;
    struct fit_channel_error *check;
    size_t n_check;
    struct own_values own; /* of the held-out records */
    struct diagnosis diagnosis;
    struct model corrected, found;
};

static void work_free(struct work *w)
{
    diagnose_free(&w->diagnosis);
    model_free(&w->found), model_free(&w->corrected);
    free(w->check);
    own_values_free(&w->own);
    fit_free(&w->result);
    channel_factors_free(&w->factors);
    record_sets_free(&w->sets);
    model_free(&w->model);
}

static enum bf_status read_unit(const struct fleet_unit *unit, struct work *w, struct bf_error *err)
{
    if (unit->model[0] == '\0')
        return bf_fail(err, BF_USAGE, "the manifest names no model");
    if (unit->records.n == 0)
        return bf_fail(err, BF_USAGE, "the manifest names no record");
    for (size_t i = 0; i < unit->records.n; i++)
        record_list_add(&w->sets.fitted, unit->records.names[i]);
    for (size_t i = 0; i < unit->checks.n; i++)
        record_list_add(&w->sets.held_out, unit->checks.names[i]);
    enum bf_status status = model_read(unit->model, &w->model, err);
    if (status == BF_OK)
        status = record_sets_read(&w->sets, &w->model, err);
    return status;
}

/* As `beamfit fit MODEL RECORD... --check RECORD...` does. w->corrected: what `diagnose` begins with. */
static enum bf_status fit_unit(const struct fleet_settings *settings, struct work *w, struct bf_error *err)
{
    const struct record_list *fitted = &w->sets.fitted, *held_out = &w->sets.held_out;
    struct fit_check check = {.records = held_out->records, .n = held_out->n};
    enum bf_status status = model_copy(&w->model, &w->corrected, err);
    if (status == BF_OK)
        status = fit_run(&w->model, fitted->records, fitted->n, &settings->fit, &w->result, err);
    if (status != BF_OK)
        return status;
    factors_or_warn(&w->model, fitted->records, fitted->n, &settings->fit.predict, &w->result, true, &w->factors);
    if (!fit_learned(&w->result))
        return bf_fail(err, BF_NO, "nothing was fitted: the records determine none of the free parameters");
    fit_into_model(&w->result, fitted->records, &check, &w->model);
    status = own_values_find(&w->model, held_out->records, held_out->n, &settings->fit, &w->own, err);
    if (status == BF_OK)
        status = fit_errors(w->own.model, held_out->records, held_out->n, &settings->fit, &w->check, &w->n_check, err);
    if (status != BF_OK)
        return status;
    check.channels = w->check, check.n_channels = w->n_check;
    check.notes = w->own.notes, check.n_notes = w->own.n_notes;
    fit_into_model(&w->result, fitted->records, &check, &w->model);
    return BF_OK;
}

/* As `beamfit diagnose` does, on one thread. */
static enum bf_status diagnose_unit(const struct fleet_settings *settings, struct work *w, struct bf_error *err)
{
    const struct record_list *fitted = &w->sets.fitted, *held_out = &w->sets.held_out;
    const struct diagnose_options options = {.threads = 1, .quiet = true, .predict = settings->fit.predict};
    channel_factors_apply(&w->factors, &w->corrected);
    enum bf_status status = diagnose_run(&w->corrected, fitted->records, fitted->n, held_out->records, held_out->n,
                                         &options, &w->diagnosis, err);
    if (status == BF_OK && w->diagnosis.n_named > 0)
        status = diagnose_found(&w->diagnosis, &w->found, err);
    return status;
}

/* ---- What is kept ---- */

static void keep_parameters(const struct fit_result *fit, struct fleet_rows *rows)
{
    const size_t n = fit->identifiability.n;
    for (size_t i = 0; i < fit->n_parameters; i++) {
        const struct fit_parameter *p = &fit->parameters[i];
        fleet_row(rows, FLEET_PARAMETERS, "fit", p->label, p->unit, p->value, p->sd, p->ci95[0], p->ci95[1],
                  (int)p->estimated, (int)p->identifiable, (int)p->at_bound, (int)p->logarithmic);
    }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j <= i; j++) {
            const struct fit_parameter *a = &fit->parameters[fit->unknown[i]], *b = &fit->parameters[fit->unknown[j]];
            if (a->identifiable && b->identifiable)
                fleet_row(rows, FLEET_COVARIANCES, a->label, b->label, fit->covariance[i + j * n]);
        }
}

static void keep_errors(const struct fit_channel_error channels[], size_t n, const struct record_list *list,
                        bool held_out, struct fleet_rows *rows)
{
    for (size_t i = 0; i < n; i++) {
        const struct fit_channel_error *e = &channels[i];
        fleet_row(rows, FLEET_ERRORS, text_base_name(list->names[e->record]), (int)held_out, e->name, (int)e->n,
                  e->noise > 0.0 ? e->noise : nan(""), e->nrmse, e->noise_ratio);
    }
}

static enum bf_status keep_model(const char *stage, struct model *model, struct fleet_rows *rows, struct bf_error *err)
{
    char *text;
    if (model_write_text(model, &text, err) != BF_OK)
        return err->status;
    fleet_row(rows, FLEET_MODELS, stage, text);
    free(text);
    return BF_OK;
}

static void keep_fit(const struct work *w, const char *identity, const char *settings, struct fleet_rows *rows)
{
    double nrmse = nan(""), ratio = nan("");
    if (w->n_check > 0)
        fit_totals(w->check, w->n_check, &nrmse, &ratio);
    fleet_row(rows, FLEET_UNITS, identity, "done", NULL, (int)w->result.converged, w->result.nrmse,
              w->result.noise_ratio, nrmse, ratio, (int)w->result.evaluations, BEAMFIT_VERSION, settings);
    keep_parameters(&w->result, rows);
    keep_errors(w->result.channels, w->result.n_channels, &w->sets.fitted, false, rows);
    keep_errors(w->check, w->n_check, &w->sets.held_out, true, rows);
    for (size_t i = 0; i < w->result.n_warnings; i++)
        fleet_row(rows, FLEET_WARNINGS, w->result.warnings[i]);
    for (size_t i = 0; i < w->factors.n; i++)
        fleet_row(rows, FLEET_WARNINGS, w->factors.all[i].text);
}

/* The effects that the diagnosis added and named, with their values. */
static void keep_effects(const struct diagnosis *d, const struct model *found, struct fleet_rows *rows)
{
    for (size_t i = 0; i < d->n_named; i++) {
        bool there = false;
        for (size_t e = d->baseline.model.n_effects; e < found->n_effects; e++) {
            const struct model_effect *effect = &found->effects[e];
            if (strcmp(effect->effect->id, d->named[i]) != 0)
                continue;
            there = true;
            for (int k = 0; k < effect->effect->n_parameters; k++) {
                const struct parameter *p = &effect->parameters[k];
                fleet_row(rows, FLEET_EFFECTS, (int)d->n_named, effect->effect->id, effect->channel, p->name, p->value,
                          p->sd > 0.0 ? p->sd : nan(""), p->unit);
            }
        }
        if (!there) /* one of several that the records do not tell apart */
            fleet_row(rows, FLEET_EFFECTS, (int)d->n_named, d->named[i], "", "", nan(""), nan(""), "");
    }
}

static void keep_found_parameters(const struct model *found, const struct record_list *list, struct fleet_rows *rows)
{
    const char **names = bf_alloc(list->n, sizeof *names);
    struct parameter_ref *refs;
    for (size_t i = 0; i < list->n; i++)
        names[i] = text_base_name(list->names[i]);
    const size_t n = model_parameters(found, names, list->n, &refs);
    for (size_t i = 0; i < n; i++) {
        const bool known = refs[i].record < 0 && refs[i].info->sd > 0.0;
        fleet_row(rows, FLEET_PARAMETERS, "found", refs[i].label, refs[i].info->unit, refs[i].value,
                  known ? refs[i].info->sd : nan(""), nan(""), nan(""), (int)!refs[i].info->fixed, (int)known, 0,
                  (int)refs[i].info->logarithmic);
    }
    free(refs), free(names);
}

static enum bf_status keep_diagnosis(struct work *w, struct fleet_rows *rows, struct bf_error *err)
{
    const struct diagnosis *d = &w->diagnosis;
    const struct hypothesis *after = d->n_named > 0 && d->n_hypotheses > 0 ? &d->hypotheses[0] : &d->baseline;
    fleet_row(rows, FLEET_VERDICTS, verdict_name(d->verdict), d->probability,
              after == &d->baseline ? nan("") : after->explained, d->baseline.fitted.nrmse, after->fitted.nrmse,
              d->baseline.fitted.noise_ratio, after->fitted.noise_ratio, after->check.nrmse, d->text);
    if (d->n_named == 0)
        return BF_OK;
    keep_effects(d, &w->found, rows);
    if (d->verdict == VERDICT_MISSING)
        keep_found_parameters(&w->found, &w->sets.fitted, rows);
    return keep_model("found", &w->found, rows, err);
}

static enum bf_status work_unit(const struct fleet_unit *unit, const struct fleet_settings *settings,
                                const char *identity, struct work *w, struct fleet_rows *rows, struct bf_error *err)
{
    char text[FLEET_SETTINGS];
    fleet_settings_text(settings, text);
    enum bf_status status = read_unit(unit, w, err);
    if (status == BF_OK)
        status = fit_unit(settings, w, err);
    if (status == BF_OK && settings->diagnose)
        status = diagnose_unit(settings, w, err);
    if (status != BF_OK)
        return status;
    keep_fit(w, identity, text, rows);
    status = keep_model("fit", &w->model, rows, err);
    if (status == BF_OK && settings->diagnose)
        status = keep_diagnosis(w, rows, err);
    return status;
}

void fleet_unit_work(const struct fleet_unit *unit, const struct fleet_settings *settings, const struct fleet_job *job,
                     struct fleet_report *report)
{
    struct fleet_rows rows = {0}, none = {0}, failed = {0};
    struct work w = {0};
    struct bf_error err = {BF_OK, ""};
    char identity[65], text[FLEET_SETTINGS];
    fleet_settings_text(settings, text);
    take_inputs(unit, text, &rows, identity);
    fleet_say_identity(report, identity);
    if (strcmp(identity, job->identity) == 0) {
        fleet_say_rows(report, &none);
        fleet_rows_free(&rows);
        return;
    }
    bf_warn_listen(take_warning, &rows);
    if (work_unit(unit, settings, identity, &w, &rows, &err) == BF_OK) {
        fleet_say_rows(report, &rows);
    } else {
        fleet_failed(&failed, identity, "failed", err.text);
        take_inputs(unit, text, &failed, identity);
        fleet_say_rows(report, &failed);
    }
    bf_warn_listen(NULL, NULL);
    work_free(&w);
    fleet_rows_free(&rows), fleet_rows_free(&failed);
}
