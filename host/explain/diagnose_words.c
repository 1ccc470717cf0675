/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The verdict in words. */
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* "sensor_offset on accel_mps2 + tip_mass" */
void hypothesis_name(FILE *out, const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++) {
        const char *channel = h->model.effects[h->n_base + i].channel;
        (void)fprintf(out, "%s%s%s%s", i > 0 ? " + " : "", h->effects[i]->id, channel[0] != '\0' ? " on " : "",
                      channel);
    }
}

static void ratios(FILE *out, const struct diagnosis *d, const struct hypothesis *h)
{
    (void)fprintf(out, "%.3g times the noise", h->fitted.noise_ratio);
    if (h->check.n_channels > 0)
        (void)fprintf(out, " (%s: %.3g)", d->check_kind == CHECK_CROSS ? "each record left out in turn" : "held out",
                      h->check.noise_ratio);
}

static void complete(FILE *out, const struct diagnosis *d)
{
    (void)fprintf(out, "Nothing significant is missing: the fitted model leaves ");
    ratios(out, d, &d->baseline);
    (void)fprintf(out, ".");
    if (d->n_hypotheses > 0) {
        const struct hypothesis *h = &d->hypotheses[0];
        (void)fprintf(out, " The best addition, ");
        hypothesis_name(out, h);
        (void)fprintf(out, ", would lower that to %.3g, which chance alone explains (p = %.2g).", h->fitted.noise_ratio,
                      h->p_value);
    } else {
        (void)fprintf(out, " No effect of the catalogue would lower that by more than chance does.");
    }
}

/* The best that is not named, to show how clear the answer is. */
static const struct hypothesis *runner_up(const struct diagnosis *d)
{
    const struct hypothesis *best = &d->hypotheses[0];
    for (size_t i = 1; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects <= best->n_effects && !d->hypotheses[i].rival)
            return &d->hypotheses[i];
    return NULL;
}

static void values(FILE *out, const struct diagnosis *d, const struct hypothesis *h)
{
    for (size_t e = h->n_base; e < h->model.n_effects; e++) {
        const struct model_effect *effect = &h->model.effects[e];
        for (int j = 0; j < effect->effect->n_parameters; j++) {
            const struct parameter *p = &effect->parameters[j];
            const struct beam_parameter_info *info = &effect->effect->parameters[j];
            if (info->flags & BEAM_PARAMETER_PER_RECORD)
                continue;
            (void)fprintf(out, "%s%s = %.4g", j > 0 || e > h->n_base ? ", " : "", info->name, p->value);
            if (p->sd > 0.0)
                (void)fprintf(out, " ± %.2g", p->sd);
            if (info->unit[0] != '\0')
                (void)fprintf(out, " %s", info->unit);
        }
    }
    (void)d;
}

/* Measured in docs/hidden.md: with the truth taken from the catalogue another effect often predicts weak records as well. */
static void warn_if_weak(FILE *out, const struct diagnosis *d)
{
    if (!diagnose_is_far(&d->baseline))
        (void)fprintf(out,
                      " The misfit is weak: what the catalogue does not have could look like this too; a record that "
                      "shows it at several times the noise would tell.");
}

static void missing(FILE *out, const struct diagnosis *d)
{
    const struct hypothesis *best = &d->hypotheses[0], *second = runner_up(d);
    (void)fprintf(out, "Missing: ");
    hypothesis_name(out, best);
    (void)fprintf(out, " (%s). With it the error falls from ", best->effects[0]->title);
    ratios(out, d, &d->baseline);
    (void)fprintf(out, " to ");
    ratios(out, d, best);
    (void)fprintf(out, "; ");
    values(out, d, best);
    (void)fprintf(out, ".");
    if (best->has_other_place)
        (void)fprintf(out, " Its place is open: at %.3g m it explains the records as well.", best->other_at_m);
    if (best->fitted.noise_ratio > 1.2)
        (void)fprintf(out,
                      " What remains is no effect of the catalogue: the form of this one is not quite the beam's.");
    if (second != NULL) {
        (void)fprintf(out, " The next best, ");
        hypothesis_name(out, second);
        (void)fprintf(out, ", leaves ");
        ratios(out, d, second);
        (void)fprintf(out, ".");
    }
    warn_if_weak(out, d);
}

static void ambiguous(FILE *out, const struct diagnosis *d)
{
    (void)fprintf(out, "Something is missing (the model leaves ");
    ratios(out, d, &d->baseline);
    (void)fprintf(out, "), and these records cannot tell which of these it is: ");
    bool first = true;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        if (i > 0 && !d->hypotheses[i].rival)
            continue;
        if (!first)
            (void)fprintf(out, "; ");
        hypothesis_name(out, &d->hypotheses[i]);
        (void)fprintf(out, " leaves ");
        ratios(out, d, &d->hypotheses[i]);
        first = false;
    }
    (void)fprintf(out, ". `beamfit discriminate` finds the experiment that separates them.");
    warn_if_weak(out, d);
}

static void unconfirmed(FILE *out, const struct diagnosis *d)
{
    (void)fprintf(out, "Something is missing: the model leaves ");
    ratios(out, d, &d->baseline);
    (void)fprintf(out, ". Together ");
    hypothesis_name(out, &d->hypotheses[0]);
    (void)fprintf(out, " leave ");
    ratios(out, d, &d->hypotheses[0]);
    (void)fprintf(out, ", but several effects together can fit what none of them causes, and no record was left out to "
                       "confirm them: give --check "
                       "with a record of another excitation.");
}

/* "accel_mps2 of chirp1.csv" */
static void worst_channel(FILE *out, const struct diagnosis *d)
{
    const struct predict_channel *worst = &d->baseline.fit.channels[d->numerics.channel];
    (void)fprintf(out, "%s of %s", d->model->outputs[worst->output].name, d->records[worst->record].path);
}

/* What has to be put right before any physics is blamed. */
static void computation_first(FILE *out, const struct diagnosis *d)
{
    if (isnan(d->numerics.change)) {
        (void)fprintf(out, "The computation itself could not be checked: twice as fine it has no value. ");
    } else if (!d->numerics.fine) {
        (void)fprintf(out, "The computation itself is off by %.2g times the noise on ", d->numerics.change);
        worst_channel(out, d);
        if (diagnose_computed(d))
            (void)fprintf(out, ", far less than the misfit. ");
        else
            (void)fprintf(out, ": raise --splines%s before any physics is blamed. ",
                          d->numerics.steps ? " or --oversample" : "");
    }
    if (!d->converged)
        (void)fprintf(out, "The search for the model's own values did not converge: start from a better fit. ");
}

static void uncomputed(FILE *out, const struct diagnosis *d)
{
    (void)fprintf(out, "The model leaves ");
    ratios(out, d, &d->baseline);
    (void)fprintf(out, ", not far enough above that error to say that physics is missing; no effect was tried.");
}

/* Records were to be left out in turn, and the others could not be fitted. */
static void not_crossed(FILE *out, const struct diagnosis *d)
{
    bool first = true;
    for (size_t i = 0; i <= d->n_hypotheses; i++) {
        const struct hypothesis *h = i == 0 ? &d->baseline : &d->hypotheses[i - 1];
        if (!h->cross_failed)
            continue;
        (void)fprintf(out, "%s",
                      first ? " Not cross-validated, because a refit without some of the records failed: " : "; ");
        if (i == 0)
            (void)fprintf(out, "the model as it is");
        hypothesis_name(out, h);
        first = false;
    }
    if (!first)
        (void)fprintf(out, ".");
}

/* Why what leaves so little is not named. */
static void not_the_cause(FILE *out, const struct diagnosis *d, const struct hypothesis *best)
{
    static const double describes = 1.5; /* × noise */
    if (best->fitted.noise_ratio > describes)
        return;
    if (diagnose_too_many(d, best))
        (void)fprintf(out,
                      ": they describe these records, but so weak a misfit does not tell which effects act together; "
                      "add the one that you have reason to expect and ask again, or record a misfit of several "
                      "times the noise");
    else if (diagnose_leaves_more(d, best))
        (void)fprintf(out,
                      ": it describes these records, but one more effect still takes a part of what it leaves, and "
                      "their cause would leave nothing to take");
    else
        (void)fprintf(out, ": it describes these records, but their cause would leave no more than the noise");
}

static void unknown(FILE *out, const struct diagnosis *d)
{
    if (!diagnose_computed(d)) {
        uncomputed(out, d);
        return;
    }
    if (d->unconfirmed) {
        unconfirmed(out, d);
        return;
    }
    (void)fprintf(out, "Something is missing, and nothing in the catalogue explains it: the model leaves ");
    ratios(out, d, &d->baseline);
    if (d->n_hypotheses > 0) {
        const bool crossed = d->check_kind == CHECK_CROSS && d->hypotheses[0].check.n_channels > 0;
        (void)fprintf(out, ", and the best addition, ");
        hypothesis_name(out, &d->hypotheses[0]);
        (void)fprintf(out, crossed ? ", leaves " : ", still leaves ");
        ratios(out, d, &d->hypotheses[0]);
        if (crossed)
            (void)fprintf(out, ": it fits, but a record that was left out is not predicted from the others");
        else
            not_the_cause(out, d, &d->hypotheses[0]);
        if (!d->hypotheses[0].fit.converged)
            (void)fprintf(out, " (its search did not converge, so it may not have been given its best chance)");
    }
    (void)fprintf(out, ". %s", d->where.text);
    if (d->reconstructed)
        (void)fprintf(out, " %s", d->reconstruction.text);
}

static void interrupted(FILE *out, const struct diagnosis *d)
{
    if (d->baseline.fit.interrupted && d->n_hypotheses == 0 && !d->converged) {
        (void)fprintf(out, "Interrupted while the model itself was being fitted: so far it leaves ");
        ratios(out, d, &d->baseline);
        (void)fprintf(out, ", and whether physics is missing cannot be said yet.");
        return;
    }
    (void)fprintf(out, "Interrupted, so nothing is named. The model leaves ");
    ratios(out, d, &d->baseline);
    if (d->n_hypotheses == 0) {
        (void)fprintf(out, "; no effect had been added and refitted yet.");
        return;
    }
    (void)fprintf(out, "; of %zu explanations that were refitted ", d->n_hypotheses);
    hypothesis_name(out, &d->hypotheses[0]);
    (void)fprintf(out, " leaves least, ");
    ratios(out, d, &d->hypotheses[0]);
    (void)fprintf(out, ". What was not tried yet may explain it better.");
}

char *diagnose_words(const struct diagnosis *d)
{
    static void (*const tell[])(FILE *, const struct diagnosis *) = {complete, missing, ambiguous, unknown};
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        return bf_strdup("");
    if (d->interrupted) {
        interrupted(out, d);
    } else {
        computation_first(out, d);
        tell[d->verdict](out, d);
        not_crossed(out, d);
    }
    (void)fclose(out);
    return text;
}
