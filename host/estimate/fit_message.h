/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fit_message.h — what is asked of a share of the records and what it answers, as bytes for programs of one build on machines of one kind; private to estimate/.
 *
 * A share knows θ and how far it moves with x; x itself, its scales, bounds and priors are whose who asks.
 */
#ifndef BEAMFIT_FIT_MESSAGE_H
#define BEAMFIT_FIT_MESSAGE_H

#include "estimate.h"
#include "fit_problem.h"

enum share_what {
    SHARE_RECORDS,    /* share_record[n], scale[n_refs] that the data tell of a residual term, 0: none */
    SHARE_STAGE,      /* a new window, and the reduced space at θ */
    SHARE_REBASE,     /* the reduced space at θ */
    SHARE_VALUE,      /* half_square alone */
    SHARE_DERIVATIVE, /* J[n × n_unknowns], r[n]: rows with the JᵀJ and Jᵀr of the share's */
    SHARE_COLOURED,   /* JᵀWCWJ[n_unknowns²] */
    SHARE_ERRORS      /* levels[n_records], fit_channel_error[n] */
};

/* Behind it θ[n_refs], dθ/dx[n_unknowns] (0: held) and the index of each unknown in θ. */
struct share_question {
    enum share_what what;
    double decay_ps, floor, latest_s; /* of SHARE_STAGE, see fit_problem_stage() */
    size_t n_refs, n_unknowns;
};

/* Behind it what enum share_what says, where status is BF_OK. */
struct share_answer {
    enum bf_status status;
    char text[260]; /* of the error */
    double half_square, noise_rows;
    size_t n_rows, n_used, n_signals, n_nuisance, n;
};

struct share_record {
    char path[1024], sha256[72];
    size_t n;
    double t0_s, dt_s;
    struct fit_drive drive;
};

void message_add(struct fit_message *message, const void *bytes, size_t n);
/* The next n bytes from *at on, BF_NUMERIC when there are not so many. */
enum bf_status message_take(const struct fit_message *message, size_t *at, void *bytes, size_t n, struct bf_error *err);

#endif
