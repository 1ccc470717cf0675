/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "commands.h"
#include "fleet_boards.h"
#include "fleet_fit.h"
#include "fleet_report.h"
#include "fleet_run.h"
#include "ground/ground.h"

static const char help[] =
    "Usage: beamfit fleet MANIFEST -o RESULTS [--diagnose] [options]\n"
    "       beamfit fleet fit MODEL RECORD... -o FITTED\n"
    "       beamfit fleet report RESULTS [-o PAGE.html]\n"
    "       beamfit fleet export RESULTS -o DIR [--key FILE]\n"
    "       beamfit fleet download RESULTS PORTS --key FILE\n"
    "\n"
    "Fits many units, each as `beamfit fit` does, and diagnoses them as `beamfit diagnose` does. MANIFEST is a CSV "
    "file "
    "with the columns unit, model, records, optionally checks, and any of your own (date, temperature, device). Files "
    "in "
    "one cell are separated by blanks, or by ';' where there is one; they are relative to MANIFEST.\n"
    "\n"
    "RESULTS is one SQLite file with the tables units, inputs (SHA-256), parameters, covariances, errors, verdicts, "
    "effects, models, warnings, runs, manifest, columns. Each unit has a process of its own: one that fails or crashes "
    "is a row with its reason. A unit that is done is in RESULTS, whenever the run is ended; the same command goes on "
    "there. A unit whose files, settings or program have changed since is fitted again. `mpirun -n 8 beamfit-fleet "
    "...` takes the same words and does the same on several machines.\n"
    "\n"
    "`fleet fit` fits one model to thousands of records, named in the command or, one a line, in a file @LIST: on the "
    "processors of this machine, or with `mpirun -n 8 beamfit-fleet fit ...` on several machines, with the same "
    "numbers.\n"
    "\n"
    "`fleet report` says what the units are together: mean and spread of each parameter, the units' own errors taken "
    "off; units that stand out; drift against your columns; which effect is missing in how many.\n"
    "\n"
    "`fleet export` writes the image of each unit's model, DIR/UNIT.img, signed for the device and with the counter "
    "that "
    "MANIFEST has in columns of these names. `fleet download` makes the images and gives each to its board, all at "
    "once: "
    "PORTS is a CSV file with the columns unit, port and, where boards have keys of their own, key. What each board "
    "now "
    "runs, or why it refused, is a row of the answer.\n";

static const char closing[] =
    "Ctrl-C ends the run: what is done is kept.\n"
    "\n"
    "Example:\n"
    "  beamfit fleet units.csv -o fleet.sqlite --diagnose\n"
    "  beamfit fleet report fleet.sqlite -o fleet.html\n"
    "  beamfit fleet fit arm.yaml @records.txt -o arm-fitted.yaml\n"
    "\n"
    "Exit status: 0 done, also when units failed (they are listed); 2 usage, or RESULTS is of another manifest or not "
    "of `beamfit fleet`; 3 bad manifest, or RESULTS cannot be written; 4 interrupted.\n";

/* Processes of this machine. */
static void hand_out(struct fleet_run *run, struct bf_error *err)
{
    enum { PATIENCE_MS = 100 };
    struct fleet_job job;
    const size_t asked = run->arguments.processes;
    struct fleet_crew *crew =
        fleet_crew_new(asked > 0 ? asked : (size_t)workers_wanted(0), run->arguments.limit_s, fleet_run_work, run);
    bool more = true;
    while ((more || fleet_crew_works(crew)) && !progress_interrupted() && run->err.status == BF_OK) {
        while (more && fleet_crew_has_room(crew)) {
            more = fleet_run_next(run, &job);
            if (more && fleet_crew_start(crew, &job, err) != BF_OK)
                run->err = *err;
        }
        fleet_crew_wait(crew, PATIENCE_MS, fleet_run_take, run);
        fleet_run_settle(run, false);
    }
    fleet_crew_free(crew);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct fleet_run fleet = {.next = 0};
    if (argc > 1 && strcmp(argv[1], "fit") == 0)
        return fleet_fit(argc - 1, argv + 1, err);
    if (argc > 1 && strcmp(argv[1], "report") == 0)
        return fleet_report(argc - 1, argv + 1, err);
    if (argc > 1 && strcmp(argv[1], "export") == 0)
        return fleet_export(argc - 1, argv + 1, err);
    if (argc > 1 && strcmp(argv[1], "download") == 0)
        return fleet_download(argc - 1, argv + 1, err);
    int code;
    while ((code = options_next(argc, argv, fleet_options, err)) != -1)
        if (fleet_take_option(code, &fleet.arguments, err) != BF_OK)
            return BF_USAGE;
    enum bf_status status = fleet_check_arguments(argc, argv, &fleet.arguments, err);
    if (status == BF_OK)
        status = fleet_run_open(&fleet, true, err);
    if (status == BF_OK) {
        progress_catch_interrupts();
        hand_out(&fleet, err);
        status = fleet_run_answer(&fleet, err);
    }
    fleet_run_close(&fleet);
    return status;
}

const struct command command_fleet = {
    .place = 65,
    .name = "fleet",
    .summary = "many units: fit and diagnose each into one file, and what they are together",
    .help = help,
    .options = fleet_options,
    .closing = closing,
    .answer = fleet_fields,
    .run = run,
};
