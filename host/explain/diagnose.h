/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * diagnose.h — is some physics missing from a model, where does it show, which effect of the catalogue is it, how sure is
 * that, and what would settle a doubt. docs/diagnose.md: the method, its thresholds and how they were calibrated.
 *
 * The order: baseline fit → misfit, linearity, place of the misfit → short list (scores, trials) → refits → pairs →
 * decision with records held out → words. Every hypothesis is a whole fitted model; the baseline is the first of them.
 */
#ifndef BEAMFIT_DIAGNOSE_H
#define BEAMFIT_DIAGNOSE_H

#include <stdio.h>
#include "ground/json.h"
#include "noise/evidence.h"
#include "noise/linearity.h"
#include "compare/localise.h"
#include "noise/noise.h"
#include "estimate/reconstruct.h"
#include "estimate/refit.h"

enum { DIAGNOSE_EFFECTS = 3 }; /* in one explanation, at most */

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
};

/* Residual and errors of one model on one set of records. */
struct hypothesis_errors {
    double nrmse, noise_ratio; /* root mean square over channels; NaN without records */
    double worst_ratio;        /* of a single channel */
    struct misfit misfit;      /* whitened; empty for held-out records */
    size_t n_channels;
    double *ratio; /* [n_channels] */
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
    double remains;           /* fall of its misfit that one more effect promises, by score */
    bool looked;              /* … and that was asked */
    bool settled;             /* refitted with its places elsewhere */
    bool has_other_place;     /* a single effect, and the records allow another place as well: */
    double other_at_m;        /* m from the clamp */
    bool refitted;            /* false: only scored; fit, model and errors are empty */
    bool explains;            /* nothing that matters is left in fitted and held-out records */
    bool rival;               /* the records cannot tell it from the best */
    bool cross_failed;        /* `check` is empty because a refit without some of the records has no value */
};

/* What of the baseline's prediction depends on how finely it is computed. diagnose_numerics.c */
struct numerics {
    double change;  /* when computed twice as finely: rms over the noise, of the worst channel; NaN: no value there */
    size_t channel; /* that channel, in the order of predictor_channels() */
    bool fine;      /* too small to be mistaken for physics */
    bool steps;     /* the baseline steps through time, and that step was halved too */
};

/* Where the errors of records that were not fitted come from. */
enum check_kind {
    CHECK_NONE,
    CHECK_RECORDS, /* records held out altogether */
    CHECK_CROSS    /* each fitted record left out in turn; only of what the verdict hangs on */
};
const char *check_kind_name(enum check_kind kind);

struct diagnosis {
    enum verdict verdict;
    const struct model *model; /* as given */
    const struct record *records, *checks;
    size_t n_records, n_checks;
    enum check_kind check_kind;
    struct noise_estimate *noise; /* [n_channels] of the fitted records, order of predictor_channels() */
    size_t n_channels;
    struct hypothesis baseline; /* the model given, fitted */
    struct numerics numerics;   /* of the baseline */
    size_t n_hypotheses;        /* best first */
    struct hypothesis *hypotheses;
    size_t n_named; /* effects of the verdict: of the best (missing), one of each rival (ambiguous), none else */
    const char *named[16];
    struct linearity linearity;
    struct localisation where;
    bool reconstructed;
    struct reconstruction reconstruction; /* of what the best explanation leaves, when the verdict is unknown */
    bool converged;                       /* the search for the baseline's values */
    bool interrupted;
    bool unconfirmed; /* several effects explain the fitted records, and no record was left out: they are not named */
    size_t n_failed;  /* refits without an answer */
    char *text;       /* one paragraph for a person */
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
void diagnose_free(struct diagnosis *diagnosis);

/* "sensor_offset on accel_mps2 + tip_mass": the added effects and where they sit. */
void hypothesis_name(FILE *out, const struct hypothesis *h);

/* Measured and residual of every fitted channel under this hypothesis, as localise_json() takes them. Caller frees. */
struct misfit_channel *hypothesis_channels(const struct diagnosis *d, const struct hypothesis *h);

struct json *diagnose_json(const struct diagnosis *diagnosis);
void diagnose_print(FILE *out, const struct diagnosis *diagnosis);
/*
 * Pictures, each as PNG and PDF: DIR/diagnose-misfit (by band and amplitude, before and after adding the best),
 * diagnose-ranking, diagnose-amplitude (frequency and damping; when a record has a stretch without drive), diagnose-force
 * (when reconstructed). docs/diagnose.md, 'Pictures'. None after an interruption; Ctrl-C while drawing ends after the
 * picture that is being drawn. predict: as in the options of the diagnosis; NULL: none.
 */
enum bf_status diagnose_plot(const struct diagnosis *diagnosis, const struct predict_options *predict,
                             const char *directory, struct bf_error *err);

#endif
