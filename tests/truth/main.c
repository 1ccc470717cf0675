/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * beam_truth SPEC... -o DIR: for each spec file X.txt a record DIR/X.csv.
 * beam_truth --live SPEC --socket PATH: the beam in lock step with a controller, until a signal ends it.
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

static bool is_stopped(void)
{
    return stopped != 0;
}

static int live(const char *path, const char *socket_path)
{
    char message[TRUTH_MESSAGE] = "";
    struct truth_spec spec;
    const struct sigaction action = {.sa_handler = stop};
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    truth_spec_default(&spec);
    struct truth_plant *plant = truth_spec_read(&spec, path, message) == 0 ? truth_plant_new(&spec, message) : NULL;
    int status = plant ? truth_plant_serve(plant, socket_path, is_stopped, message) : -1;
    if (status != 0)
        fprintf(stderr, "beam_truth: %s\n", message);
    truth_plant_free(plant);
    return status == 0 ? 0 : 3;
}

int main(int argc, char **argv)
{
    if (argc == 5 && strcmp(argv[1], "--live") == 0 && strcmp(argv[3], "--socket") == 0)
        return live(argv[2], argv[4]);
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
              "       beam_truth --live SPEC --socket PATH   the beam in lock step with a controller\n",
              stderr);
        return 2;
    }
    return status;
}
