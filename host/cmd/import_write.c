/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "import_write.h"

#include "show/show.h"

#include <math.h>
#include <stdio.h>

static const struct answer_field channel_fields[] = {
    ANSWER_CELL("#", "{@}"),
    ANSWER_ROW(TEXT, "name", "in the file", .text = "channel"),
    ANSWER_ROW(TEXT, "unit", "that the file states", .text = "unit"),
    ANSWER_ROW(COUNT, "samples", "of it", .text = "samples"),
    ANSWER_ROW(NUMBER, "dt_s", "sampling interval", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "df_Hz", "distance of frequencies", .flags = ANSWER_MAYBE),
    ANSWER_ROW(BOOL, "usable", "it can be a column"),
    ANSWER_ROW(TEXT, "axis", "its times or frequencies, in words"),
    ANSWER_ROW(TEXT, "note", "why not, or what the file says"),
    ANSWER_CELL("time axis; notes", "{axis}[{axis?}{note?}; ]{note}"),
    {0},
};

static const struct answer_field range_fields[] = {
    ANSWER_ROW(TEXT, "name", "of the column", .text = "column"),
    ANSWER_ROW(NUMBER, "least", "value in it", .text = "least"),
    ANSWER_ROW(NUMBER, "most", "value in it", .text = "most"),
    ANSWER_ROW(TEXT, "from", "where it comes from", .text = "from"),
    {0},
};

const struct answer_field import_fields[] = {
    ANSWER_ROW(TEXT, "file", "that was listed or written"),
    ANSWER_ROW(TEXT, "format", "of the file, with --list", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "sha256", "of the file, with --list", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "rate_Hz", "that the file states, with --list; of the record", .flags = ANSWER_MAYBE,
               .digits = 9),
    ANSWER_ROW(TEXT, "rate_from", "where the file states it, with --list", .flags = ANSWER_MAYBE),
    ANSWER_SAY("[{file}: {format}, {channels#} {channels#channel|channels}][{format?}, {rate_Hz} ({rate_from})]"),
    ANSWER_ROW_OF(LIST, "channels", "of the file, with --list", channel_fields, .flags = ANSWER_MAYBE | ANSWER_TABLE,
                  .text = ""),
    ANSWER_ROW(TEXTS, "columns", "of the record", .flags = ANSWER_MAYBE),
    ANSWER_ROW(COUNT, "samples", "of the record", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "dt_s", "sampling interval", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "t0_s", "time of the first sample", .flags = ANSWER_MAYBE, .digits = 6),
    ANSWER_ROW(NUMBER, "t1_s", "time of the last sample", .flags = ANSWER_MAYBE, .digits = 6),
    ANSWER_ROW(NUMBER, "df_Hz", "distance of frequencies", .flags = ANSWER_MAYBE, .digits = 9),
    ANSWER_ROW(NUMBER, "f0_Hz", "the first frequency", .flags = ANSWER_MAYBE, .digits = 6),
    ANSWER_ROW(NUMBER, "f1_Hz", "the last frequency", .flags = ANSWER_MAYBE, .digits = 6),
    ANSWER_ROW(TEXT, "axis_from", "where times or frequencies come from", .flags = ANSWER_MAYBE),
    ANSWER_SAY("[{file}: {samples} samples, {rate_Hz}, {t0_s} to {t1_s}; time: {axis_from}]"),
    ANSWER_SAY("[{file}: {samples} lines, {df_Hz} apart, {f0_Hz} to {f1_Hz}; frequencies: {axis_from}]"),
    ANSWER_ROW(TEXT, "resampled", "line '# resampled:' of the record", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "resampled_2", "line '# resampled_2:' of the record", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "joined", "line '# joined:' of the record", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "gate", "line '# gate:' of the record", .flags = ANSWER_MAYBE),
    ANSWER_SAY("[    resampled: {resampled}]"),
    ANSWER_SAY("[    resampled_2: {resampled_2}]"),
    ANSWER_SAY("[    joined: {joined}]"),
    ANSWER_SAY("[    gate: {gate}]"),
    ANSWER_ROW_OF(LIST, "ranges", "of the columns", range_fields, .flags = ANSWER_MAYBE | ANSWER_TABLE, .text = ""),
    ANSWER_ROW_OF(LIST, "record_findings", "what is wrong with it before any model", record_finding_fields,
                  .flags = ANSWER_MAYBE, .text = "\nIn the records:"),
    {0},
};

static void describe_axis(const struct import_file *file, const struct import_channel *c, char text[64])
{
    double factor;
    if (c->axis != IMPORT_NO_AXIS)
        snprintf(text, 64, "times in '%.30s'", file->channels[c->axis].name);
    else if (c->over_frequency)
        snprintf(text, 64, "%.6g Hz to %.6g Hz", c->t0_s, c->t0_s + (double)(c->n - 1) * c->dt_s);
    else if (c->dt_s > 0)
        snprintf(text, 64, "%.9g Hz from %.6g s", 1 / c->dt_s, c->t0_s);
    else if (c->unusable == NULL && c->n >= 2 && import_looks_like_time(c, &factor))
        snprintf(text, 64, "looks like time");
    else
        text[0] = '\0';
}

enum bf_status import_print_list(const struct import_file *file, struct bf_error *err)
{
    char axis[64];
    struct json *root = json_new_object();
    json_put_text(root, "file", file->path);
    json_put_text(root, "format", import_format_name(file->format));
    json_put_text(root, "sha256", file->sha256);
    json_put_number(root, "rate_Hz", file->rate_Hz > 0 ? file->rate_Hz : (double)NAN);
    if (file->rate_Hz > 0)
        json_put_text(root, "rate_from", file->rate_from);
    struct json *channels = json_put(root, "channels", json_new_array());
    for (size_t i = 0; i < file->n_channels; i++) {
        const struct import_channel *c = &file->channels[i];
        struct json *one = json_push(channels, json_new_object());
        describe_axis(file, c, axis);
        json_put_text(one, "name", c->name);
        json_put_text(one, "unit", c->unit);
        json_put_number(one, "samples", (double)c->n);
        json_put_number(one, c->over_frequency ? "df_Hz" : "dt_s", c->dt_s > 0 ? c->dt_s : (double)NAN);
        json_put_bool(one, "usable", c->unusable == NULL);
        json_put_text(one, "axis", axis);
        json_put_text(one, "note", c->unusable != NULL ? c->unusable : c->about);
    }
    return answer_print_and_free(root, import_fields, err);
}

/* What was done to the times, where anything was. */
static const char *const told[] = {"resampled", "resampled_2", "joined", "gate"};

static void put_ranges(struct json *root, const struct record *record)
{
    struct json *list = json_put(root, "ranges", json_new_array());
    for (size_t i = 0; i < record->n_columns; i++) {
        char key[128];
        const double *x = record->columns[i].x;
        double low = x[0], high = x[0];
        for (size_t k = 1; k < record->n; k++) {
            low = fmin(low, x[k]);
            high = fmax(high, x[k]);
        }
        (void)snprintf(key, sizeof key, "channel_%.60s", record->columns[i].name);
        const char *from = record_meta(record, key);
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "name", record->columns[i].name);
        json_put_number(one, "least", low);
        json_put_number(one, "most", high);
        json_put_text(one, "from", from != NULL ? from : "");
    }
}

static void put_axis(struct json *root, const struct record *record)
{
    const bool frequency = record->over_frequency;
    const char *from = record_meta(record, frequency ? "frequency_from" : "time_from");
    json_put_number(root, frequency ? "df_Hz" : "dt_s", record->dt_s);
    json_put_number(root, frequency ? "f0_Hz" : "t0_s", record->t0_s);
    json_put_number(root, frequency ? "f1_Hz" : "t1_s", record->t0_s + (double)(record->n - 1) * record->dt_s);
    if (!frequency)
        json_put_number(root, "rate_Hz", 1.0 / record->dt_s);
    json_put_text(root, "axis_from", from != NULL ? from : "");
}

static enum bf_status print_record(const struct record *record, const struct record_findings *findings,
                                   const struct import_job *job, struct bf_error *err)
{
    struct json *root = json_new_object(), *columns = json_put(root, "columns", json_new_array());
    json_put_text(root, "file", job->output);
    for (size_t i = 0; i < record->n_columns; i++)
        json_push_text(columns, record->columns[i].name);
    json_put_number(root, "samples", (double)record->n);
    put_axis(root, record);
    for (size_t i = 0; i < sizeof told / sizeof *told; i++)
        if (record_meta(record, told[i]) != NULL)
            json_put_text(root, told[i], record_meta(record, told[i]));
    put_ranges(root, record);
    record_findings_json(root, record, findings, 1);
    answer_next(root, "beamfit", "fit", "MODEL", job->output, "-o", "FITTED", NULL);
    return answer_print_and_free(root, import_fields, err);
}

static enum bf_status make(const struct import_file files[], size_t n_files, const struct import_choice *choice,
                           const struct import_job *job, struct record *record, struct bf_error *err)
{
    if (n_files == 1)
        return import_record(&files[0], choice, record, err);
    return import_joined(files, choice, job->trigger[0] != NULL ? job->trigger : NULL, record, err);
}

static enum bf_status gate_force(const struct import_job *job, struct record *record, struct bf_error *err)
{
    char said[200];
    if (job->gate == NULL)
        return BF_OK;
    const enum bf_status status = record_gate(record, job->gate, job->gate_s[0], job->gate_s[1], said, err);
    if (status == BF_OK)
        record_add_meta(record, "gate", said);
    return status;
}

enum bf_status import_write(const struct import_file files[], size_t n_files, const struct import_choice *choice,
                            const struct import_job *job, struct bf_error *err)
{
    struct record record;
    struct record_findings findings;
    enum bf_status status = make(files, n_files, choice, job, &record, err);
    if (status != BF_OK)
        return status;
    record_findings_find(&record, record_is_force, record_is_signal, NULL, &findings);
    status = gate_force(job, &record, err);
    if (status == BF_OK)
        status = record_write(job->output, &record, job->digits, err);
    if (status == BF_OK)
        status = print_record(&record, &findings, job, err);
    record_findings_free(&findings);
    record_free(&record);
    return status;
}
