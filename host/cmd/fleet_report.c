/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fleet_report.h"

#include <stdlib.h>

#include "fleet/fleet.h"
#include "fleet_options.h"
#include "show/show.h"

struct arguments {
    const char *results, *page;
    double false_alarm_rate;
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    a->false_alarm_rate = 0.05;
    while ((code = options_next(argc, argv, fleet_options, err)) != -1) {
        if (code == 'o')
            a->page = optarg;
        else if (code != 'a')
            return err->status != BF_OK ? BF_USAGE
                                        : bf_fail(err, BF_USAGE, "`fleet report` takes -o, --false-alarms, --json");
        else if (options_positive("--false-alarms", optarg, 0.5, &a->false_alarm_rate, err) != BF_OK)
            return BF_USAGE;
    }
    if (argc - optind != 1)
        return bf_fail(err, BF_USAGE, "give one file of results: beamfit fleet report RESULTS -o PAGE.html");
    a->results = argv[optind];
    return options_one_answer(a->page, err);
}

static enum bf_status write_page(const struct arguments *a, const struct fleet_population *population,
                                 struct bf_error *err)
{
    struct atomic_file out;
    if (atomic_open(a->page, &out, err) != BF_OK)
        return err->status;
    population_page(out.f, a->results, population);
    outputs_mark(&out, "<!-- ", " -->\n");
    return atomic_commit(&out, err);
}

static enum bf_status answer(const struct arguments *a, const struct fleet_population *population, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "results", a->results);
    if (a->page != NULL)
        json_put_text(root, "page", a->page);
    (void)json_put(root, "population", population_json(population));
    return answer_print_and_free(root, fleet_fields, err);
}

enum bf_status fleet_report(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.results = NULL};
    struct fleet_results *results = NULL;
    struct fleet_population population = {.n_units = 0};
    enum bf_status status = parse(argc, argv, &a, err);
    if (status == BF_OK)
        outputs_note_input(a.results);
    if (status == BF_OK)
        status = fleet_results_read(a.results, &results, err);
    if (status == BF_OK && a.page != NULL)
        status = atomic_check(a.page, err);
    if (status == BF_OK)
        status = fleet_population_find(results, a.false_alarm_rate, &population, err);
    if (status == BF_OK && a.page != NULL)
        status = write_page(&a, &population, err);
    if (status == BF_OK)
        status = answer(&a, &population, err);
    fleet_population_free(&population);
    fleet_results_close(results);
    return status;
}
