/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fleet_mpi.c — `mpirun -n N beamfit-fleet MANIFEST -o RESULTS`: the units of a fleet on the ranks of MPI, over hosts as MPI does it; and
 * `beamfit-fleet fit MODEL RECORD... -o FITTED`: one model, whose records lie with the ranks.
 *
 * Rank 0 hands out one unit after another, to itself too, and is the only one that writes RESULTS. Every rank works on a unit in a process of its own
 * (fleet/crew.c), as `beamfit fleet` does, and never waits inside MPI: a wait there takes a whole processor.
 */
#include <mpi.h>

#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fleet_fit.h"
#include "fleet_run.h"
#include "ground/ground.h"
#include "show/show.h"

enum { TAG_JOB = 1, TAG_ROWS, TAG_QUESTION, TAG_ANSWER, WAIT_MS = 2, SAY_S = 30 };

/* What a rank answers with, before its rows: the unit; asking for the first one, it has none. */
struct answer {
    uint64_t unit, asks_only;
};

/* A job for a rank; last: there is none, and none will come. */
struct order {
    struct fleet_job job;
    uint64_t last;
};

static double now_s(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- A rank that works ---- */

static void send_rows(void *context, size_t unit, const struct fleet_rows *rows)
{
    const struct answer answer = {.unit = unit};
    unsigned char *bytes = bf_alloc(sizeof answer + rows->n, 1);
    (void)context;
    memcpy(bytes, &answer, sizeof answer);
    if (rows->n > 0)
        memcpy(bytes + sizeof answer, rows->bytes, rows->n);
    (void)MPI_Send(bytes, (int)(sizeof answer + rows->n), MPI_BYTE, 0, TAG_ROWS, MPI_COMM_WORLD);
    free(bytes);
}

static bool receive_order(struct order *order)
{
    int there = 0;
    (void)MPI_Iprobe(0, TAG_JOB, MPI_COMM_WORLD, &there, MPI_STATUS_IGNORE);
    if (there)
        (void)MPI_Recv(order, (int)sizeof *order, MPI_BYTE, 0, TAG_JOB, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return there != 0;
}

static void pause_ms(long ms)
{
    const struct timespec t = {.tv_nsec = ms * 1000000};
    (void)nanosleep(&t, NULL);
}

static enum bf_status work_for_rank_0(struct fleet_run *run, struct bf_error *err)
{
    struct fleet_crew *crew = fleet_crew_new(1, run->arguments.limit_s, fleet_run_work, run);
    const struct answer first = {.asks_only = 1};
    struct order order = {.last = 0};
    enum bf_status status = BF_OK;
    (void)MPI_Send(&first, (int)sizeof first, MPI_BYTE, 0, TAG_ROWS, MPI_COMM_WORLD);
    while (!order.last && status == BF_OK) {
        if (fleet_crew_works(crew))
            fleet_crew_wait(crew, WAIT_MS, send_rows, NULL);
        else if (!receive_order(&order))
            pause_ms(WAIT_MS);
        else if (!order.last)
            status = fleet_crew_start(crew, &order.job, err);
    }
    fleet_crew_free(crew);
    if (status != BF_OK) { /* rank 0 would wait for it; what is done is in RESULTS */
        (void)fprintf(stderr, "beamfit-fleet: %s; the same command goes on where this run ended\n", err->text);
        (void)MPI_Abort(MPI_COMM_WORLD, (int)status);
    }
    return status;
}

/* ---- Rank 0 ---- */

struct office {
    struct fleet_run *run;
    int n_ranks, n_ended; /* of the others */
    double said_s;
};

/* The next unit to a rank that has none, or that there is no more. */
static void give_order(struct office *office, int rank)
{
    struct order order = {.last = 0};
    order.last = !fleet_run_next(office->run, &order.job);
    office->n_ended += order.last != 0;
    (void)MPI_Send(&order, (int)sizeof order, MPI_BYTE, rank, TAG_JOB, MPI_COMM_WORLD);
}

/* One answer of another rank, if there is one. */
static bool take_answer(struct office *office)
{
    int there = 0, n = 0;
    MPI_Status from;
    struct answer answer;
    (void)MPI_Iprobe(MPI_ANY_SOURCE, TAG_ROWS, MPI_COMM_WORLD, &there, &from);
    if (!there)
        return false;
    (void)MPI_Get_count(&from, MPI_BYTE, &n);
    unsigned char *bytes = bf_alloc((size_t)n, 1);
    (void)MPI_Recv(bytes, n, MPI_BYTE, from.MPI_SOURCE, TAG_ROWS, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    memcpy(&answer, bytes, sizeof answer);
    give_order(office, from.MPI_SOURCE); /* it goes on while its rows are written */
    const struct fleet_rows rows = {(size_t)n - sizeof answer, bytes + sizeof answer};
    if (!answer.asks_only)
        fleet_run_take(office->run, (size_t)answer.unit, &rows);
    free(bytes);
    return true;
}

/* A line now and then: the terminal of mpirun has no bar. */
static void say_progress(struct office *office)
{
    const struct fleet_run *run = office->run;
    const double left_s = fleet_run_left_s(run);
    if (now_s() - office->said_s < SAY_S || run->answered == 0)
        return;
    office->said_s = now_s();
    (void)fprintf(stderr, "beamfit-fleet: %zu of %zu units, %zu failed", run->answered, run->manifest.n, run->failed);
    if (isfinite(left_s))
        (void)fprintf(stderr, ", %.3g min left", left_s / 60.0);
    (void)fputc('\n', stderr);
}

static void hand_out(struct office *office, struct bf_error *err)
{
    struct fleet_run *run = office->run;
    struct fleet_crew *crew = fleet_crew_new(1, run->arguments.limit_s, fleet_run_work, run);
    struct fleet_job job;
    bool more = true;
    while (more || fleet_crew_works(crew) || office->n_ended < office->n_ranks - 1) {
        if (more && fleet_crew_has_room(crew)) {
            more = fleet_run_next(run, &job);
            if (more && fleet_crew_start(crew, &job, err) != BF_OK)
                run->err = *err;
        }
        const bool heard = take_answer(office);
        if (fleet_crew_works(crew))
            fleet_crew_wait(crew, heard ? 0 : WAIT_MS, fleet_run_take, run);
        else if (!heard)
            pause_ms(WAIT_MS);
        fleet_run_settle(run, false);
        say_progress(office);
    }
    fleet_crew_free(crew);
}

/* ---- Both ---- */

static enum bf_status parse(int argc, char **argv, struct fleet_arguments *arguments, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, fleet_options, err)) != -1)
        if (fleet_take_option(code, arguments, err) != BF_OK)
            return BF_USAGE;
    return fleet_check_arguments(argc, argv, arguments, err);
}

/* The worst of all ranks: all work, or none. */
static enum bf_status agree(enum bf_status mine)
{
    int worst = (int)mine;
    (void)MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    return (enum bf_status)worst;
}

static enum bf_status told_by_rank_0(enum bf_status mine)
{
    int status = (int)mine;
    (void)MPI_Bcast(&status, 1, MPI_INT, 0, MPI_COMM_WORLD);
    return (enum bf_status)status;
}

static enum bf_status run_fleet(int argc, char **argv, int rank, int n_ranks, struct bf_error *err)
{
    struct fleet_run run = {.next = 0};
    struct office office = {.run = &run, .n_ranks = n_ranks, .said_s = now_s()};
    enum bf_status status = parse(argc, argv, &run.arguments, err);
    if (status == BF_OK)
        status = fleet_run_open(&run, rank == 0, err);
    const enum bf_status all = agree(status), of_rank_0 = told_by_rank_0(status);
    if (rank > 0 && of_rank_0 == status)
        err->text[0] = '\0'; /* it is said once */
    if (all == BF_OK && rank > 0)
        status = work_for_rank_0(&run, err);
    if (all == BF_OK && rank == 0) {
        progress_catch_interrupts();
        hand_out(&office, err);
        status = fleet_run_answer(&run, err);
    }
    fleet_run_close(&run);
    return all == BF_OK ? status : all;
}

/* ---- One model, many records ---- */

/* Bytes of this tag from a rank; waits without taking a processor. */
static struct fit_message receive(int from, int tag)
{
    struct fit_message message = {0};
    MPI_Status status;
    int there = 0, n = 0;
    while (MPI_Iprobe(from, tag, MPI_COMM_WORLD, &there, &status) == MPI_SUCCESS && !there)
        pause_ms(1);
    (void)MPI_Get_count(&status, MPI_BYTE, &n);
    message.n = (size_t)n;
    message.bytes = bf_alloc(message.n, 1);
    (void)MPI_Recv(message.bytes, n, MPI_BYTE, from, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return message;
}

static void ask_ranks(const struct fleet_fit *fit, const struct fit_message *question)
{
    for (size_t rank = 1; rank < fit->n_ranks; rank++)
        (void)MPI_Send(question->bytes, (int)question->n, MPI_BYTE, (int)rank, TAG_QUESTION, MPI_COMM_WORLD);
}

/* Of rank 0: its own shares answer while the others' do. */
static enum bf_status ask(void *context, const struct fit_message *question, struct fit_message answers[],
                          struct bf_error *err)
{
    struct fleet_fit *fit = context;
    (void)err;
    ask_ranks(fit, question);
    fleet_fit_answer(fit, question, answers);
    for (size_t s = 0; s < fit->n_shares; s++)
        if (s % fit->n_ranks != 0)
            answers[s] = receive((int)(s % fit->n_ranks), TAG_ANSWER);
    return BF_OK;
}

/* Of the others: until there is a question of no bytes. */
static void answer_rank_0(struct fleet_fit *fit)
{
    struct fit_message *answers = bf_alloc(fit->n_shares, sizeof *answers);
    struct fit_message question = receive(0, TAG_QUESTION);
    while (question.n > 0) {
        fleet_fit_answer(fit, &question, answers);
        free(question.bytes);
        for (size_t s = fit->rank; s < fit->n_shares; s += fit->n_ranks) {
            (void)MPI_Send(answers[s].bytes, (int)answers[s].n, MPI_BYTE, 0, TAG_ANSWER, MPI_COMM_WORLD);
            free(answers[s].bytes);
        }
        question = receive(0, TAG_QUESTION);
    }
    free(question.bytes), free(answers);
}

static enum bf_status run_fit(int argc, char **argv, int rank, int n_ranks, struct bf_error *err)
{
    static const struct fit_message end = {.n = 0};
    struct fleet_fit fit = {.n_shares = 0};
    enum bf_status status = fleet_fit_parse(argc, argv, &fit, err);
    fit.arguments.processes = 1;
    if (status == BF_OK)
        status = fleet_fit_open(&fit, (size_t)rank, (size_t)n_ranks, err);
    const enum bf_status all = agree(status), of_rank_0 = told_by_rank_0(status);
    if (rank > 0 && of_rank_0 == status)
        err->text[0] = '\0'; /* it is said once */
    if (all == BF_OK && rank > 0)
        answer_rank_0(&fit);
    if (all == BF_OK && rank == 0) {
        progress_catch_interrupts();
        status = fleet_fit_run(&fit, ask, &fit, err);
        ask_ranks(&fit, &end);
    }
    fleet_fit_free(&fit);
    return all == BF_OK ? status : all;
}

int main(int argc, char **argv)
{
    struct bf_error err = {BF_OK, ""};
    int rank = 0, n_ranks = 1;
    const bool one_model = argc > 1 && strcmp(argv[1], "fit") == 0;
    if (argc > 1 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)) {
        (void)puts("Usage: mpirun -n N beamfit-fleet MANIFEST -o RESULTS [--diagnose] [options]\n"
                   "       mpirun -n N beamfit-fleet fit MODEL RECORD... -o FITTED [options]\n\n"
                   "The options of `beamfit fleet` (see there), on N ranks of MPI; --processes is not read.");
        return 0;
    }
    if (MPI_Init(&argc, &argv) != MPI_SUCCESS)
        return (int)BF_NUMERIC;
    (void)MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    (void)MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
    bf_warn_listen(rank == 0 ? answer_take_warning : NULL, NULL);
    optind = 1;
    outputs_protect("fleet", false);
    const enum bf_status status =
        one_model ? run_fit(argc - 1, argv + 1, rank, n_ranks, &err) : run_fleet(argc, argv, rank, n_ranks, &err);
    if (status != BF_OK && err.text[0] != '\0')
        (void)fprintf(stderr, "beamfit-fleet: %s\n", err.text);
    (void)MPI_Finalize();
    return (int)status;
}
