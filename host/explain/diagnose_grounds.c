/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a verdict rests on, in words: the computation, the channels, the recorder's filter, left-out records. */
#include "diagnose_state.h"

#include <math.h>

static void worst_channel(FILE *out, const struct diagnosis *d)
{
    const struct predict_channel *worst = &d->baseline.fit.channels[d->numerics.channel];
    (void)fprintf(out, "%s of %s", d->model->outputs[worst->output].name, d->records[worst->record].path);
}

void diagnose_words_before(FILE *out, const struct diagnosis *d)
{
    if (isnan(d->numerics.change)) {
        (void)fprintf(out, "The computation itself could not be checked: twice as fine it has no value. ");
    } else if (!d->numerics.fine) {
        (void)fprintf(out, "The computation itself is off by %.2g times the noise on ", d->numerics.change);
        worst_channel(out, d);
        if (diagnose_computed(d) && d->numerics.as_given > 0.0 && d->numerics.as_given < d->numerics.change)
            (void)fprintf(out,
                          " where the fit of the model as it is has ended; at the values as given by %.2g, far less "
                          "than the misfit. ",
                          d->numerics.as_given);
        else if (diagnose_computed(d))
            (void)fprintf(out, ", far less than the misfit. ");
        else
            (void)fprintf(out, ": raise --splines%s before any physics is blamed. ",
                          d->numerics.steps ? " or --oversample" : "");
    }
    if (!d->converged)
        (void)fprintf(out, "The search for the model's own values did not converge: start from a better fit. ");
}

/* "accel_mps2 at 0.2071 m instead of 0.205" of the channels that moved most. */
static void moved(FILE *out, const char *name, const struct channel_parameters *own, double at_m, size_t *n)
{
    static const double place = 0.5, gain = 0.5; /* of the prior's standard deviation: less is not worth a word */
    const double shift_m = own->lists_at ? at_m - own->at.prior_value : 0.0;
    const double factor = own->lists_gain ? own->gain.value / own->gain.prior_value : 1.0;
    if (own->lists_at && fabs(shift_m) > place * own->at.prior * own->at.prior_value)
        (void)fprintf(out, "%s%s at %.4g m instead of %.4g", (*n)++ > 0 ? ", " : ": ", name, at_m, own->at.prior_value);
    if (own->lists_gain && fabs(log(factor)) > gain * own->gain.prior)
        (void)fprintf(out, "%s%s times %.3g", (*n)++ > 0 ? ", " : ": ", name, factor);
}

static void rig(FILE *out, const struct diagnosis *d)
{
    const struct model *model = d->n_named > 0 ? &d->hypotheses[0].model : &d->baseline.model;
    size_t n = 0;
    if (!d->free_rig)
        return;
    (void)fprintf(out,
                  " Places and gains of the channels were fitted too, as good as a ruler (%g mm) and a gauge (%g %%) "
                  "are; held at what the file says they alone leave a misfit",
                  1e3 * diagnose_rig_limits.place_m, 100.0 * diagnose_rig_limits.gain);
    for (size_t i = 0; i < model->n_inputs; i++)
        moved(out, model->inputs[i].name, &model->inputs[i].own, model->inputs[i].at_m, &n);
    for (size_t o = 0; o < model->n_outputs; o++)
        moved(out, model->outputs[o].name, &model->outputs[o].own, model->outputs[o].at_m, &n);
    (void)fprintf(out, ". Measure them, or state how good they are ({value: ..., prior_m: ...}).");
}

/* Which filter was taken for the recorder's, where the explanation is not linear and a record states none. */
static void recorder(FILE *out, const struct diagnosis *d)
{
    if (d->n_named == 0 || d->n_hypotheses == 0 || !model_bends(&d->hypotheses[0].model))
        return;
    for (size_t r = 0; r < d->n_records; r++)
        if (record_filter_is_assumed(&d->records[r])) {
            (void)fprintf(
                out,
                " The recorder's anti-alias filter acts on what is not linear, and %s does not state it; what "
                "was taken is %s. State it in the records where it is known.",
                d->records[r].path, record_meta(&d->records[r], RECORD_FILTER));
            return;
        }
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

/* One record alone has a channel of unknown gain, so that the others do not predict it. */
static void cannot_be_crossed(FILE *out, const struct diagnosis *d)
{
    size_t record;
    const char *name = d->n_named > 0 ? diagnose_alone(d, &record) : NULL;
    if (name != NULL)
        (void)fprintf(
            out,
            " Not cross-validated: %s, whose gain is open, is in %s alone. A second record with it would confirm this.",
            name, text_base_name(d->records[record].path));
}

void diagnose_words_after(FILE *out, const struct diagnosis *d)
{
    rig(out, d);
    recorder(out, d);
    not_crossed(out, d);
    cannot_be_crossed(out, d);
}
