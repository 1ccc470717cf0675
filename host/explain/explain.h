/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * explain.h — which physics is missing, how sure that is, and which experiment tells the remaining explanations apart.
 *
 * diagnose_run() fits the model to the records (the baseline) and collects facts: misfit against the noise, linearity, where the misfit
 * stands, how exact the computation is. Candidates of the catalogue are ranked by scores and trials (estimate/estimate.h), the best are
 * refitted, alone and together, and every refit is a hypothesis: a whole fitted model. Evidence, held-out records and cross-validation
 * decide on one of four verdicts, told in a paragraph. When the verdict is `ambiguous`, discriminate_run() refits the rivals, predicts a
 * menu of experiments with each, and proposes the one that tells them apart best. docs/diagnose.md has the method and its thresholds.
 */
#ifndef BEAMFIT_EXPLAIN_H
#define BEAMFIT_EXPLAIN_H

#include <stdio.h>

#include "compare/compare.h"
#include "estimate/estimate.h"
#include "ground/ground.h"
#include "noise/noise.h"
#include "response/response.h"

/* DIAGNOSE — is physics missing from a model, where does it show, which effect is it, and how sure is that? */

enum { DIAGNOSE_EFFECTS = 3 }; /* in one explanation, at most */

enum { DIAGNOSE_MODES = 16 };
enum { DIAGNOSE_BY_RECORD = 3 }; /* single effects that differ from record to record, at most */

enum verdict { VERDICT_COMPLETE, VERDICT_MISSING, VERDICT_AMBIGUOUS, VERDICT_UNKNOWN };
const char *verdict_name(enum verdict verdict);

struct diagnose_options {
    const char *const *without; /* [n_without] ids that are not considered */
    size_t n_without;
    size_t most_effects; /* in one explanation; 0: DIAGNOSE_EFFECTS */
    int threads;         /* 0: one a processor */
    bool everything;     /* refit every candidate, short-listed or not: the plain way, for comparison */
    bool quiet;
    struct predict_options predict;
    const struct fit_result *fitted; /* of the model to the records, as fit_run() without a search; NULL: fitted here */
    const struct attainable *free_model; /* of model and records, as attainable_find(); NULL: found here */
};

/* Residual and errors of one model on one set of records. */
struct hypothesis_errors {
    double nrmse, noise_ratio;           /* root mean square over channels; NaN without records */
    double silent_ratio;                 /* noise_ratio of a model that predicts nothing; 0: not known */
    double worst_ratio;                  /* of a single channel, two standard errors of its noise's level taken off */
    double humless_ratio, humless_worst; /* the same of what is no steady line of the mains (mains_power()) */
    struct misfit misfit;                /* whitened; empty for held-out records */
    size_t n_channels;
    double *ratio;  /* [n_channels] */
    double *doubt;  /* [n_channels] relative standard error of the noise's power */
    size_t *record; /* [n_channels] which the channel is of */
    double *bins;   /* [n_channels] of held-out records: independent bins */
};

/* One mode's band of one channel of one fitted record: what it tells of a model is one fact (explain/facts.h). */
struct fact {
    size_t channel; /* order of predictor_channels() */
    double from_Hz, to_Hz;
    double noise; /* mean square of the noise in the band, unit² of the channel */
    double bins;  /* of its spectrum */
    double doubt; /* relative standard error of `noise` */
};

/* One explanation: effects added to the baseline and everything fitted again. No effect: the baseline itself. */
struct hypothesis {
    size_t n_effects;
    const struct beam_effect *effects[DIAGNOSE_EFFECTS];
    struct model model; /* fitted */
    size_t n_base;      /* effects that the baseline had already */
    struct refit_result fit;
    struct hypothesis_errors fitted, check;
    size_t n_added;           /* estimated parameters more than the baseline has */
    size_t n_tried;           /* models that were compared to choose this one, scan points included */
    struct evidence evidence; /* against the baseline */
    double p_value;           /* of the evidence, family-wise (Holm) over all that were tried */
    double *left;             /* [n_facts of the diagnosis] power of the residual over the noise's, in each fact */
    double score;     /* nats: what the facts say against it, and the price of its parameters; the highest is best */
    double explained; /* share of the misfit's power above the noise that it takes from the fitted records */
    double held_out_explained; /* the same of held-out or left-out records; NaN: none */
    double probability;        /* that its effects are there, 0 … 1 */
    bool places_tried;         /* refitted with its places elsewhere */
    bool steps_tried;          /* asked for the steps that it needs */
    bool has_other_place;      /* a single effect, and the records allow another place as well: */
    double other_at_m;         /* m from the clamp */
    bool refitted;             /* false: only scored; fit, model and errors are empty */
    bool explains;             /* what it leaves of fitted and held-out records is within what is known of the noise */
    bool
        open_values; /* held-out records are above the noise, and not with values fitted to all records: `check` is with those */
    bool tone_replaces_mode; /* it has a tone, and its beam's first mode does not ring (plausible.h) */
    bool rival;              /* named beside the best: the records do not tell them apart */
    bool cross_failed;       /* `check` is empty because a refit without some of the records has no value */
};

/* How much of the baseline's prediction depends on how finely it is computed. */
struct numerics {
    double change; /* when computed twice as finely: rms over the noise, of the worst channel; NaN: no value there */
    double
        as_given; /* the same at the values as given; 0: not asked, because the baseline's is fine or the misfit is weak */
    size_t channel; /* the worst channel, in the order of predictor_channels() */
    bool fine;      /* too small to be mistaken for physics */
    bool steps;     /* the baseline steps through time, and that step was halved too */
};

/* Where the errors of records that were not fitted come from. */
enum check_kind {
    CHECK_NONE,
    CHECK_RECORDS, /* records held out altogether */
    CHECK_CROSS    /* each fitted record left out in turn; of the baseline, the best hypothesis and its rivals only */
};
const char *check_kind_name(enum check_kind kind);

/* What the probability of a decision is computed from: the best explanation with one of its effects against the best without. */
enum feature {
    FEATURE_REMAINS, /* 0 ... 1: share of the rms it leaves that neither the noise nor a free linear model would leave */
    FEATURE_SET,     /* 1: it has more than one effect */
    FEATURE_LEAD,    /* ln(1 + x) of the nats x by which it leads what has none of the effects; -ln(1 - x) below 0 */
    FEATURE_CROWD, /* -1 ... 1: x/(1 + |x|), e^x: times the rms that it leaves, of both kinds of records, is left without any of the effects */
    FEATURE_FOLLOWS, /* 0 ... 1: all of the effects are a mass or a spring at a free place, and no support, which follow much of what an uneven beam does; the less, the larger the misfit */
    FEATURE_ALONE,   /* 0 ... 1: of a misfit as large as the signal it takes nearly all, and nothing else takes much */
    FEATURES
};
const char *feature_name(enum feature feature);

enum { DECISION_EFFECTS = 4, DECISIONS = (DIAGNOSE_EFFECTS + 1) * DECISION_EFFECTS + DIAGNOSE_EFFECTS };

/* Is one of these effects there? */
struct decision {
    size_t n;
    const struct beam_effect
        *among[DECISION_EFFECTS]; /* [n] the last one is the strongest that spoke against the others */
    size_t most_effects;          /* hypotheses with more effects are not looked at, */
    size_t n_beside;              /* nor those that lack one of these, which are taken to be there: */
    const struct beam_effect *beside[DIAGNOSE_EFFECTS]; /* [n_beside] */
    size_t with,
        without; /* index into hypotheses as they stood: the best that has one of them, the best that has none (n_hypotheses: none) */
    double feature[FEATURES];
    double probability;
};

struct diagnosis {
    enum verdict verdict;
    const struct model *model; /* as given; with a free rig `rig`, which is the same but for its channels */
    bool free_rig; /* places and gains of the channels were fitted, with priors, although the file holds them */
    struct model rig;
    const struct record *records, *checks;
    size_t n_records, n_checks;
    enum check_kind check_kind;
    struct noise_estimate *noise; /* [n_channels] of the fitted records, order of predictor_channels() */
    size_t n_channels;
    struct hypothesis baseline; /* the model given, fitted */
    struct numerics numerics;   /* of the baseline */
    size_t n_facts;
    struct fact *facts;
    size_t n_hypotheses; /* best first */
    struct hypothesis *hypotheses;
    size_t n_decisions;
    struct decision decisions[DECISIONS];
    double probability; /* of the verdict's effects; NaN: nothing is named */
    size_t n_named;     /* effects of the verdict: that are there (missing), one of which is (ambiguous), none else */
    const char *named[16];
    struct linearity linearity;
    size_t n_modes;
    double mode_Hz[DIAGNOSE_MODES]; /* [n_modes] of the baseline, up to the highest Nyquist frequency */
    struct localisation where;      /* is the baseline's misfit */
    struct localisation remains;    /* what the best explanation leaves */
    struct attainable attainable;   /* no modes: not known */
    size_t n_by_record;             /* verdict unknown, and the records are not of one linear beam: best first, */
    struct hypothesis by_record
        [DIAGNOSE_BY_RECORD]; /* single effects with one parameter that has a value of its own in each, diagnose_own_slot() */
    bool reconstructed;
    struct reconstruction reconstruction; /* of what the best explanation leaves, when the verdict is unknown */
    bool converged;                       /* the search for the baseline's values */
    bool interrupted;
    size_t n_failed; /* refits without a value: what they asked for is not among the hypotheses */
    char *text;      /* one paragraph for a person */
    double seconds;
    size_t evaluations;
};

/*
 * Records of `checks` are never fitted. Ctrl-C (progress_catch_interrupts()) ends the search: what is known so far is
 * returned with interrupted = true, verdict unknown, nothing named. Free with diagnose_free(), also after a failure. model and records must outlive *out.
 */
enum bf_status diagnose_run(const struct model *model, const struct record records[], size_t n_records,
                            const struct record checks[], size_t n_checks, const struct diagnose_options *options,
                            struct diagnosis *out, struct bf_error *err);
/* It leaves many times the noise; only the true kind of effect then comes down to the noise. Otherwise the misfit is weak. */
bool diagnose_is_far(const struct hypothesis *h);
void diagnose_free(struct diagnosis *diagnosis);

/*
 * The model with what was found: the best explanation when effects are named, else the fitted baseline; with its errors on the fitted records.
 * Free *out with model_free().
 */
enum bf_status diagnose_found(const struct diagnosis *d, struct model *out, struct bf_error *err);

/* Of d->by_record[i]: the parameter of its effect that differs from record to record. */
int diagnose_own_slot(const struct hypothesis *h);

/* "sensor_offset on accel_mps2 + tip_mass": the added effects and where they sit. */
void hypothesis_name(FILE *out, const struct hypothesis *h);

/* Measured and residual of every fitted channel under this hypothesis, as localise_json() takes them. Caller frees. */
struct misfit_channel *hypothesis_channels(const struct diagnosis *d, const struct hypothesis *h);

/*
 * DISCRIMINATE — which next experiment tells rival effects apart best?
 *
 * Every rival is a whole model: the baseline with its effect, refitted to the records so far. Each experiment of a menu (drives
 * and places, levels, one added sensor) is predicted by all of them. For an ordered pair of rivals, a true and b refitted,
 *
 *     evidence(a, b) = min over δ of ‖W (ŷ_a − ŷ_b − J_b δ)‖² + δᵀ H_b δ
 *
 * with W the whitening of the expected noise, J_b the derivatives of b by all its free parameters, and H_b what the present records and
 * the priors say of them: the growth of 2 log L between the two that the experiment is expected to bring, after b has been
 * fitted again to everything (Hunter & Reiner 1965; Box & Hill 1967, with the projection of a score test). An experiment is
 * worth what it brings for its worst pair. docs/diagnose.md, 'Discriminate'.
 */

enum {
    DISCRIMINATE_RIVALS = 6,  /* at most */
    DISCRIMINATE_EFFECTS = 3, /* of one rival, at most */
    DISCRIMINATE_NAME = 256
};

enum drive_kind { DRIVE_HIT, DRIVE_SOFT_HIT, DRIVE_RELEASE, DRIVE_CHIRP, DRIVE_MULTISINE, DRIVE_KINDS };

/* "hit", "soft_hit", "release", "chirp", "multisine"; NULL outside the enumeration */
const char *drive_kind_name(enum drive_kind kind);

struct discriminate_options {
    bool without[DRIVE_KINDS]; /* kinds that are not offered */
    bool no_sensors;           /* only with the sensors that are there */
    double duration_s;         /* of an experiment; 0: of the first record, 4 s without records */
    double force_N, moment_V;  /* largest level; 0: the largest of the records; without records 5 N and 20 V */
    int threads;               /* 0: one a processor */
    bool quiet;                /* no progress bar */
    struct predict_options predict;
};

/* What to refit: the baseline and these effects, or (model != NULL) a model that has them already. Views. */
struct discriminate_rival {
    const char *name; /* "tip_mass", "tip_mass+sensor_lag@accel_mps2" */
    size_t n_effects;
    const struct beam_effect *effects[DISCRIMINATE_EFFECTS];
    const char *channels[DISCRIMINATE_EFFECTS]; /* where it sits; NULL: the effect's default channels */
    const struct model *model;
};

struct discriminate_pair {
    size_t a, b;     /* rivals, a < b */
    double evidence; /* the smaller of (a, b) and (b, a), ≥ 0; in `present`: |Δ(χ² + priors)| of the two refits */
    double wrong_choice; /* probability that noise turns the choice round: Q(√evidence/2) */
};

struct experiment {
    char name[DISCRIMINATE_NAME]; /* "hit hammer_N at 0.300 m, 5 N peak + acceleration at 0.457 m" */
    size_t drive, sensor;         /* indices into drives[] and sensors[]; n_sensors: none added */
    double evidence;              /* of the worst pair */
    double per_sample;            /* √(evidence/n): rms of what a refit cannot absorb, in units of the noise */
    double wrong_choice;
    struct discriminate_pair *pairs; /* [n_pairs] */
};

struct drive {
    char name[DISCRIMINATE_NAME];
    enum drive_kind kind;
    size_t input;          /* of the model */
    double at_m;           /* point force */
    double level;          /* peak, N or V */
    double relative;       /* to the largest level so far (of a release: to its default) */
    bool beyond;           /* relative > 1 */
    double width_s;        /* of a hit */
    double from_Hz, to_Hz; /* chirp, multisine */
};

struct discrimination {
    size_t n_rivals;
    char (*names)[DISCRIMINATE_NAME];
    struct model *models; /* [n_rivals] refitted */
    double *noise_ratio;  /* [n_rivals] on the present records; NaN without */
    size_t n_pairs;
    struct discriminate_pair *present; /* [n_pairs]; NULL without records */
    size_t n_drives;
    struct drive *drives;
    size_t n_sensors;
    struct model_output *sensors; /* that could be added */
    size_t n;                     /* experiments, best first */
    struct experiment *experiments;
    size_t best;          /* index: within the limits, a sensor added only when that is worth it */
    size_t n_failed;      /* drives that some rival could not be predicted for */
    struct record signal; /* of the best: the model's inputs as columns; its path is NULL */
    char *text;           /* a paragraph for a person */
    char *warning;        /* NULL: none */
    double duration_s, seconds;
};

/*
 * records: may be none (n_records 0): then rivals without a model of their own stand at the catalogue's start, scaled to change
 * the response to a hit near the end (or the first drive of the menu) alike, and `warning` says so.
 * BF_USAGE: fewer than two rivals, an effect that cannot act on this model, no input of the wanted kind. Free *out with
 * discrimination_free(), also after a failure. Cost: a refit for each rival, then one prediction with derivatives for each rival and drive.
 */
enum bf_status discriminate_run(const struct model *baseline, const struct discriminate_rival rivals[], size_t n_rivals,
                                const struct record records[], size_t n_records,
                                const struct discriminate_options *options, struct discrimination *out,
                                struct bf_error *err);
void discrimination_free(struct discrimination *d);

/* Of pairs[n], n > 0, the one with the least evidence. */
const struct discriminate_pair *discriminate_hardest(const struct discriminate_pair pairs[], size_t n);

#endif
