/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fleet_fit.h — one model fitted to many records, which lie in shares of some each (SHARES in estimate/estimate.h). `beamfit fleet fit` has all shares and
 * answers on threads; `beamfit-fleet fit` (fleet_mpi.c) deals them to ranks. Share s is always of the same records, so that the numbers are, too.
 */
#ifndef BEAMFIT_FLEET_FIT_H
#define BEAMFIT_FLEET_FIT_H

#include "estimate/estimate.h"
#include "fleet/fleet.h"
#include "fleet_run.h"
#include "record_sets.h"

struct fleet_share {
    struct record_list list;
    struct fit_share *share; /* NULL: another rank has it */
    struct bf_error err;     /* of opening it */
};

struct fleet_fit {
    struct fleet_arguments arguments;
    struct fleet_files files; /* model, then records */
    size_t rank, n_ranks;     /* shares of this process: those whose number is rank, modulo n_ranks */
    struct model model;
    size_t n_shares;
    struct fleet_share *shares; /* [n_shares] */
};

/* argv[0] is "fit". Starts empty; free with fleet_fit_free(), also after a failure. */
enum bf_status fleet_fit_parse(int argc, char **argv, struct fleet_fit *fit, struct bf_error *err);
/* Reads the model and the records of this rank's shares, on as many threads as --processes says. */
enum bf_status fleet_fit_open(struct fleet_fit *fit, size_t rank, size_t n_ranks, struct bf_error *err);
/* What this rank's shares answer, in answers[n_shares]; those of others are not touched. */
void fleet_fit_answer(struct fleet_fit *fit, const struct fit_message *question, struct fit_message answers[]);
/* The fit and what it is written to, by the one process that asks: ask and context as in struct fit_shares. */
enum bf_status fleet_fit_run(struct fleet_fit *fit,
                             enum bf_status (*ask)(void *context, const struct fit_message *question,
                                                   struct fit_message answers[], struct bf_error *err),
                             void *context, struct bf_error *err);
void fleet_fit_free(struct fleet_fit *fit);

/* `beamfit fleet fit`: all of that here. */
enum bf_status fleet_fit(int argc, char **argv, struct bf_error *err);

#endif
