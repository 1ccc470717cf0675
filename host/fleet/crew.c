/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Processes of this machine, one for each unit at work. */
#include "fleet.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { IDENTITY = 64, MOST_PROCESSES = 256 };

/* What a unit's process says: its identity, the length of its rows, the rows. */
struct slot {
    pid_t process; /* 0: free */
    int from;      /* pipe */
    int errors;    /* its standard error, in memory; −1: none */
    size_t unit, n;
    unsigned char *said; /* [n] */
    double since_s;
    bool too_long;
};

struct fleet_crew {
    size_t n;
    double limit_s;
    fleet_work *work;
    void *context;
    struct slot slots[MOST_PROCESSES];
};

struct fleet_report {
    int to;
};

static double now_s(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

struct fleet_crew *fleet_crew_new(size_t n_processes, double limit_s, fleet_work *work, void *context)
{
    struct fleet_crew *crew = bf_alloc(1, sizeof *crew);
    crew->n = n_processes < MOST_PROCESSES ? n_processes : MOST_PROCESSES;
    crew->limit_s = limit_s;
    crew->work = work;
    crew->context = context;
    return crew;
}

static struct slot *free_slot(struct fleet_crew *crew)
{
    for (size_t i = 0; i < crew->n; i++)
        if (crew->slots[i].process == 0)
            return &crew->slots[i];
    return NULL;
}

bool fleet_crew_has_room(const struct fleet_crew *crew)
{
    for (size_t i = 0; i < crew->n; i++)
        if (crew->slots[i].process == 0)
            return true;
    return false;
}

bool fleet_crew_works(const struct fleet_crew *crew)
{
    for (size_t i = 0; i < crew->n; i++)
        if (crew->slots[i].process != 0)
            return true;
    return false;
}

/* ---- In the new process ---- */

static void say(int to, const void *bytes, size_t n)
{
    const unsigned char *from = bytes;
    while (n > 0) {
        const ssize_t written = write(to, from, n);
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            _exit(1);
        from += written;
        n -= (size_t)written;
    }
}

void fleet_say_identity(struct fleet_report *report, const char identity[65])
{
    say(report->to, identity, IDENTITY);
}

void fleet_say_rows(struct fleet_report *report, const struct fleet_rows *rows)
{
    const uint64_t n = rows->n;
    say(report->to, &n, sizeof n);
    say(report->to, rows->bytes, rows->n);
}

static void work_and_exit(const struct fleet_crew *crew, const struct fleet_job *job, int to, int errors, pid_t parent)
{
    struct fleet_report report = {to};
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL); /* nobody would read what it says */
    if (getppid() != parent)
        _exit(1);
    (void)signal(SIGINT, SIG_IGN); /* Ctrl-C is for the parent, which ends this one */
    if (errors >= 0)
        (void)dup2(errors, STDERR_FILENO);
    crew->work(crew->context, job, &report);
    _exit(0);
}

/* ---- In this process ---- */

enum bf_status fleet_crew_start(struct fleet_crew *crew, const struct fleet_job *job, struct bf_error *err)
{
    struct slot *slot = free_slot(crew);
    int ends[2];
    if (slot == NULL || pipe(ends) != 0)
        return bf_fail(err, BF_NUMERIC, "no pipe to a process can be made (%s)", strerror(errno));
    *slot = (struct slot){.from = ends[0], .unit = job->unit, .since_s = now_s()};
    slot->errors = memfd_create("errors", MFD_CLOEXEC);
    (void)fflush(NULL); /* or the new process would print it, too */
    const pid_t parent = getpid();
    slot->process = fork();
    if (slot->process == 0) {
        close(ends[0]);
        work_and_exit(crew, job, ends[1], slot->errors, parent);
    }
    const int why = errno;
    close(ends[1]);
    if (slot->process > 0)
        return BF_OK;
    close(ends[0]);
    slot->process = 0;
    return bf_fail(err, BF_NUMERIC, "no process can be made (%s)", strerror(why));
}

/* The last line of what it said on standard error. */
static void last_words(int errors, char text[200])
{
    char all[4096];
    const off_t n = errors >= 0 ? lseek(errors, 0, SEEK_END) : 0, from = n > 4095 ? n - 4095 : 0;
    const ssize_t got = n > 0 ? pread(errors, all, sizeof all - 1, from) : 0;
    size_t end = got > 0 ? (size_t)got : 0;
    while (end > 0 && all[end - 1] == '\n')
        end--;
    all[end] = '\0';
    const char *line = strrchr(all, '\n');
    (void)snprintf(text, 200, "%.199s", line != NULL ? line + 1 : all);
}

static void say_how_it_died(const struct slot *slot, int ended, double limit_s, char reason[400])
{
    char words[200];
    last_words(slot->errors, words);
    if (slot->too_long)
        (void)snprintf(reason, 400, "took longer than %g s and was ended", limit_s);
    else if (WIFSIGNALED(ended))
        (void)snprintf(reason, 400, "its process was ended by signal %d (%s)%s%s", WTERMSIG(ended),
                       strsignal(WTERMSIG(ended)), words[0] ? ": " : "", words);
    else
        (void)snprintf(reason, 400, "its process ended with status %d before it was done%s%s", WEXITSTATUS(ended),
                       words[0] ? ": " : "", words);
}

/* Somebody, the system or the limit ended it, or memory was out; a fault of its own would come again. */
static bool is_worth_another_try(int ended)
{
    const int signal_number = WIFSIGNALED(ended) ? WTERMSIG(ended) : 0;
    return signal_number == 0 || signal_number == SIGKILL || signal_number == SIGTERM;
}

static bool is_whole(const struct slot *slot)
{
    uint64_t n;
    if (slot->n < IDENTITY + sizeof n)
        return false;
    memcpy(&n, slot->said + IDENTITY, sizeof n);
    return slot->n - IDENTITY - sizeof n == n;
}

static double seconds_of(struct timeval t)
{
    return (double)t.tv_sec + 1e-6 * (double)t.tv_usec;
}

static void finish(struct fleet_crew *crew, struct slot *slot, fleet_done *done, void *context)
{
    struct fleet_rows rows = {0};
    struct rusage used;
    char identity[IDENTITY + 1] = "", host[HOST_NAME_MAX + 1] = "", reason[400];
    int ended = 0;
    close(slot->from);
    while (wait4(slot->process, &ended, 0, &used) < 0 && errno == EINTR)
        ;
    const bool whole = is_whole(slot);
    if (slot->n >= IDENTITY)
        memcpy(identity, slot->said, IDENTITY);
    if (whole) {
        rows.n = slot->n - IDENTITY - sizeof(uint64_t);
        rows.bytes = bf_alloc(rows.n, 1);
        memcpy(rows.bytes, slot->said + IDENTITY + sizeof(uint64_t), rows.n);
    } else {
        say_how_it_died(slot, ended, crew->limit_s, reason);
        fleet_failed(&rows, identity, is_worth_another_try(ended) ? "killed" : "failed", reason);
    }
    if (rows.n > 0) {
        (void)gethostname(host, sizeof host - 1);
        fleet_row(&rows, FLEET_RUNS, now_s() - slot->since_s, seconds_of(used.ru_utime) + seconds_of(used.ru_stime),
                  (double)used.ru_maxrss / 1024.0, host);
    }
    if (slot->errors >= 0)
        close(slot->errors);
    free(slot->said);
    slot->said = NULL;
    slot->process = 0;
    done(context, slot->unit, &rows);
    fleet_rows_free(&rows);
}

/* True while there is more to come. */
static bool listen_to(struct slot *slot)
{
    enum { PIECE = 1 << 16 };
    slot->said = bf_grow(slot->said, slot->n + PIECE, 1);
    const ssize_t got = read(slot->from, slot->said + slot->n, PIECE);
    if (got > 0)
        slot->n += (size_t)got;
    return got > 0 || (got < 0 && errno == EINTR);
}

void fleet_crew_wait(struct fleet_crew *crew, int most_ms, fleet_done *done, void *context)
{
    struct pollfd at[MOST_PROCESSES];
    struct slot *of[MOST_PROCESSES];
    nfds_t n = 0;
    for (size_t i = 0; i < crew->n; i++) {
        struct slot *slot = &crew->slots[i];
        if (slot->process == 0)
            continue;
        if (crew->limit_s > 0.0 && now_s() - slot->since_s > crew->limit_s && !slot->too_long) {
            slot->too_long = true;
            (void)kill(slot->process, SIGKILL);
        }
        of[n] = slot;
        at[n++] = (struct pollfd){.fd = slot->from, .events = POLLIN};
    }
    if (n == 0 || poll(at, n, most_ms) <= 0)
        return;
    for (nfds_t i = 0; i < n; i++)
        if (at[i].revents != 0 && !listen_to(of[i]))
            finish(crew, of[i], done, context);
}

void fleet_crew_free(struct fleet_crew *crew)
{
    for (size_t i = 0; i < crew->n; i++) {
        struct slot *slot = &crew->slots[i];
        if (slot->process == 0)
            continue;
        (void)kill(slot->process, SIGKILL);
        close(slot->from);
        if (slot->errors >= 0)
            close(slot->errors);
        while (waitpid(slot->process, NULL, 0) < 0 && errno == EINTR)
            ;
        free(slot->said);
    }
    free(crew);
}
