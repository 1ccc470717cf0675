/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The model with the values that were believed before any fit, and single effects fitted again from it. */
#include "diagnose_relatives.h"

#include <math.h>

#include "ground/ground.h"

/* The centre of its prior, or the value from before the first fit. */
static void to_given(struct parameter *p)
{
    const double given = p->prior > 0.0 ? p->prior_value : p->start;
    const bool known = p->prior > 0.0 || p->start < 0.0 || p->start > 0.0;
    if (known && !p->fixed && (!p->logarithmic || given > 0.0))
        p->value = fmin(fmax(given, p->min), p->max);
}

static void channels_to_given(struct model *model)
{
    for (size_t i = 0; i < model->n_inputs; i++) {
        struct model_input *input = &model->inputs[i];
        to_given(&input->own.at), to_given(&input->own.gain);
        input->at_m = input->own.lists_at ? input->own.at.value : input->at_m;
    }
    for (size_t i = 0; i < model->n_outputs; i++) {
        struct model_output *output = &model->outputs[i];
        to_given(&output->own.at), to_given(&output->own.gain);
        output->at_m = output->own.lists_at ? output->own.at.value : output->at_m;
    }
}

/* Values as they were: those of `from` where it has the same region. */
static void take_materials(const struct model *from, struct model *to)
{
    for (size_t m = 0; m < to->n_materials; m++) {
        struct material *own = &to->materials[m];
        const struct material *other = model_material(from, own->name);
        if (other == NULL)
            continue;
        own->EI.value = own->EI.fixed ? own->EI.value : other->EI.value;
        own->rho.value = own->rho.fixed ? own->rho.value : other->rho.value;
        own->cDI.value = own->cDI.fixed ? own->cDI.value : other->cDI.value;
    }
    to->gamma.value = to->gamma.fixed ? to->gamma.value : from->gamma.value;
    to->Ks.value = to->Ks.fixed ? to->Ks.value : from->Ks.value;
    to->KB.value = to->KB.fixed ? to->KB.value : from->KB.value;
}

enum bf_status diagnose_as_given(const struct model *model, struct model *out, struct bf_error *err)
{
    const enum bf_status status = model_copy(model, out, err);
    if (status)
        return status;
    for (size_t m = 0; m < out->n_materials; m++) {
        struct material *own = &out->materials[m];
        to_given(&own->EI), to_given(&own->rho), to_given(&own->cDI);
    }
    to_given(&out->gamma), to_given(&out->Ks), to_given(&out->KB);
    channels_to_given(out);
    return BF_OK;
}

enum bf_status diagnose_on_given(const struct diagnosis *d, const struct hypothesis *h, struct model *out,
                                 struct bf_error *err)
{
    struct model given;
    enum bf_status status = diagnose_as_given(d->model, &given, err);
    if (status)
        return status;
    status = model_copy(&h->model, out, err);
    if (!status)
        take_materials(&given, out);
    model_free(&given);
    return status;
}

/* The model as given with one effect of a hypothesis: the others are dropped, every value of the beam is as it was believed before. */
static enum bf_status only_one(const struct hypothesis *h, const struct model *given, size_t kept, struct model *out,
                               struct bf_error *err)
{
    enum bf_status status = model_copy(&h->model, out, err);
    if (status)
        return status;
    for (size_t e = 0; e < h->n_effects && !status; e++)
        if (e != kept)
            status = model_drop_effect(out, h->effects[e]->id, err);
    take_materials(given, out);
    if (status)
        model_free(out);
    return status;
}

enum bf_status diagnose_members_from_given(struct diagnose_state *w, struct bf_error *err)
{
    const struct hypothesis *best = &w->d->hypotheses[0];
    struct refit_job jobs[DIAGNOSE_EFFECTS];
    struct model given;
    size_t n = 0;
    enum bf_status status = diagnose_as_given(w->d->model, &given, err);
    if (status)
        return status;
    for (size_t e = 0; e < best->n_effects && !status; e++) {
        if (best->effects[e]->law != NULL) /* without the others a law's refit takes seconds to minutes */
            continue;
        jobs[n] = (struct refit_job){.n_effects = 1, .n_tried = w->n_tried, .first_new = best->n_base};
        status = only_one(best, &given, e, &jobs[n].model, err);
        n += !status;
    }
    model_free(&given);
    return diagnose_try(w, jobs, n, status, 0.0);
}
