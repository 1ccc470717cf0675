/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_state.h — one diagnosis as it runs, and what the diagnose*.c files ask of each other; private to explain/ */
#ifndef BEAMFIT_DIAGNOSE_STATE_H
#define BEAMFIT_DIAGNOSE_STATE_H

#include "diagnose_limits.h"
#include "estimate/estimate.h"
#include "explain.h"

struct progress;
struct shortlist;
struct modal_road;

/* A diagnosis on one of two models: with its channels where and what the file says, or within what a ruler and a gauge are good for. */
struct diagnose_side {
    const struct model *model;
    struct hypothesis baseline;
    bool converged;
    size_t n_facts, n_modes, n_hypotheses;
    struct fact *facts;
    double mode_Hz[DIAGNOSE_MODES];
    struct hypothesis *hypotheses;
};

struct diagnose_state {
    struct diagnosis *d;
    struct diagnose_side other; /* the side that is not in d */
    const struct diagnose_options *options;
    struct predict_options *predict; /* of options: finer than asked for where the baseline needs it */
    int threads;
    double *sigma, *check_sigma; /* per channel of the fitted and the held-out records */
    struct whitener *whiteners;  /* [d->n_channels] */
    struct noise_estimate *check_noise;
    size_t n_check_channels;
    struct predictor *predictor; /* of the baseline, at its optimum */
    struct progress *bar;
    double done; /* part of the work, 0 … 1 */
    size_t n_tried;
    size_t law_runs;          /* evaluations that laws have taken so far */
    struct shortlist *looked; /* of the first look at the baseline, until the single effects take it; NULL: none */
    struct modal_road *modal; /* single effects fitted to the modes, diagnose_by_modes.c; NULL: not yet */
    bool
        answered; /* a single effect would be named that explains nearly all: one more must promise much to be refitted */
};

/* A model to refit, and where the answer goes. The model moves into the hypothesis. */
struct refit_job {
    struct model model;
    size_t first_new;  /* effects of the model from here on have starts of their own */
    size_t n_effects;  /* effects more than the baseline, the last ones of the model */
    size_t n_tried;    /* scan points that led here */
    bool to_the_end;   /* not given up, however much it leaves: a pair may grow from it */
    bool places_tried; /* the hypothesis is not refitted from other places again */
    bool near;         /* the values are near the optimum */
    bool doubtful;     /* a law that promises little */
    bool along;        /* begins with the last effect at places along the span, too */
    double
        useless; /* rms over the noise: it is given up where it will leave more; 0: where it leaves far more than the best */
    size_t most_runs; /* evaluations, after which it is left unfinished; 0: as many as it takes */
    bool kept;        /* and then is a hypothesis that has not converged; else it is none */
    bool unfinished;  /* out: so it was, or another one has explained the records */
    double left;      /* out: χ²/n that it had come to; infinite: it has no value */
};

/* diagnose_baseline.c: noise of all channels; the model given, fitted; its predictor. */
enum bf_status diagnose_noise(struct diagnose_state *w, struct bf_error *err);
enum bf_status diagnose_baseline(struct diagnose_state *w, struct bf_error *err);

/* diagnose_modes.c: the highest Nyquist frequency of the fitted records; the modes of a model below it, lowest first: [*n_modes], what is beyond in mode_Hz means nothing. */
double diagnose_band_Hz(const struct diagnosis *d);
enum bf_status diagnose_modes_in_band(const struct diagnosis *d, const struct model *model,
                                      double mode_Hz[DIAGNOSE_MODES], size_t *n_modes, struct bf_error *err);
/*
 * Of the modes of h above that frequency the free linear model has found all but one, which may hide: at a node of all channels, or beside another. Two do where mass,
 * frequency and place were chosen so that the other modes fit whatever these would do: then the records speak against it. True where that model knows too little.
 */
bool diagnose_modes_are_seen(const struct diagnosis *d, const struct hypothesis *h, double above_Hz);
/* Lightly damped, and it decays within the longest record: what swings, and neither a damper nor a tone that is driven. */
bool diagnose_is_mode(const struct diagnosis *d, double frequency_Hz, double damping_ratio);
/* The free linear model has found a mode that h does not have. True where that model knows too little. */
bool diagnose_may_lack_mode(const struct diagnosis *d, const struct hypothesis *h);

/*
 * The baseline is fitted again from the values that the best explanation has found, without its effects, and from those of up to three more that take nearly all alone;
 * where that ends lower (*lower) it becomes the baseline: a local minimum is not taken for missing physics. Cost: one to four refits of the baseline from nearby.
 */
enum bf_status diagnose_restart(struct diagnose_state *w, bool *lower, struct bf_error *err);
/* The baseline is fitted again from `start`, which is taken over; where that ends lower (*lower) it becomes the baseline. */
enum bf_status diagnose_also_from(struct diagnose_state *w, struct model *start, bool *lower, struct bf_error *err);
/*
 * A baseline that has more freedom than another, and ends above it, has found another minimum: it is fitted again from `start`, which is the narrower one's model with
 * that freedom, and is taken over.
 */
enum bf_status diagnose_not_above(struct diagnose_state *w, const struct hypothesis *narrower, struct model *start,
                                  struct bf_error *err);

/*
 * diagnose_given.c: the model with the values that were believed before any fit: the centres of the priors, and what the file keeps as
 * `start`; what neither tells keeps its value. Free *out with model_free().
 */
enum bf_status diagnose_as_given(const struct model *model, struct model *out, struct bf_error *err);
/* The effects of a hypothesis on the beam of that model. Free *out with model_free(). */
enum bf_status diagnose_on_given(const struct diagnosis *d, const struct hypothesis *h, struct model *out,
                                 struct bf_error *err);

/* The linear effects with the best first-order score, refitted from the fitted baseline. Ranks. Some tenths of a second each. */
enum bf_status diagnose_first_look(struct diagnose_state *w, struct bf_error *err);

/*
 * diagnose_by_modes.c: the model as given, fitted to the modes: another start of a baseline that leaves more than the noise, which ends lower where that has locked in to wrong
 * cycles, or has driven a damping to nothing. Its computation is checked again then. Cost: 10 ms, and a refit.
 */
enum bf_status diagnose_baseline_by_modes(struct diagnose_state *w, struct bf_error *err);
/* The same: one more of the beam's own linear effects on each of the best three, by way of the modes. Ranks. A second or two. */
enum bf_status diagnose_pairs_by_modes(struct diagnose_state *w, struct bf_error *err);

/*
 * diagnose_modal.c. The modes have told: an effect that was fitted to them has been refitted to the records, and takes half of the misfit there. Then how far another effect of the
 * beam is from the modes says how far it is from the records. have_told_all: it takes nine tenths.
 */
bool diagnose_modes_have_told(const struct diagnose_state *w);
bool diagnose_modes_have_told_all(const struct diagnose_state *w);
/*
 * The model without any effect, or with one that takes little of the records, has the modes that were measured, within what a good model may be off by; and the records are off
 * by far more than that could make: no effect of the beam, which acts by way of its modes alone, is what is missing.
 */
bool diagnose_modes_clear_beam(const struct diagnose_state *w);
/* It was fitted to the modes; and they have told, and it comes nowhere near them, or they clear the beam. */
bool diagnose_modes_rule_out(const struct diagnose_state *w, const struct beam_effect *effect);
/* The modes have told, and it was refitted to the records from there. */
bool diagnose_modes_have_refitted(const struct diagnose_state *w, const struct beam_effect *effect);
void diagnose_modes_free(struct diagnose_state *w);

/* What is fitted with the rig free, and when the diagnosis goes on with it. */
enum rig_trial {
    RIG_ALONE, /* the baseline: where it comes down to the noise */
    RIG_AND_LEADER, /* the best explanations: where one of them explains the records then, or leaves what a free linear model does */
    RIG_AND_BEST /* the best explanations: where that lowers the misfit clearly */
};
/*
 * diagnose_rig.c: places and gains of the channels within what a ruler and a gauge are good for. *freed: the diagnosis goes on with a model whose channels are free.
 * Cost: a fit of the baseline, once; a refit from nearby for each of four explanations.
 */
enum bf_status diagnose_free_rig(struct diagnose_state *w, enum rig_trial trial, bool *freed, struct bf_error *err);
/* Where the best explanation does as well with the channels as the file has them, within a hundredth of the rms, they are that. Ranks; decides nothing. */
enum bf_status diagnose_hold_rig(struct diagnose_state *w, struct bf_error *err);
void diagnose_side_free(struct diagnose_side *side);

/* What a ruler and a calibrated channel are taken to be good for, one standard deviation. */
struct rig_limits {
    double place_m, gain;
    double clear;    /* of the misfit's power above the noise: what freeing the rig must take */
    double believed; /* standard deviations: a rig further off than that is no explanation by itself */
};
extern const struct rig_limits diagnose_rig_limits;

/*
 * A set of effects is named only when none of them does alone: each linear one of the best hypothesis is refitted from the model as given.
 * Ranks. Linear refits, some tenths of a second to a second each.
 */
enum bf_status diagnose_members_from_given(struct diagnose_state *w, struct bf_error *err);

/*
 * diagnose_sets.c: one more effect on the best hypotheses with n_effects of them. On a hypothesis without a law a law is tried along the measured motion, without a
 * step through time, so a law and a linear effect are sought from the linear one's side first; from the law's side when that has not found them.
 */
enum bf_status diagnose_one_more(struct diagnose_state *w, size_t n_effects, struct bf_error *err);
/* The best hypothesis without each of its effects, refitted: one that was added first may have fitted what a later one explains. Ranks. */
enum bf_status diagnose_without_one(struct diagnose_state *w, struct bf_error *err);
/* The last effect took enough of the excess over the noise, so that one more is worth a search. */
bool diagnose_last_one_helped(const struct diagnosis *d, size_t n_effects);

/*
 * diagnose_special.c: the special cases of the best single effect, and the other first-order response of a sensor, refitted from its values unless they do as well already; and
 * those of the best single effect at the end and of the members of the best explanation, where that is a set. Ranks. A refit from nearby each.
 */
void diagnose_special_cases(struct diagnose_state *w);
void diagnose_special_sets(struct diagnose_state *w);

/* diagnose_support.c: the best explanation with its supports held, where it has a spring that is as stiff as one: refitted from the model as given, along the span. Ranks. A linear refit. */
enum bf_status diagnose_hold_supports(struct diagnose_state *w, struct bf_error *err);

/* diagnose_exchange.c: linear effects that alone are as good as one of the best set, in its place. Ranks. A refit each, four at most. */
enum bf_status diagnose_exchange(struct diagnose_state *w, struct bf_error *err);

/*
 * diagnose_resonator.c: something with a mode of its own, where nothing that takes nearly all is sure. Ranks. Up to sixteen linear
 * refits, most of them given up early.
 */
enum bf_status diagnose_resonator(struct diagnose_state *w, struct bf_error *err);

/*
 * diagnose_by_record.c: d->by_record, where the verdict is unknown and the records are not of one linear beam. Some forty quick looks of some
 * tenths of a second each.
 */
enum bf_status diagnose_by_record(struct diagnose_state *w, struct bf_error *err);

/* diagnose_steps.c: the best laws at the steps a sample that they need. Ranks. */
enum bf_status diagnose_steps(struct diagnose_state *w, struct bf_error *err);

/* diagnose_numerics.c: the baseline computed twice as finely; cost: two predictors and one prediction. */
enum bf_status diagnose_numerics(struct diagnose_state *w, struct bf_error *err);
/* The same, and while the misfit is not far above that change, everything twice as fine from here on, twice at most; never finer
   than what was asked for with --splines or --oversample. */
enum bf_status diagnose_resolve(struct diagnose_state *w, struct bf_error *err);
/* What the baseline leaves cannot be the error of its computation, so that physics may be blamed. */
bool diagnose_computed(const struct diagnosis *d);

/* diagnose_rank.c: nothing is left that matters; of held-out records a little more passes. Without channels: true. */
bool diagnose_errors_are_noise(const struct hypothesis_errors *e, bool held_out);

/* diagnose_errors.c: residual -> errors against the noise; the held-out records. */
enum bf_status hypothesis_measure_apart(const struct diagnose_state *w, struct hypothesis *h, struct bf_error *err);
/*
 * diagnose_together.c: the same, and h->open_values: then h->check is with values fitted to all records. Cost: a refit to all records from nearby, where only the held-out
 * ones are above the noise.
 */
enum bf_status hypothesis_measure(const struct diagnose_state *w, struct hypothesis *h, struct bf_error *err);
/* channels, noise: [n] of records that were not fitted; they become the held-out errors of the hypothesis. */
void hypothesis_take_check(struct hypothesis *h, const struct fit_channel_error channels[],
                           const struct noise_estimate noise[], size_t n);
void hypothesis_free(struct hypothesis *h);
/* Power above the noise, in units of it; 0 at the noise. */
double hypothesis_excess(const struct hypothesis_errors *e);
/* Of that, what there is to explain where the baseline leaves it: of a baseline that leaves more than no model at all, the signal. */
double hypothesis_misfit(const struct hypothesis_errors *baseline);
/* Power above the noise of the fitted and the held-out records together: what one takes of the fitted ones, and loses of the others, it has not explained. */
double hypothesis_left_of_all(const struct hypothesis *h);
/* One of its added effects is a law, so that its prediction steps through time. */
bool hypothesis_has_law(const struct hypothesis *h);
/* A refit of this effect alone has come to its end. */
bool diagnose_has_ended(const struct diagnosis *d, const struct beam_effect *effect);
/* Its refit has come to its end, and leaves at most a thousandth of the misfit's power, of the held-out records, too. */
bool hypothesis_takes_nearly_all(const struct diagnosis *d, const struct hypothesis *h);
/* Rms in units of the noise of the best with so many added effects; the baseline's when there is none below it. */
double diagnose_best_left(const struct diagnosis *d, size_t n_effects);
/* What a free linear model leaves of the fitted records, in units of the noise, or of what stands for it where that is not known. */
double diagnose_floor(const struct diagnosis *d);
/* A hypothesis with so many added effects leaves nothing that matters, nor clearly more than a free linear model. After diagnose_rank(). */
bool diagnose_explained(const struct diagnosis *d, size_t n_effects);
/*
 * That, or one has come to its end and takes all but a thousandth of the misfit's power, of the held-out records, too: what a rig's own errors leave keeps it from the
 * noise, and what quick looks have brought nowhere near it need not be refitted to the end. After diagnose_rank().
 */
bool diagnose_far_ahead(const struct diagnosis *d, size_t n_effects);
/* The same, or one has come near the noise and has taken nearly all of the misfit: rivals that are far behind are not worth as much. */
bool diagnose_nearly_there(const struct diagnosis *d, size_t n_effects);
/* Of the held-out records it leaves no more than a free linear model does; false where either is not known. */
bool diagnose_predicts_as_linear(const struct diagnosis *d, const struct hypothesis *h);
/*
 * It takes nearly all of the misfit, and of the held-out records, where they have one, as much or what a free linear model takes: an answer of a real beam, whatever it
 * leaves. After diagnose_rank().
 */
bool hypothesis_is_answer(const struct diagnosis *d, const struct hypothesis *h);
/* One with so many effects does, and is no stand-in. */
bool diagnose_has_answer(const struct diagnosis *d, size_t n_effects);

/* diagnose_repeats.c: of refits of the same effects the best stays; it notes where another place is as good. After diagnose_rank(). */
void diagnose_drop_repeats(struct diagnosis *d);
/* The free place of its only effect; NaN: it has none. */
double hypothesis_only_place(const struct hypothesis *h);

/* diagnose_refit.c: jobs on all threads; each job that has a value becomes a hypothesis of the diagnosis. */
void diagnose_refits(struct diagnose_state *w, struct refit_job jobs[], size_t n, double span);
/* χ²/n that is far above what the best refit with so many effects leaves, stand-ins apart: a refit that stays above it is given up. 0: there is none. */
double diagnose_out_of_reach(const struct diagnosis *d, size_t n_effects);
/* The same, ranked and without repeats; a status that is not BF_OK frees the jobs and is returned. */
enum bf_status diagnose_try(struct diagnose_state *w, struct refit_job jobs[], size_t n, enum bf_status status,
                            double span);

/* diagnose_shortlist.c */
/* The records show a nonlinear beam, and a free linear model leaves much of them: no linear effect explains them. */
bool diagnose_linear_is_out(const struct diagnosis *d);
/* The effect is left out on request (--without). */
bool diagnose_leaves_out(const struct diagnose_state *w, const struct beam_effect *effect);
extern const double diagnose_at_noise; /* fitted noise ratio that passes it; the floor's own error is about 1 % */

/*
 * diagnose_extend.c: one more effect on this hypothesis (the baseline, or a best one so far): short list, refits, ranking.
 * `from` must not lie in d->hypotheses, which grows. most: refits at most, by enum effect_kind.
 */
enum bf_status diagnose_extend(struct diagnose_state *w, const struct hypothesis *from, const size_t most[],
                               double span, struct bf_error *err);

/*
 * diagnose_places.c: refits from other places of the best hypothesis, when it has not converged or leaves a part for one more effect to
 * take. Once. Cost: linear refits, some tenths of a second each.
 */
enum bf_status diagnose_other_places(struct diagnose_state *w, double span, struct bf_error *err);
/* The best single effect, from other places, where it is a law that comes near the records and does not explain them. Once. Cost: five refits of forty evaluations. */
enum bf_status diagnose_law_places(struct diagnose_state *w, double span, struct bf_error *err);

/*
 * diagnose_cross.c: held-out errors where no record is held out: each record (or group) is left out in turn, everything is
 * fitted to the others from its fitted values, and the record is predicted. Of the baseline and of what the verdict hangs on;
 * decides again. Nothing to do with one record, or when records are held out.
 */
void diagnose_cross(struct diagnose_state *w, double span);
/* Why records are not left out in turn: an input or output of unknown gain that one of them (*record) alone has. NULL: nothing forbids it, or none would be. */
const char *diagnose_alone(const struct diagnosis *d, size_t *record);

/* diagnose_rank.c */
/* Evidence against the baseline and Holm over all that were tried; best first. */
void diagnose_rank(struct diagnosis *d, size_t n_tried);
/* More than chance, and more than the doubt about the noise. After diagnose_rank(). */
bool diagnose_significant(const struct diagnosis *d, const struct hypothesis *h);
/* The records cannot tell `h` from `best`: by what the facts say. */
bool diagnose_as_good(const struct hypothesis *h, const struct hypothesis *best);
/* It explains the records, but for hum: mains_hum is asked for beside it. After diagnose_rank(). */
bool diagnose_leaves_hum(const struct hypothesis *h);
/* The best hypothesis leaves more than what is known of the noise, so that one more effect is worth a search. */
bool diagnose_more_wanted(const struct diagnosis *d);
/* Nothing in the records is seen to be nonlinear: a free linear model leaves the noise of all, of held-out ones too where there are any. */
bool diagnose_passes_for_linear(const struct diagnosis *d);
/* Records that can be compared agree with one linear system, or would without a signal that was added to one. */
bool diagnose_levels_agree(const struct diagnosis *d);
/*
 * No law, drive or sensor that bends is asked for: records that can be compared agree, and the floor is not high (a record that could not be compared is not linear then: a sensor
 * that saturates in the hardest blow); or they pass for linear.
 */
bool diagnose_is_taken_for_linear(const struct diagnosis *d);
/* The baseline leaves no more than the noise, and a free linear model less by what is not known of the noise: it takes what the noise of an input has made of the modes. */
bool diagnose_floor_is_doubtful(const struct diagnosis *d);
/* The baseline is within what is known of the noise. */
bool diagnose_is_complete(const struct diagnosis *d);

/* The baseline is at the noise but for steady lines of the mains: nothing is missing from the beam's model. */
bool diagnose_only_hum_is_left(const struct diagnosis *d);

/* diagnose_decide.c */
/* Names what is sure: what is named stands first, the others in the order of their ranks. After diagnose_rank(). */
void diagnose_decide(struct diagnosis *d);
/* A free linear model with as many modes leaves as much as the baseline, and the records do not show a nonlinearity. */
bool diagnose_no_linear_misses(const struct diagnosis *d);
/* The same of held-out records: what it was fitted to predicts them no better than the baseline does. */
bool diagnose_no_linear_predicts(const struct diagnosis *d);

/* diagnose_words.c */
char *diagnose_words(const struct diagnosis *d);
/* diagnose_grounds.c: what has to be put right before any physics is blamed; what else the verdict rests on. */
void diagnose_words_before(FILE *out, const struct diagnosis *d);
void diagnose_words_after(FILE *out, const struct diagnosis *d);

#endif
