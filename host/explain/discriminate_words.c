/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What to do next, in words. */
#include "discriminate_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Evidence (2 log of the likelihood ratio) from which one of two models is believed: 'very strong', Kass & Raftery 1995. */
static const double decisive = 10.0;
/* A search over starts and candidates earns some ten units by chance: twice 'decisive' leaves no doubt. */
static const double present_is_enough = 20.0;
/* Times the noise: no rival leaves less, so that none of them is the explanation and the evidence means little. */
static const double unexplained = 1.5;

const struct discriminate_pair *discriminate_hardest(const struct discriminate_pair pairs[], size_t n)
{
    const struct discriminate_pair *found = &pairs[0];
    for (size_t i = 1; i < n; i++)
        if (pairs[i].evidence < found->evidence)
            found = &pairs[i];
    return found;
}

static const char *sensor_words(enum output_kind kind)
{
    switch (kind) {
    case OUTPUT_ACCELERATION:
        return "an accelerometer";
    case OUTPUT_VELOCITY:
        return "a velocity sensor";
    default:
        return "a displacement sensor";
    }
}

static void what_to_do(FILE *out, const struct discrimination *d, const struct experiment *x, const char *input)
{
    const struct drive *drive = &d->drives[x->drive];
    switch (drive->kind) {
    case DRIVE_HIT:
    case DRIVE_SOFT_HIT:
        (void)fprintf(out, "Hit at %.3f m (%s) with %.3g N peak and a %s tip (%.2g ms)", drive->at_m, input,
                      drive->level, drive->kind == DRIVE_HIT ? "hard" : "soft", 1e3 * drive->width_s);
        break;
    case DRIVE_RELEASE:
        (void)fprintf(out, "Pull at %.3f m (%s) with %.3g N and let go", drive->at_m, input, drive->level);
        break;
    case DRIVE_CHIRP:
    default:
        (void)fprintf(out, "Drive %s with a %s of %.3g V peak, %.2g to %.0f Hz, and let it ring down", input,
                      drive_kind_name(drive->kind), drive->level, drive->from_Hz, drive->to_Hz);
    }
    if (x->sensor < d->n_sensors)
        (void)fprintf(out, ", and put %s at %.3f m", sensor_words(d->sensors[x->sensor].kind),
                      d->sensors[x->sensor].at_m);
}

/* The best that goes beyond the levels so far, when it is much better. */
static const struct experiment *beyond(const struct discrimination *d)
{
    for (size_t i = 0; i < d->n; i++)
        if (d->drives[d->experiments[i].drive].beyond)
            return &d->experiments[i];
    return NULL;
}

char *discriminate_words(const struct discrimination *d, const struct discriminate_state *w)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        return bf_strdup("");
    const struct experiment *best = &d->experiments[d->best], *more = beyond(d);
    const struct discriminate_pair *pair = discriminate_hardest(best->pairs, d->n_pairs);
    const char *input = w->baseline->inputs[d->drives[best->drive].input].name;
    what_to_do(out, d, best, input);
    (void)fprintf(out, ": expected evidence %.3g", best->evidence);
    if (d->present != NULL)
        (void)fprintf(out, " (%.3g for the present records)", discriminate_hardest(d->present, d->n_pairs)->evidence);
    (void)fprintf(out, " between %s and %s", d->names[pair->a], d->names[pair->b]);
    if (d->n_pairs > 1)
        (void)fprintf(out, ", the pair that is hardest to tell apart");
    if (best->wrong_choice > 1e-9)
        (void)fprintf(out, "; noise would turn the choice round with probability %.2g.", best->wrong_choice);
    else
        (void)fprintf(out, "; noise would practically never turn the choice round.");
    if (best->evidence < decisive)
        (void)fprintf(out,
                      " That is not decisive (%.0f would be): within the levels so far treat them as one class, or "
                      "record longer and more often (evidence adds up).",
                      decisive);
    if (more != NULL && more->evidence > 2.0 * best->evidence)
        (void)fprintf(out, " If the beam and the sensors bear it, more would be gained by: %s (evidence %.3g).",
                      more->name, more->evidence);
    if (d->present != NULL && discriminate_hardest(d->present, d->n_pairs)->evidence > present_is_enough)
        (void)fprintf(out, " The present records tell them apart already: see `beamfit diagnose`.");
    double least = INFINITY;
    for (size_t i = 0; i < d->n_rivals; i++)
        least = fmin(least, isnan(d->noise_ratio[i]) ? 0.0 : d->noise_ratio[i]);
    if (least > unexplained)
        (void)fprintf(out,
                      " Caution: none of the rivals explains the present records (the best leaves %.3g times the "
                      "noise); see `beamfit diagnose` first.",
                      least);
    (void)fclose(out);
    return text;
}
