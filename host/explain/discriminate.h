/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * discriminate.h — which next experiment tells rival effects apart best?
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
#ifndef BEAMFIT_DISCRIMINATE_H
#define BEAMFIT_DISCRIMINATE_H

#include <stdio.h>
#include "ground/json.h"
#include "response/predict.h"

enum {
    DISCRIMINATE_RIVALS = 6,  /* at most */
    DISCRIMINATE_EFFECTS = 3, /* of one rival, at most */
    DISCRIMINATE_NAME = 256
};

/* Evidence (2 log of the likelihood ratio) from which one of two models is believed: 'very strong', Kass & Raftery 1995. */
extern const double discriminate_decisive;
/* An added sensor is proposed when it multiplies the evidence at least so much: another sensor costs an afternoon. */
extern const double discriminate_sensor_worth;

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

/* For a person: table and text; `most` rows. */
void discriminate_print(FILE *out, const struct discrimination *d, size_t most);
/* drive: path of the signal that was written, NULL none. */
struct json *discriminate_json(const struct discrimination *d, const char *drive);

#endif
