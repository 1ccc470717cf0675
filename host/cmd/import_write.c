/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "import_write.h"

#include "show/show.h"

#include <math.h>
#include <stdio.h>

static const struct answer_field channel_fields[] = {
    ANSWER_ROW(TEXT, "name", "in the file"),
    ANSWER_ROW(TEXT, "unit", "that the file states"),
    ANSWER_ROW(COUNT, "samples", "of it"),
    {ANSWER_NUMBER, "dt_s", "sampling interval", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "df_Hz", "distance of frequencies", NULL, ANSWER_MAYBE, NULL},
    ANSWER_ROW(BOOL, "usable", "it can be a column"),
    ANSWER_ROW(TEXT, "note", "why not, or what the file says"),
    {0},
};

const struct answer_field import_fields[] = {
    {ANSWER_TEXT, "format", "of the file, with --list", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_TEXT, "sha256", "of the file, with --list", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "rate_Hz", "that the file states, with --list", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_LIST, "channels", "of the file, with --list", channel_fields, ANSWER_MAYBE, NULL},
    {ANSWER_TEXTS, "columns", "of the record", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_COUNT, "samples", "of the record", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "dt_s", "sampling interval", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "t0_s", "time of the first sample", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "df_Hz", "distance of frequencies", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_NUMBER, "f0_Hz", "the first frequency", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_TEXT, "resampled", "line '# resampled:' of the record", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_TEXT, "resampled_2", "line '# resampled_2:' of the record", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_TEXT, "joined", "line '# joined:' of the record", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_TEXT, "gate", "line '# gate:' of the record", NULL, ANSWER_MAYBE, NULL},
    {ANSWER_LIST, "record_findings", "what is wrong with it before any model", record_finding_fields, ANSWER_MAYBE,
     NULL},
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

enum bf_status import_print_list(const struct import_file *file, bool json, struct bf_error *err)
{
    char axis[64];
    struct json *root = json ? json_new_object() : NULL, *channels = NULL;
    if (json) {
        json_put_text(root, "format", import_format_name(file->format));
        json_put_text(root, "sha256", file->sha256);
        json_put_number(root, "rate_Hz", file->rate_Hz > 0 ? file->rate_Hz : (double)NAN);
        channels = json_put(root, "channels", json_new_array());
    } else {
        printf("%s: %s, %zu channels", file->path, import_format_name(file->format), file->n_channels);
        if (file->rate_Hz > 0)
            printf(", %.9g Hz (%s)", file->rate_Hz, file->rate_from);
        printf("\n%4s  %-28s %-10s %10s  %s\n", "#", "channel", "unit", "samples", "time axis; notes");
    }
    for (size_t i = 0; i < file->n_channels; i++) {
        const struct import_channel *c = &file->channels[i];
        describe_axis(file, c, axis);
        const char *note = c->unusable != NULL ? c->unusable : c->about;
        if (json) {
            struct json *one = json_push(channels, json_new_object());
            json_put_text(one, "name", c->name);
            json_put_text(one, "unit", c->unit);
            json_put_number(one, "samples", (double)c->n);
            json_put_number(one, c->over_frequency ? "df_Hz" : "dt_s", c->dt_s > 0 ? c->dt_s : (double)NAN);
            json_put_bool(one, "usable", c->unusable == NULL);
            json_put_text(one, "note", note);
        } else {
            printf("%4zu  %-28s %-10s %10zu  %s%s%s\n", i + 1, c->name, c->unit, c->n, axis,
                   axis[0] != '\0' && note[0] != '\0' ? "; " : "", note);
        }
    }
    return json ? answer_print_and_free(root, import_fields, err) : BF_OK;
}

/* What was done to the times, where anything was. */
static const char *const told[] = {"resampled", "resampled_2", "joined", "gate"};

static enum bf_status print_record(const struct record *record, const struct record_findings *findings,
                                   const struct import_job *job, struct bf_error *err)
{
    if (job->json) {
        struct json *root = json_new_object(), *columns = json_put(root, "columns", json_new_array());
        for (size_t i = 0; i < record->n_columns; i++)
            json_push_text(columns, record->columns[i].name);
        json_put_number(root, "samples", (double)record->n);
        json_put_number(root, record->over_frequency ? "df_Hz" : "dt_s", record->dt_s);
        json_put_number(root, record->over_frequency ? "f0_Hz" : "t0_s", record->t0_s);
        for (size_t i = 0; i < sizeof told / sizeof *told; i++)
            if (record_meta(record, told[i]) != NULL)
                json_put_text(root, told[i], record_meta(record, told[i]));
        record_findings_json(root, record, findings, 1);
        answer_next(root, "beamfit", "fit", "MODEL", job->output, "-o", "FITTED", NULL);
        return answer_print_and_free(root, import_fields, err);
    }
    const double last = record->t0_s + (double)(record->n - 1) * record->dt_s;
    if (record->over_frequency)
        printf("%s: %zu lines, %.9g Hz apart, %.6g Hz to %.6g Hz; frequencies: %s\n", job->output, record->n,
               record->dt_s, record->t0_s, last, record_meta(record, "frequency_from"));
    else
        printf("%s: %zu samples, %.9g Hz, %.6g s to %.6g s; time: %s\n", job->output, record->n, 1 / record->dt_s,
               record->t0_s, last, record_meta(record, "time_from"));
    for (size_t i = 0; i < sizeof told / sizeof *told; i++) {
        char text[480];
        if (record_meta(record, told[i]) == NULL)
            continue;
        snprintf(text, sizeof text, "%s: %s", told[i], record_meta(record, told[i]));
        text_print_wrapped(stdout, text, 4, text_columns());
    }
    for (size_t i = 0; i < record->n_columns; i++) {
        char key[128];
        const double *x = record->columns[i].x;
        double low = x[0], high = x[0];
        for (size_t k = 1; k < record->n; k++) {
            low = fmin(low, x[k]);
            high = fmax(high, x[k]);
        }
        snprintf(key, sizeof key, "channel_%.60s", record->columns[i].name);
        const char *from = record_meta(record, key);
        printf("  %-20s %12.5g to %-12.5g from %s\n", record->columns[i].name, low, high, from != NULL ? from : "");
    }
    record_findings_print(stdout, record, findings, 1);
    return BF_OK;
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
