/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * facts.h — what records say for one explanation against another, counted in facts; private to explain/.
 *
 * What the form of a model is wrong by is smooth over the band of a mode: neighbouring bins tell the same thing, not thousands of
 * things. One fact is therefore one mode's band of one channel of one record, or one channel of one held-out record. Of fact f, with e the
 * power of a residual over that of the noise, e_f the least that any explanation leaves and K_f bins (noise_bins(): what an input's noise makes of a resonance is one), an explanation loses
 *
 *     2 log(1 + ¼ K (e − e_f)/e_f),    1/K = 1/K_f + s²,    s: the part of e_f that the noise does not account for
 *
 * against the best: Student's likelihood. The divisor is not less than the noise may leave by chance. At the noise (s = 0) it begins as half the
 * difference of χ²: every bin counts. Far from it (s = 1) it grows with log(τ/τ_f), the ratio of the two relative errors of form: the band counts once.
 */
#ifndef BEAMFIT_FACTS_H
#define BEAMFIT_FACTS_H

#include "diagnose_state.h"

/* h->left: power of the residual over the noise's in each band of d->facts. channels: of this hypothesis. */
enum bf_status facts_measure(const struct diagnosis *d, const struct misfit_channel channels[], struct hypothesis *h,
                             struct bf_error *err);
/* d->facts: bands of modes of all channels. sigma: rms of each channel's noise; frequency_Hz: [n_modes] ascending. */
void facts_of_channels(struct diagnosis *d, const struct misfit_channel channels[], const double sigma[],
                       const double frequency_Hz[], size_t n_modes);

/* [n_hypotheses + 1] score of each hypothesis and last of the baseline: what it loses, its strain and its parameters' price, in nats; highest is best. */
void facts_scores(const struct diagnosis *d, double score[]);

/*
 * What the effects of a hypothesis have as unknowns: those that are held are none, but for a place that was pushed to the end of the beam, which was one
 * of the search; of a spring that holds the beam the place alone. One that differs from record to record counts in each that has a channel on which the effect acts: it is estimated from
 * each, the held-out ones too.
 */
size_t hypothesis_parameters(const struct diagnosis *d, const struct hypothesis *h);

#endif
