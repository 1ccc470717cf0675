/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * diagnose_shortlist.h — which effects are worth a refit on top of a hypothesis: those without a law by score test and a few
 * Gauss–Newton steps, laws by the equation-error trial along the measured motion. Both only rank and give start values;
 * refits decide. Private to explain/.
 */
#ifndef BEAMFIT_DIAGNOSE_SHORTLIST_H
#define BEAMFIT_DIAGNOSE_SHORTLIST_H

#include "diagnose_linear_part.h"
#include "diagnose_state.h"
#include "effect_kind.h"

struct shortlist {
    struct diagnose_state *w;
    const struct hypothesis *from;
    bool has_law; /* of `from`: its scores are those of `linear_part` */
    struct linear_part linear_part;
    size_t n_effects; /* of the new hypotheses */
    struct candidate_list list;
    struct score_base *base; /* NULL: not needed yet */
    struct score *scores;    /* [list.n] */
    size_t *order[2], n_order[2],
        looked[2];        /* of KIND_LINEAR and KIND_NONLINEAR_CHAIN, best first; how many were refitted */
    bool refined[2];      /* the best of them have taken a few steps */
    bool linear;          /* the records pass for linear, and are far off or explained: laws of degree one only */
    bool best_law_tried;  /* whatever its trial has left */
    bool tried;           /* trials are there */
    struct trial *trials; /* best first */
    size_t n_trials, refitted_laws;
};

/* The one that the first look has left, where that was of `from`; else a new one. Free with shortlist_free(), which takes NULL too. */
enum bf_status shortlist_new(struct diagnose_state *w, const struct hypothesis *from, struct shortlist **out,
                             struct bf_error *err);
void shortlist_free(struct shortlist *s);
/* Scores of KIND_LINEAR or KIND_NONLINEAR_CHAIN, of the first order; nothing when they are there already. */
enum bf_status shortlist_score(struct shortlist *s, enum effect_kind kind, struct bf_error *err);
/* The same, and a few Gauss–Newton steps of the best. */
enum bf_status shortlist_refine(struct shortlist *s, enum effect_kind kind, struct bf_error *err);
/* Trials of the laws; nothing when they are there already, or when the hypothesis itself has a law (no motion then). */
enum bf_status shortlist_try_laws(struct shortlist *s, struct bf_error *err);
/* Rms in units of the noise that a candidate leaves after its few steps. */
double shortlist_left(const struct shortlist *s, size_t candidate);
/* Its refit from there: a refined score is a start close to the optimum, and needs no starts of its own. */
enum bf_status shortlist_job(const struct shortlist *s, size_t candidate, struct refit_job *job, struct bf_error *err);
/* Refits of a kind, of laws only where every effect is asked for, at most so many, whose candidates leave little more than `best` (rms in units of the noise), with start values. */
void shortlist_choose(struct shortlist *s, enum effect_kind kind, size_t most, double best, struct refit_job **jobs,
                      size_t *n);
/* The same of laws, whose trials leave little more. */
void shortlist_choose_laws(struct shortlist *s, size_t most, double best, struct refit_job **jobs, size_t *n);
/* The law whose trial takes the largest share, and one that takes nearly as much, even when that leaves too much: for a nonlinear beam that nothing else explains. */
void shortlist_choose_last(const struct shortlist *s, double best, struct refit_job **jobs, size_t *n);

/* What diagnose_shortlist_laws.c needs of diagnose_shortlist.c. */

/* After its few steps it is not far from the best, and takes half of what that takes. left, best: rms in units of the noise. */
bool shortlist_is_worth_refit(const struct shortlist *s, double left, double best);
/* The model has an effect of this kind or of a costlier one. */
bool shortlist_reaches(const struct model *model, enum effect_kind kind);
/* The refit of a candidate from these values, p[effect->n_parameters]. */
enum bf_status shortlist_job_of(const struct shortlist *s, const struct candidate *candidate, const double p[],
                                struct refit_job *job, struct bf_error *err);
/* Appends to jobs[*n]. */
void shortlist_push(struct refit_job **jobs, size_t *n, const struct refit_job *job);
/* A p-value above which a score or a trial is not refitted. */
extern const double shortlist_highest_p;

/*
 * diagnose_roads.c: linear candidates, best score first, refitted from the model as given (diagnose_as_given()) and not from the fitted
 * baseline. Ranks. `from` must be the baseline. Linear refits, some tenths of a second to a second each.
 */
enum bf_status shortlist_from_given(struct shortlist *s, double span, struct bf_error *err);
/*
 * The best explanation is a linear effect that takes most of the misfit, and leaves as much as a free linear model of records that do not show a nonlinearity, of the held-out ones, too: what
 * remains (hum, say) no other effect that is linear takes. After diagnose_rank().
 */
bool diagnose_no_linear_outdoes(const struct diagnosis *d);
/*
 * The beam's own linear effects from the model as given, each with a strength and then a place that has a value of its own in each record: what a laboratory changes
 * between them. Ranks. Some forty quick looks, and the three nearest to their ends.
 */
enum bf_status shortlist_by_record(struct shortlist *s, struct bf_error *err);

/*
 * diagnose_by_modes.c: the beam's own linear effects, fitted to the modes of the free linear model, and the next four that come near those refitted to the records. Ranks.
 * Half a second, once for each model of the diagnosis, and the refits.
 */
enum bf_status diagnose_by_modes(struct diagnose_state *w, const struct candidate_list *list, struct bf_error *err);

/*
 * diagnose_mates.c: linear effects whose scores are nearly that of the single effect that has explained the records, and which no refit has tried to its end. Far from the
 * noise nothing else would ask for them. `from` must be the baseline. Ranks.
 */
enum bf_status shortlist_mates(struct shortlist *s, struct bf_error *err);

#endif
