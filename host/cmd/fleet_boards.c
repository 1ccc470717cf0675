/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Images of a fleet's models: one process for each, as for the fits; what became of each is a row of the answer. */
#include "fleet_boards.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "board/board.h"
#include "board_give.h"
#include "fleet/fleet.h"
#include "fleet_options.h"
#include "model/model.h"
#include "show/show.h"
#include "signing.h"

/* One unit's image, and where it goes. */
struct delivery {
    char *unit, *port, *key; /* port: of a download; key "": that of the command line */
    char *device, *counter;  /* of an export, from the manifest's columns; "": none */
    struct json *said;       /* the row of the answer */
};

struct work {
    const char *results, *key, *signing_key, *output;
    bool downloads, no_store;
    size_t processes;
    size_t n, answered, refused;
    struct delivery *all; /* [n] */
    struct progress *progress;
};

/* ---- One unit, in its own process ---- */

static bool take_model(void *context, const struct fleet_value v[], size_t n)
{
    char **text = context;
    if (n == 1)
        *text = bf_strdup(v[0].text);
    return false;
}

/* With what its diagnosis found to be missing, where it did. */
static enum bf_status read_model(const struct work *w, const char *unit, struct model *model, char sha256[65],
                                 struct bf_error *err)
{
    struct fleet_results *results;
    char *text = NULL;
    if (fleet_results_read(w->results, &results, err) != BF_OK)
        return err->status;
    enum bf_status status = fleet_results_ask(
        results,
        "SELECT m.text FROM models m JOIN units u ON u.unit = m.unit AND u.status = 'done' LEFT JOIN verdicts v ON "
        "v.unit = m.unit WHERE m.unit = ?1 AND (m.stage = 'fit' OR v.verdict = 'missing') ORDER BY m.stage DESC",
        unit, take_model, &text, err);
    fleet_results_close(results);
    if (status == BF_OK && text == NULL)
        status = bf_fail(err, BF_BAD_FILE, "%s has no fitted model of this unit", w->results);
    if (status == BF_OK) {
        hash_sha256_hex(text, strlen(text), sha256);
        status = model_read_text(unit, text, strlen(text), model, err);
    }
    free(text);
    return status;
}

static enum bf_status make_image(const struct work *w, const char *unit, struct target_image *image, char sha256[65],
                                 struct bf_error *err)
{
    static const struct target_options options = {.hold = BEAM_HOLD_ZERO_ORDER};
    struct model model;
    if (read_model(w, unit, &model, sha256, err) != BF_OK)
        return err->status;
    const enum bf_status status = target_image_make(&model, &options, image, err);
    model_free(&model);
    return status;
}

/* A file signed for the device that the manifest names. */
static enum bf_status export_one(const struct work *w, const struct delivery *d, struct beam_image_file *file,
                                 struct fleet_rows *rows, const char *sha256, struct bf_error *err)
{
    struct signing signing = {.key_file = w->key};
    char path[4096];
    enum bf_status status = BF_OK;
    if (w->key != NULL && (d->device[0] == '\0' || d->counter[0] == '\0'))
        return bf_fail(err, BF_USAGE,
                       "the manifest has no 'device' and 'counter' for it; give them, or leave --key out");
    if (w->key != NULL)
        status = signing_take_device(&signing, d->device, err);
    if (status == BF_OK && w->key != NULL)
        status = signing_take_counter(&signing, d->counter, err);
    if (status == BF_OK && w->key != NULL)
        status = signing_sign(&signing, file, err);
    (void)snprintf(path, sizeof path, "%s/%s.img", w->output, d->unit);
    if (status == BF_OK && strchr(d->unit, '/') != NULL)
        status = bf_fail(err, BF_USAGE, "its name has a '/', which no file name has");
    if (status == BF_OK)
        status = target_image_write(path, file, err);
    if (status == BF_OK)
        fleet_row(rows, FLEET_BOARDS, w->key != NULL ? "signed" : "unsigned", path, w->key != NULL ? d->device : "",
                  w->key != NULL ? (double)signing.counter : nan(""), 0, sha256, "");
    return status;
}

static enum bf_status download_one(const struct work *w, const struct delivery *d, struct beam_image_file *file,
                                   struct fleet_rows *rows, const char *sha256, struct bf_error *err)
{
    const char *key_path = d->key[0] != '\0' ? d->key : w->key;
    struct link_download done = {.no_store = w->no_store};
    struct device_key key, signing;
    struct link link;
    char device[DEVICE_ID_TEXT];
    if (key_path == NULL)
        return bf_fail(err, BF_USAGE, "a board takes a model only from who has its key: --key FILE, or a column 'key'");
    if (device_key_read(w->signing_key != NULL ? w->signing_key : key_path, &signing, err) != BF_OK ||
        device_key_read(key_path, &key, err) != BF_OK)
        return err->status;
    enum bf_status status = link_open(d->port, PORT_BAUD, &link, err);
    if (status == BF_OK) {
        status = board_give(&link, &key, key_path, &signing, d->unit, true, file, &done, err);
        device_id_print(link.info.device, device);
        if (status == BF_OK)
            fleet_row(rows, FLEET_BOARDS, "runs", d->port, device, (double)file->front.header.counter,
                      (int)(link.info.stored == file->front.header.counter), sha256, "");
        link_close(&link);
    }
    device_key_wipe(&key);
    device_key_wipe(&signing);
    return status;
}

static void deliver(void *context, const struct fleet_job *job, struct fleet_report *report)
{
    const struct work *w = context;
    const struct delivery *d = &w->all[job->unit];
    struct target_image *image = bf_alloc(1, sizeof *image);
    struct fleet_rows rows = {0};
    struct bf_error err = {BF_OK, ""};
    char sha256[65] = "", none[65] = "0000000000000000000000000000000000000000000000000000000000000000";
    enum bf_status status = make_image(w, d->unit, image, sha256, &err);
    if (status == BF_OK)
        status = w->downloads ? download_one(w, d, &image->file, &rows, sha256, &err)
                              : export_one(w, d, &image->file, &rows, sha256, &err);
    if (status != BF_OK)
        fleet_row(&rows, FLEET_BOARDS, "refused", w->downloads ? d->port : "", "", nan(""), 0, sha256, err.text);
    fleet_say_identity(report, none);
    fleet_say_rows(report, &rows);
    fleet_rows_free(&rows);
    target_image_free(image);
    free(image);
}

/* ---- All units ---- */

static void take(void *context, size_t i, const struct fleet_rows *rows)
{
    struct work *w = context;
    struct fleet_value v[FLEET_COLUMNS];
    enum fleet_table table;
    struct delivery *d = &w->all[i];
    struct json *one = json_new_object();
    const char *status = "refused";
    for (size_t at = 0; fleet_rows_next(rows->bytes, rows->n, &at, &table, v);) {
        if (table == FLEET_BOARDS) {
            status = strcmp(v[0].text, "runs") == 0       ? "runs"
                     : strcmp(v[0].text, "signed") == 0   ? "signed"
                     : strcmp(v[0].text, "unsigned") == 0 ? "unsigned"
                                                          : "refused";
            json_put_text(one, "place", v[1].text);
            json_put_text(one, "device", v[2].text);
            json_put_number(one, "counter", v[3].number);
            json_put_bool(one, "stored", v[4].number > 0.0);
            json_put_text(one, "model_sha256", v[5].text);
            json_put_text(one, "reason", v[6].text);
        } else if (table == FLEET_UNITS) { /* its process died */
            json_put_text(one, "place", w->downloads ? d->port : "");
            json_put_text(one, "reason", v[2].text);
        }
    }
    json_put_text(one, "unit", d->unit);
    json_put_text(one, "status", status);
    d->said = one;
    w->refused += strcmp(status, "refused") == 0;
    w->answered++;
    progress_update(w->progress, (double)w->answered / (double)w->n, d->unit);
}

static void hand_out(struct work *w, struct bf_error *err)
{
    enum { PATIENCE_MS = 200, BOARDS_AT_ONCE = 64 };
    const size_t most = w->processes > 0 ? w->processes : w->downloads ? BOARDS_AT_ONCE : (size_t)workers_wanted(0);
    struct fleet_crew *crew = fleet_crew_new(most, 0.0, deliver, w);
    size_t next = 0;
    w->progress = progress_begin(w->downloads ? "boards" : "images");
    while ((next < w->n || fleet_crew_works(crew)) && !progress_interrupted() && err->status == BF_OK) {
        for (; next < w->n && fleet_crew_has_room(crew) && err->status == BF_OK; next++)
            (void)fleet_crew_start(crew, &(struct fleet_job){.unit = next}, err);
        fleet_crew_wait(crew, PATIENCE_MS, take, w);
    }
    fleet_crew_free(crew);
    progress_end(w->progress);
}

/* 1 where some refused: that is what a script asks. */
static enum bf_status answer(struct work *w, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "results", w->results);
    json_put_number(root, "refused", (double)w->refused);
    struct json *list = json_put(root, "boards", json_new_array());
    for (size_t i = 0; i < w->n; i++) {
        if (w->all[i].said != NULL)
            (void)json_push(list, w->all[i].said);
        w->all[i].said = NULL;
    }
    const enum bf_status status = answer_print_and_free(root, fleet_fields, err);
    if (status == BF_OK && w->answered < w->n)
        return bf_fail(err, BF_DEVICE, "interrupted: %zu of %zu are done", w->answered, w->n);
    if (status == BF_OK && w->refused > 0)
        return bf_fail(err, BF_NO, "%zu of %zu refused (above, with reasons)", w->refused, w->n);
    return status;
}

static void work_free(struct work *w)
{
    for (size_t i = 0; i < w->n; i++) {
        struct delivery *d = &w->all[i];
        free(d->unit), free(d->port), free(d->key), free(d->device), free(d->counter);
        if (d->said != NULL)
            json_discard(d->said);
    }
    free(w->all);
}

static enum bf_status parse(int argc, char **argv, struct work *w, int n_names, struct bf_error *err)
{
    int code;
    long count = 0;
    while ((code = options_next(argc, argv, fleet_options, err)) != -1) {
        if (code == 'k')
            w->key = optarg;
        else if (code == 'o')
            w->output = optarg;
        else if (code == 'S')
            w->no_store = true;
        else if (code == 'K')
            w->signing_key = optarg;
        else if (code != 'p')
            return err->status != BF_OK
                       ? BF_USAGE
                       : bf_fail(err, BF_USAGE,
                                 "`fleet %s` takes -o, --key, --signing-key, --no-store, --processes, --json", argv[0]);
        else if (options_count("--processes", optarg, 1, 256, &count, err) != BF_OK)
            return BF_USAGE;
    }
    w->processes = (size_t)count;
    if (argc - optind != n_names)
        return bf_fail(err, BF_USAGE, "%s",
                       n_names == 1 ? "give one file of results: beamfit fleet export RESULTS -o DIR"
                                    : "give results and ports: beamfit fleet download RESULTS PORTS "
                                      "--key FILE");
    w->results = argv[optind];
    return BF_OK;
}

static bool take_unit(void *context, const struct fleet_value v[], size_t n)
{
    struct work *w = context;
    w->all = bf_grow(w->all, w->n + 1, sizeof *w->all);
    w->all[w->n++] = (struct delivery){.unit = bf_strdup(v[0].text),
                                       .device = bf_strdup(n > 1 ? v[1].text : ""),
                                       .counter = bf_strdup(n > 2 ? v[2].text : "")};
    return true;
}

enum bf_status fleet_export(int argc, char **argv, struct bf_error *err)
{
    struct work w = {.results = NULL};
    struct fleet_results *results = NULL;
    enum bf_status status = parse(argc, argv, &w, 1, err);
    if (status == BF_OK && w.output == NULL)
        status = bf_fail(err, BF_USAGE, "say which directory the images go to: -o DIR");
    if (status == BF_OK)
        status = fleet_results_read(w.results, &results, err);
    if (status == BF_OK)
        status = fleet_results_ask(results,
                                   "SELECT m.unit, d.value, c.value FROM manifest m JOIN units u ON u.unit = m.unit "
                                   "AND u.status = 'done' LEFT "
                                   "JOIN columns d ON d.unit = m.unit AND d.name = 'device' LEFT JOIN columns c ON "
                                   "c.unit = m.unit AND c.name = "
                                   "'counter' ORDER BY m.place",
                                   NULL, take_unit, &w, err);
    fleet_results_close(results);
    if (status == BF_OK && mkdir(w.output, 0777) != 0 && errno != EEXIST)
        status = bf_fail(err, BF_BAD_FILE, "%s: cannot be made (%s)", w.output, strerror(errno));
    if (status == BF_OK) {
        progress_catch_interrupts();
        hand_out(&w, err);
        status = err->status == BF_OK ? answer(&w, err) : err->status;
    }
    work_free(&w);
    return status;
}

enum bf_status fleet_download(int argc, char **argv, struct bf_error *err)
{
    struct work w = {.downloads = true};
    struct fleet_results *results = NULL;
    struct fleet_ports ports = {0};
    enum bf_status status = parse(argc, argv, &w, 2, err);
    if (status == BF_OK)
        status = fleet_results_read(w.results, &results, err);
    fleet_results_close(results);
    if (status == BF_OK)
        status = fleet_ports_read(argv[optind + 1], &ports, err);
    w.all = bf_alloc(ports.n, sizeof *w.all);
    for (; w.n < ports.n; w.n++)
        w.all[w.n] = (struct delivery){.unit = bf_strdup(ports.all[w.n].unit),
                                       .port = bf_strdup(ports.all[w.n].port),
                                       .key = bf_strdup(ports.all[w.n].key)};
    if (status == BF_OK) {
        progress_catch_interrupts();
        hand_out(&w, err);
        status = err->status == BF_OK ? answer(&w, err) : err->status;
    }
    fleet_ports_free(&ports);
    work_free(&w);
    return status;
}
