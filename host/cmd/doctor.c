/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <ftw.h>
#include <glob.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "beam/beam.h"
#include "commands.h"
#include "ground/ground.h"
#include "model/model.h"
#include "show/show.h"

static const struct answer_field check_fields[] = {
    ANSWER_ROW(TEXT, "name", "what was looked at"),
    ANSWER_ROW(BOOL, "ok", "nothing is to be done"),
    ANSWER_ROW(TEXT, "text", "what was found"),
    ANSWER_ROW(TEXT, "remedy", "what to do; empty: nothing"),
    ANSWER_CELL("", "{ok?ok|missing}"),
    ANSWER_CELL("", "{name}"),
    ANSWER_CELL("", "{text}"),
    {0},
};

static const struct answer_field remedy_fields[] = {
    /* a line of its own, so that a command is not broken */
    ANSWER_SAY("[{remedy?}{name}: {remedy}]"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "version", "of the program"),
    ANSWER_ROW(BOOL, "ok", "all is there"),
    ANSWER_ROW_OF(LIST, "checks", "one each", check_fields, .flags = ANSWER_TABLE, .text = ""),
    ANSWER_ROW_OF(LIST, "checks", "", remedy_fields, .flags = ANSWER_AGAIN, .text = ""),
    {0},
};

static const char help[] =
    "Usage: beamfit doctor [--json]\n"
    "\n"
    "Looks at what the program needs on this machine, and says what to do where something is missing. Nothing is\n"
    "changed.\n";

static const struct option_row options[] = {
    {.name = "computation",
     .what = "the libraries that compute: the first mode of a plain cantilever against its closed form"},
    {.name = "gnuplot", .what = "draws a picture as PNG and PDF (--plot)"},
    {.name = "fonts", .what = "DejaVu Sans, which the pictures are set in"},
    {.name = "serial",
     .what = "may you read and write the serial ports that are plugged in? (info, record, monitor ...)"},
    {.name = "directory", .what = "can files be written here, and pictures below TMPDIR?"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] = "Example:\n"
                              "  beamfit doctor\n"
                              "\n"
                              "Exit status: 0 all is there; 1 something is missing; 2 usage.\n";

/* What was looked at: said for a person; remedy "" when all is well. */
struct check {
    const char *name;
    char said[240], remedy[240];
};

/* f₁ = 1.8751² √(EI/ρ)/(2π L²) of a uniform clamped-free beam. */
static double cantilever_Hz(const struct model *model)
{
    static const double root = 1.8751040687119611;
    const struct material *beam = &model->materials[0];
    return root * root * sqrt(beam->EI.value / beam->rho.value) / (2.0 * M_PI * model->length_m * model->length_m);
}

static void check_computation(struct check *check)
{
    static const double agrees = 1e-6;
    const struct starting_beam beam = {.length_m = 0.3,
                                       .beam = {70e9, 2700.0, 0.02, 0.002},
                                       .beam_material = "aluminium",
                                       .patch_material = "",
                                       .patch_sides = 2};
    struct model model;
    struct modes modes;
    struct bf_error err = {BF_OK, ""};
    char *text = starting_model_text(&beam);
    if (model_read_text("a cantilever", text, strlen(text), &model, &err) == BF_OK) {
        if (modes_compute(&model, 1, 0.0, 2, &modes, &err) == BF_OK) {
            const double f_Hz = modes.mode[0].undamped_Hz, off = f_Hz / cantilever_Hz(&model) - 1.0;
            (void)snprintf(check->said, sizeof check->said, "a cantilever's first mode is at %.5g Hz, %.1g off", f_Hz,
                           fabs(off));
            if (!(fabs(off) < agrees))
                (void)snprintf(check->remedy, sizeof check->remedy,
                               "that is wrong: apt-get install --reinstall libopenblas0 libarpack2 libcholmod3");
            modes_free(&modes);
        }
        model_free(&model);
    }
    if (err.status != BF_OK) {
        (void)snprintf(check->said, sizeof check->said, "%.200s", err.text);
        (void)snprintf(check->remedy, sizeof check->remedy,
                       "apt-get install --reinstall libopenblas0 libarpack2 libcholmod3");
    }
    free(text);
}

/* ---- Pictures ---- */

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *at)
{
    (void)info, (void)kind, (void)at;
    return remove(path);
}

/* A new directory below TMPDIR, to be removed with everything in it; false when there is none. */
static bool new_directory(char path[200])
{
    const char *base = getenv("TMPDIR");
    (void)snprintf(path, 200, "%.150s/beamfit-doctor-XXXXXX", base != NULL && base[0] != '\0' ? base : "/tmp");
    return mkdtemp(path) != NULL;
}

static void check_gnuplot(struct check *check)
{
    static const double x[2] = {1.0, 2.0};
    const struct plot_line line = {"a line", 2, x, x};
    char directory[200];
    struct bf_error err = {BF_OK, ""};
    if (!plot_can_draw(NULL)) {
        (void)snprintf(check->said, sizeof check->said, "is not on the PATH, so there are no pictures");
        (void)snprintf(check->remedy, sizeof check->remedy, "apt-get install gnuplot-nox");
        return;
    }
    if (!new_directory(directory)) {
        (void)snprintf(check->said, sizeof check->said, "not tried: there is no place below TMPDIR");
        return;
    }
    const struct plot_convergence plot = {.directory = directory,
                                          .stem = "doctor",
                                          .title = "doctor",
                                          .x_label = "x",
                                          .y_label = "y",
                                          .n_lines = 1,
                                          .lines = &line};
    if (plot_convergence(&plot, &err) == BF_OK) {
        (void)snprintf(check->said, sizeof check->said, "draws PNG and PDF");
    } else {
        (void)snprintf(check->said, sizeof check->said, "%.200s", err.text);
        (void)snprintf(check->remedy, sizeof check->remedy,
                       "apt-get install gnuplot-nox, which has pngcairo and pdfcairo");
    }
    (void)nftw(directory, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}

static int is_font(const char *path, const struct stat *info, int kind, struct FTW *at)
{
    (void)info, (void)kind, (void)at;
    return strcmp(text_base_name(path), "DejaVuSans.ttf") == 0;
}

static void check_fonts(struct check *check)
{
    const char *home = getenv("HOME");
    char own[300];
    (void)snprintf(own, sizeof own, "%.200s/.local/share/fonts", home != NULL ? home : "");
    const char *const places[] = {"/usr/share/fonts", "/usr/local/share/fonts", own};
    bool found = false;
    for (size_t i = 0; i < sizeof places / sizeof *places && !found; i++)
        found = nftw(places[i], is_font, 16, FTW_PHYS) == 1;
    (void)snprintf(check->said, sizeof check->said,
                   found ? "DejaVu Sans is there" : "DejaVu Sans is not there, pictures will look odd");
    if (!found)
        (void)snprintf(check->remedy, sizeof check->remedy, "apt-get install fonts-dejavu-core");
}

/* ---- Ports and places ---- */

static void check_serial(struct check *check)
{
    glob_t ports = {0};
    const char *closed = NULL;
    (void)glob("/dev/ttyUSB*", 0, NULL, &ports);
    (void)glob("/dev/ttyACM*", GLOB_APPEND, NULL, &ports);
    for (size_t i = 0; i < ports.gl_pathc; i++)
        closed = access(ports.gl_pathv[i], R_OK | W_OK) != 0 ? ports.gl_pathv[i] : closed;
    if (ports.gl_pathc == 0)
        (void)snprintf(check->said, sizeof check->said, "no port is plugged in (/dev/ttyUSB*, /dev/ttyACM*)");
    else if (closed == NULL)
        (void)snprintf(check->said, sizeof check->said, "%zu port%s, all may be read and written", ports.gl_pathc,
                       ports.gl_pathc == 1 ? "" : "s");
    else {
        (void)snprintf(check->said, sizeof check->said, "%.100s may not be read and written by you", closed);
        (void)snprintf(check->remedy, sizeof check->remedy, "sudo adduser $USER dialout, then log in again");
    }
    globfree(&ports);
}

static void check_directory(struct check *check)
{
    char temporary[200];
    const bool here = access(".", W_OK) == 0, there = new_directory(temporary);
    if (there)
        (void)rmdir(temporary);
    (void)snprintf(check->said, sizeof check->said, "%s here, %s below TMPDIR",
                   here ? "files can be written" : "no file can be written", there ? "pictures" : "none");
    if (!here)
        (void)snprintf(check->remedy, sizeof check->remedy, "go to a directory of your own");
    else if (!there)
        (void)snprintf(check->remedy, sizeof check->remedy, "set TMPDIR to a directory that can be written");
}

/* ---- The answer ---- */

static enum bf_status print(const struct check checks[], size_t n, bool fine, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "version", BEAMFIT_VERSION);
    json_put_bool(root, "ok", fine);
    struct json *list = json_put(root, "checks", json_new_array());
    for (size_t i = 0; i < n; i++) {
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "name", checks[i].name);
        json_put_bool(one, "ok", checks[i].remedy[0] == '\0');
        json_put_text(one, "text", checks[i].said);
        json_put_text(one, "remedy", checks[i].remedy);
    }
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    static void (*const look[])(struct check *) = {check_computation, check_gnuplot, check_fonts, check_serial,
                                                   check_directory};
    struct check checks[] = {
        {.name = "computation"}, {.name = "gnuplot"}, {.name = "fonts"}, {.name = "serial"}, {.name = "directory"}};
    enum { CHECKS = sizeof checks / sizeof *checks };
    size_t missing = 0;
    if (options_next(argc, argv, options, err) != -1 || options_only(argc, argv, err) != BF_OK)
        return BF_USAGE;
    for (size_t i = 0; i < CHECKS; i++) {
        look[i](&checks[i]);
        missing += checks[i].remedy[0] != '\0';
    }
    if (print(checks, CHECKS, missing == 0, err) != BF_OK)
        return err->status;
    return missing == 0 ? BF_OK : bf_fail(err, BF_NO, "%zu of %d checks found something to do", missing, CHECKS);
}

const struct command command_doctor = {
    .place = 230,
    .name = "doctor",
    .summary = "what the program needs on this machine, and what to do where it is missing",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
