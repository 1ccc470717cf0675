/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * beam_truth SPEC... -o DIR: for each spec file X.txt a record DIR/X.csv.
 * beam_truth --live SPEC [SPEC] --socket PATH: the beam in lock step with a controller, until a signal ends it; SIGUSR1 puts the second
 * beam, at rest, in the first one's place.
 */
#include "truth.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>

static int run(const char *path, const char *directory)
{
    char message[TRUTH_MESSAGE] = "", out_path[512];
    const char *base = strrchr(path, '/');
    struct truth_spec spec;
    struct truth_record clean, record;
    base = base ? base + 1 : path;
    int stem = (int)strcspn(base, ".");
    truth_spec_default(&spec);
    if (truth_spec_read(&spec, path, message) != 0 || truth_simulate(&spec, &clean, message) != 0) {
        fprintf(stderr, "beam_truth: %s\n", message);
        return 3;
    }
    truth_measure(&spec, &clean, spec.seed, &record);
    snprintf(out_path, sizeof out_path, "%.300s/%.*s.csv", directory, stem > 100 ? 100 : stem, base);
    FILE *stream = fopen(out_path, "w");
    int bad = !stream;
    if (stream) {
        char title[128];
        snprintf(title, sizeof title, "%.*s", stem > 100 ? 100 : stem, base);
        bad = truth_record_print(&record, &spec, title, stream) != 0;
        bad = fclose(stream) != 0 || bad;
    }
    if (bad)
        fprintf(stderr, "beam_truth: %s: cannot be written\n", out_path);
    truth_record_free(&clean);
    truth_record_free(&record);
    return bad ? 3 : 0;
}

static volatile sig_atomic_t stopped;

static void stop(int signal)
{
    (void)signal;
    stopped = 1;
}

static volatile sig_atomic_t exchanged;

static void exchange(int signal)
{
    (void)signal;
    exchanged = 1;
}

static struct truth_plant *beam[3]; /* the one that swings; the first; the second or NULL */

static bool is_stopped(void)
{
    beam[0] = exchanged && beam[2] ? beam[2] : beam[1];
    return stopped != 0;
}

/* 1 or 2 specs */
static int live(char *const path[], int n, const char *socket_path)
{
    char message[TRUTH_MESSAGE] = "";
    const struct sigaction action = {.sa_handler = stop}, other = {.sa_handler = exchange, .sa_flags = SA_RESTART};
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGUSR1, &other, NULL);
    int status = 0;
    for (int i = 0; i < n && status == 0; i++) {
        struct truth_spec spec;
        truth_spec_default(&spec);
        beam[1 + i] = truth_spec_read(&spec, path[i], message) == 0 ? truth_plant_new(&spec, message) : NULL;
        status = beam[1 + i] ? 0 : -1;
    }
    beam[0] = beam[1];
    status = status == 0 ? truth_plant_serve(beam, socket_path, is_stopped, message) : status;
    if (status != 0)
        fprintf(stderr, "beam_truth: %s\n", message);
    truth_plant_free(beam[1]);
    truth_plant_free(beam[2]);
    return status == 0 ? 0 : 3;
}

int main(int argc, char **argv)
{
    if ((argc == 5 || argc == 6) && strcmp(argv[1], "--live") == 0 && strcmp(argv[argc - 2], "--socket") == 0)
        return live(argv + 2, argc - 4, argv[argc - 1]);
    const char *directory = ".";
    int status = 0, specs = 0;
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "-o") == 0 && i + 1 < argc)
            directory = argv[++i];
    for (int i = 1; i < argc && status == 0; i++) {
        if (strcmp(argv[i], "-o") == 0) {
            i++;
            continue;
        }
        status = run(argv[i], directory);
        specs++;
    }
    if (specs == 0) {
        fputs("usage: beam_truth SPEC... [-o DIR]   one DIR/NAME.csv for each NAME.txt; words: docs/truth.md\n"
              "       beam_truth --live SPEC [SPEC] --socket PATH   the beam in lock step with a controller\n",
              stderr);
        return 2;
    }
    return status;
}
