/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The verdict in words. */
#include "diagnose_presence.h"
#include "diagnose_relatives.h"
#include "plausible.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void ratios(FILE *out, const struct diagnosis *d, const struct hypothesis *h)
{
    (void)fprintf(out, "%.3g times the noise", h->fitted.noise_ratio);
    if (h->check.n_channels > 0)
        (void)fprintf(out, " (%s: %.3g)",
                      d->check_kind == CHECK_CROSS ? "each record left out in turn"
                      : h->open_values             ? "held out, with values fitted to all records"
                                                   : "held out",
                      h->check.noise_ratio);
}

static const double next_to_nothing = 0.005; /* share of a misfit's power that is not worth a word */
static const double clearly_more = 0.1;      /* the same, that makes one explanation worth a word of its own */

/* "97 %", "none"; beyond what there was before: "worse than without it" */
static void share(FILE *out, double explained)
{
    if (explained < -next_to_nothing)
        (void)fprintf(out, "worse than without it");
    else if (explained < next_to_nothing)
        (void)fprintf(out, "none");
    else
        (void)fprintf(out, "%.*f %%", explained > 0.99 && explained < 1.0 ? 1 : 0, 100.0 * explained);
}

/* "97 % of the misfit (held out: 95 %)" */
static void shares(FILE *out, const struct diagnosis *d, const struct hypothesis *h)
{
    share(out, fmax(h->explained, 0.0));
    (void)fprintf(out, " of the misfit");
    if (!isfinite(h->held_out_explained))
        return;
    (void)fprintf(out, " (%s: ", d->check_kind == CHECK_CROSS ? "records left out" : "held out");
    share(out, h->held_out_explained);
    (void)fprintf(out, ")");
}

static void complete(FILE *out, const struct diagnosis *d)
{
    const struct attainable *a = &d->attainable;
    (void)fprintf(out, "Nothing is missing that these records could show: the fitted model leaves ");
    ratios(out, d, &d->baseline);
    if (diagnose_only_hum_is_left(d))
        (void)fprintf(
            out,
            ", but for hum %.3g: a steady line of the mains is in the records, and no force or voltage that was "
            "recorded causes it. Look for its source; `beamfit add MODEL mains_hum` puts it into the model",
            d->baseline.fitted.humless_ratio);
    else if (!diagnose_is_complete(d))
        (void)fprintf(
            out,
            " and %.2g %% of the signal, a linear model of %zu free modes %.2g %%: no linear effect can lower "
            "that. Either the noise is larger than the estimate, or the records hold what no input caused",
            100.0 * d->baseline.fitted.nrmse, a->modes, 100.0 * a->nrmse);
    (void)fprintf(out, ".");
    if (d->n_hypotheses > 0 && !diagnose_only_hum_is_left(d)) {
        (void)fprintf(out, " The best addition, ");
        hypothesis_name(out, &d->hypotheses[0]);
        (void)fprintf(out, ", would lower that to %.3g: no more than an effect does that is not there.",
                      d->hypotheses[0].fitted.noise_ratio);
    }
}

/* The best that is not named, to show how clear the answer is. */
static const struct hypothesis *runner_up(const struct diagnosis *d)
{
    for (size_t i = 1; i < d->n_hypotheses; i++)
        if (!d->hypotheses[i].rival && d->hypotheses[i].n_effects <= d->hypotheses[0].n_effects)
            return &d->hypotheses[i];
    return NULL;
}

static void values(FILE *out, const struct hypothesis *h)
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
            if (p->fixed && info->role == BEAM_ROLE_STRENGTH && hypothesis_has_support(h, effect->effect))
                (void)fprintf(out, p->value > 0.0 ? " (held: a rigid support)" : " (held)");
        }
    }
}

/* What the best explanation leaves: nothing, or how much and where. */
static void remainder_of(FILE *out, const struct diagnosis *d, const struct hypothesis *h)
{
    if (h->explains) {
        (void)fprintf(out, diagnose_leaves_hum(h) ? " Hum remains besides the noise, a steady line of the mains."
                                                  : " Nothing that matters remains.");
        return;
    }
    (void)fprintf(out, " %.2g %% of the signal remains", 100.0 * h->fitted.nrmse);
    if (d->attainable.modes > 0)
        (void)fprintf(out, " (a free linear model leaves %.2g %%)", 100.0 * d->attainable.nrmse);
    (void)fprintf(out, ".");
    if (diagnose_errors_are_noise(&h->fitted, false) && !diagnose_errors_are_noise(&h->check, true))
        (void)fprintf(out,
                      " The fitted records are left at the noise, held-out ones at %.3g times theirs: what only those "
                      "show these records cannot tell; fit one of them, too.",
                      h->check.noise_ratio);
    else if (d->remains.n > 0)
        (void)fprintf(out, " %s", d->remains.text);
}

/* What is named was found in a set that leaves less than it does alone. NULL: it was not. */
static const struct hypothesis *company(const struct diagnosis *d)
{
    const struct hypothesis *best = &d->hypotheses[0];
    for (size_t k = 0; k < d->n_decisions; k++) {
        const struct decision *one = &d->decisions[k];
        const struct hypothesis *h = &d->hypotheses[one->with];
        if (one->n == 1 && hypothesis_has(best, one->among[0]) && h->n_effects > best->n_effects &&
            h->fitted.noise_ratio < best->fitted.noise_ratio)
            return h;
    }
    return NULL;
}

static double probability_alone(const struct diagnosis *d, const struct beam_effect *effect)
{
    double probability = (double)NAN;
    for (size_t k = 0; k < d->n_decisions; k++)
        if (d->decisions[k].n == 1 && d->decisions[k].among[0] == effect)
            probability = fmax(probability, d->decisions[k].probability); /* of NaN and a number the number */
    return probability;
}

static void tell_company(FILE *out, const struct diagnosis *d, const struct hypothesis *h)
{
    (void)fprintf(out, " It was found in the best explanation, ");
    hypothesis_name(out, h);
    (void)fprintf(out, ", which takes ");
    shares(out, d, h);
    (void)fprintf(out, " and leaves ");
    ratios(out, d, h);
    for (size_t e = 0; e < h->n_effects; e++) {
        const double probability = probability_alone(d, h->effects[e]);
        if (!hypothesis_has(&d->hypotheses[0], h->effects[e]) && isfinite(probability))
            (void)fprintf(out, "; that %s is there, too, has the probability %.2f", h->effects[e]->id, probability);
    }
    (void)fprintf(out, ".");
}

static void missing(FILE *out, const struct diagnosis *d)
{
    const struct hypothesis *best = &d->hypotheses[0], *second = runner_up(d), *set = company(d);
    (void)fprintf(out, "Missing: ");
    hypothesis_name(out, best);
    for (size_t e = 0; e < best->n_effects; e++)
        (void)fprintf(out, "%s%s", e > 0 ? "; " : " (", best->effects[e]->title);
    (void)fprintf(out, "), with probability %.2f. It explains ", d->probability);
    shares(out, d, best);
    (void)fprintf(out, ": the error falls from ");
    ratios(out, d, &d->baseline);
    (void)fprintf(out, " to ");
    ratios(out, d, best);
    (void)fprintf(out, "; ");
    values(out, best);
    (void)fprintf(out, ".");
    if (best->has_other_place)
        (void)fprintf(out, " Its place is open: at %.3g m it explains the records as well.", best->other_at_m);
    if (set != NULL)
        tell_company(out, d, set);
    remainder_of(out, d, best);
    if (second != NULL) {
        (void)fprintf(out, " The next best, ");
        hypothesis_name(out, second);
        (void)fprintf(out, ", explains ");
        shares(out, d, second);
        (void)fprintf(out, ".");
        if (diagnose_simplest(d, (size_t)(second - d->hypotheses)) == (size_t)(best - d->hypotheses))
            (void)fprintf(out,
                          " It is the more general form and takes no more than an effect that is not there would.");
    }
}

static void ambiguous(FILE *out, const struct diagnosis *d)
{
    (void)fprintf(out, "Something is missing (the model leaves ");
    ratios(out, d, &d->baseline);
    (void)fprintf(out,
                  "), and these records do not tell which of these it is; with probability %.2f it is one of them:",
                  d->probability);
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        if (i > 0 && !d->hypotheses[i].rival)
            continue;
        (void)fprintf(out, "%s ", i > 0 ? ";" : "");
        hypothesis_name(out, &d->hypotheses[i]);
        (void)fprintf(out, " (%.2f) explains ", d->hypotheses[i].probability);
        shares(out, d, &d->hypotheses[i]);
        (void)fprintf(out, " and leaves ");
        ratios(out, d, &d->hypotheses[i]);
    }
    (void)fprintf(out, ". `beamfit discriminate` finds the experiment that separates them.");
}

/* "accel_mps2 of chirp1.csv" */
static void uncomputed(FILE *out, const struct diagnosis *d)
{
    (void)fprintf(out, "The model leaves ");
    ratios(out, d, &d->baseline);
    (void)fprintf(out, ", not far enough above that error to say that physics is missing; no effect was tried.");
}

static bool lowers_it(const struct hypothesis *h)
{
    return h->explained >= next_to_nothing;
}

static bool any_lowers_it(const struct diagnosis *d)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (lowers_it(&d->hypotheses[i]))
            return true;
    return false;
}

/* What takes clearly more of the misfit's power than all that is listed, which has more evidence. NULL: none. */
static const struct hypothesis *takes_most(const struct diagnosis *d, const struct hypothesis *const listed[], size_t n)
{
    const struct hypothesis *most = NULL;
    double least = clearly_more;
    for (size_t i = 0; i < n; i++)
        least = fmax(least, diagnose_share_taken(listed[i]) + clearly_more);
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (diagnose_share_taken(h) >= (most ? diagnose_share_taken(most) : least))
            most = h;
    }
    return most;
}

/* The best three of those that lower the misfit: that none stands out of the others is why none is named. */
static void crowd(FILE *out, const struct diagnosis *d)
{
    enum { MOST = 3 };
    const struct hypothesis *listed[MOST];
    size_t n = 0;
    for (size_t i = 0; i < d->n_hypotheses && n < MOST; i++) {
        if (!lowers_it(&d->hypotheses[i]))
            continue;
        (void)fprintf(out, "%s", n > 0 ? ", " : "");
        hypothesis_name(out, &d->hypotheses[i]);
        (void)fprintf(out, " ");
        shares(out, d, &d->hypotheses[i]);
        if (!d->hypotheses[i].fit.converged)
            (void)fprintf(out, " (its search did not converge)");
        if (is_stand_in(&d->hypotheses[i]))
            (void)fprintf(out, " (no cause as it is: %s)", stand_in_reason(&d->hypotheses[i]));
        listed[n++] = &d->hypotheses[i];
    }
    const struct hypothesis *most = takes_most(d, listed, n);
    if (most == NULL)
        return;
    (void)fprintf(out, ". Most is taken by ");
    hypothesis_name(out, most);
    (void)fprintf(out, ", ");
    shares(out, d, most);
    (void)fprintf(out, "; its evidence is less (many parameters, few of the modes and records, or a value that is hard "
                       "to believe), but look there, too");
}

/* The effect that is there with the highest probability, though not a high one. */
static void likeliest(FILE *out, const struct diagnosis *d)
{
    const struct decision *best = NULL;
    for (size_t k = 0; k < d->n_decisions; k++)
        if (d->decisions[k].n == 1 && (best == NULL || d->decisions[k].probability > best->probability))
            best = &d->decisions[k];
    if (best != NULL)
        (void)fprintf(out, ". That %s is there has the probability %.2f", best->among[0]->id, best->probability);
}

/* "tip_mass whose mass_kg is 0.704 kg in m2t1.csv, 0.16 kg in m4t1.csv explains 97 % of the misfit" */
static void differing(FILE *out, const struct diagnosis *d, const struct hypothesis *h)
{
    const int slot = diagnose_own_slot(h);
    const struct model_effect *own = &h->model.effects[h->n_base];
    hypothesis_name(out, h);
    (void)fprintf(out, " whose %s is", own->effect->parameters[slot].name);
    for (size_t r = 0; r < d->n_records; r++) {
        const char *name = record_base_name(&d->records[r]);
        const struct per_record_value *value = effect_record_value(own, slot, name);
        if (value != NULL)
            (void)fprintf(out, "%s %.4g %s in %s", r > 0 ? "," : "", value->value, own->effect->parameters[slot].unit,
                          name);
    }
    (void)fprintf(out, " explains ");
    shares(out, d, h);
}

/* Not named: only those who measured know what they changed, and a beam that bends with the level differs from record to record, too. */
static void by_record(FILE *out, const struct diagnosis *d)
{
    static const double at_noise = 1.05; /* times the noise */
    const char *which = d->n_by_record > 1 ? "They are" : "It is";
    (void)fprintf(out, ". If something was changed between the records: ");
    for (size_t i = 0; i < d->n_by_record; i++) {
        (void)fprintf(out, "%s", i > 0 ? "; " : "");
        differing(out, d, &d->by_record[i]);
    }
    if (d->attainable.each_noise_ratio <= at_noise)
        (void)fprintf(out,
                      ". Each record alone is linear to its noise. %s not named, because only you know what was "
                      "changed.",
                      which);
    else
        (void)fprintf(out, ". %s not named, because a nonlinear beam under other levels looks like that, too.", which);
}

static void unknown(FILE *out, const struct diagnosis *d)
{
    if (!diagnose_computed(d)) {
        uncomputed(out, d);
        return;
    }
    (void)fprintf(out, "Something is missing: the model leaves ");
    ratios(out, d, &d->baseline);
    if (d->n_by_record > 0)
        by_record(out, d);
    if (any_lowers_it(d)) {
        (void)fprintf(out, d->n_by_record > 0 ? " The same in all records, none stands out: "
                                              : ". No effect of the catalogue explains that so much better than the "
                                                "others that it could be named: ");
        crowd(out, d);
        likeliest(out, d);
        (void)fprintf(out, ".");
    } else if (d->n_by_record == 0) {
        (void)fprintf(out, ", and no effect of the catalogue lowers that.");
    }
    (void)fprintf(out, " %s", d->where.text);
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
        diagnose_words_before(out, d);
        tell[d->verdict](out, d);
        diagnose_words_after(out, d);
    }
    (void)fclose(out);
    return text;
}
