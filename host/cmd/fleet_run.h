/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fleet_run.h — a run over the units of a manifest: what is next, what came of it, the answer. `beamfit fleet` hands units to processes of this
 * machine, `beamfit-fleet` (fleet_mpi.c) to ranks; both go through here.
 */
#ifndef BEAMFIT_FLEET_RUN_H
#define BEAMFIT_FLEET_RUN_H

#include "fleet_unit.h"
#include "fleet/fleet.h"
#include "fleet_options.h"

struct fleet_arguments {
    const char *manifest, *output;
    struct fleet_settings settings;
    size_t processes; /* 0: one a processor */
    double limit_s;   /* 0: none */
};

/* Starts empty but for the arguments. */
struct fleet_run {
    struct fleet_arguments arguments;
    struct fleet_manifest manifest;
    struct fleet_results *results; /* of the process that writes, else NULL */
    size_t next, answered;         /* units handed out; answered, and on the disk */
    size_t waiting;                /* answered since, for the next transaction */
    double written_s;              /* when the last one was */
    size_t fitted, unchanged,
        refitted;             /* of those answered or waiting; refitted: something about their inputs is new */
    size_t failed;            /* of those fitted */
    bool *was_there;          /* [manifest.n] when it was handed out */
    double since_s, before_s; /* begin; what was answered at once before */
    struct progress *progress;
    struct bf_error err; /* the first thing that went wrong with RESULTS */
};

/* Options of `beamfit fleet MANIFEST -o RESULTS` and of `beamfit-fleet`. OPTION_FORCE and names are not looked at. */
enum bf_status fleet_take_option(int code, struct fleet_arguments *arguments, struct bf_error *err);
enum bf_status fleet_check_arguments(int argc, char **argv, struct fleet_arguments *arguments, struct bf_error *err);

/* writes: this process opens RESULTS. Close with fleet_run_close(), also after a failure. */
enum bf_status fleet_run_open(struct fleet_run *run, bool writes, struct bf_error *err);
/* The next unit; false: all are handed out, the run is interrupted, or RESULTS cannot be written. */
bool fleet_run_next(struct fleet_run *run, struct fleet_job *job);
/* A fleet_work of the run: in a process of the unit's own. */
void fleet_run_work(void *run, const struct fleet_job *job, struct fleet_report *report);
/* A fleet_done: into RESULTS, with the next transaction. */
void fleet_run_take(void *run, size_t unit, const struct fleet_rows *rows);
/* Writes what waits, in one transaction, 0.2 s after the last one (now: at once); only then it is counted as answered. Call again and again. */
void fleet_run_settle(struct fleet_run *run, bool now);
/* Seconds that the rest will take as things went so far; NaN: not known. */
double fleet_run_left_s(const struct fleet_run *run);
/* What became of the units, on standard output. BF_NUMERIC: it was interrupted; else the first failure. */
enum bf_status fleet_run_answer(struct fleet_run *run, struct bf_error *err);
void fleet_run_close(struct fleet_run *run);

#endif
