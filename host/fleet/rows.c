/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The tables of RESULTS, and their rows as bytes: table, then each value as its kind and its bytes. */
#include "fleet.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name, *kinds, *columns;
} tables[FLEET_TABLES] = {
    [FLEET_UNITS] = {"units", "tttinnnnitt",
                     "identity TEXT, status TEXT, reason TEXT, converged INTEGER, nrmse REAL, noise_ratio REAL, "
                     "check_nrmse REAL, check_noise_ratio REAL, evaluations INTEGER, version TEXT, settings TEXT"},
    [FLEET_INPUTS] = {"inputs", "ttt", "role TEXT, file TEXT, sha256 TEXT"},
    [FLEET_PARAMETERS] = {"parameters", "tttnnnniiii",
                          "stage TEXT, name TEXT, si_unit TEXT, value REAL, sd REAL, ci95_low REAL, ci95_high REAL, "
                          "estimated INTEGER, identifiable INTEGER, at_bound INTEGER, logarithmic INTEGER"},
    [FLEET_COVARIANCES] = {"covariances", "ttn", "a TEXT, b TEXT, covariance REAL"},
    [FLEET_ERRORS] = {"errors", "titinnn",
                      "file TEXT, held_out INTEGER, channel TEXT, samples INTEGER, noise REAL, nrmse REAL, "
                      "noise_ratio REAL"},
    [FLEET_VERDICTS] = {"verdicts", "tnnnnnnnt",
                        "verdict TEXT, probability REAL, explained REAL, nrmse_before REAL, nrmse_after REAL, "
                        "noise_ratio_before REAL, noise_ratio_after REAL, check_nrmse_after REAL, text TEXT"},
    [FLEET_EFFECTS] = {"effects", "itttnnt",
                       "among INTEGER, effect TEXT, channel TEXT, parameter TEXT, value REAL, sd REAL, si_unit TEXT"},
    [FLEET_MODELS] = {"models", "tt", "stage TEXT, text TEXT"},
    [FLEET_WARNINGS] = {"warnings", "t", "text TEXT"},
    [FLEET_BOARDS] = {"boards", "tttnitt",
                      "status TEXT, place TEXT, device TEXT, counter REAL, stored INTEGER, model_sha256 TEXT, "
                      "reason TEXT"},
    [FLEET_RUNS] = {"runs", "nnnt", "seconds REAL, processor_seconds REAL, peak_MiB REAL, host TEXT"},
};

const char *fleet_table_name(enum fleet_table table)
{
    return tables[table].name;
}

const char *fleet_table_kinds(enum fleet_table table)
{
    return tables[table].kinds;
}

const char *fleet_table_sql(enum fleet_table table)
{
    return tables[table].columns;
}

static void append(struct fleet_rows *rows, const void *bytes, size_t n)
{
    rows->bytes = bf_grow(rows->bytes, rows->n + n, 1);
    memcpy(rows->bytes + rows->n, bytes, n);
    rows->n += n;
}

static void append_text(struct fleet_rows *rows, const char *text)
{
    append(rows, text != NULL ? "t" : "\0", 1);
    if (text != NULL)
        append(rows, text, strlen(text) + 1);
}

static void append_number(struct fleet_rows *rows, char kind, double number)
{
    append(rows, isfinite(number) ? &kind : "\0", 1);
    if (isfinite(number))
        append(rows, &number, sizeof number);
}

void fleet_row(struct fleet_rows *rows, enum fleet_table table, ...)
{
    const unsigned char which = (unsigned char)table;
    va_list values;
    append(rows, &which, 1);
    va_start(values, table);
    for (const char *kind = tables[table].kinds; *kind != '\0'; kind++) {
        if (*kind == 't')
            append_text(rows, va_arg(values, const char *));
        else if (*kind == 'i')
            append_number(rows, 'i', (double)va_arg(values, int));
        else
            append_number(rows, 'n', va_arg(values, double));
    }
    va_end(values);
}

void fleet_rows_free(struct fleet_rows *rows)
{
    free(rows->bytes);
    *rows = (struct fleet_rows){0};
}

static bool take(const unsigned char bytes[], size_t n, size_t *at, struct fleet_value *value)
{
    *value = (struct fleet_value){.number = nan(""), .text = ""};
    if (*at >= n)
        return false;
    value->kind = (char)bytes[(*at)++];
    if (value->kind == '\0')
        return true;
    if (value->kind == 't') {
        const unsigned char *end = memchr(bytes + *at, '\0', n - *at);
        value->text = (const char *)bytes + *at;
        *at = end != NULL ? (size_t)(end - bytes) + 1 : n;
        return end != NULL;
    }
    if (n - *at < sizeof value->number || (value->kind != 'n' && value->kind != 'i'))
        return false;
    memcpy(&value->number, bytes + *at, sizeof value->number);
    *at += sizeof value->number;
    return true;
}

bool fleet_rows_next(const unsigned char bytes[], size_t n, size_t *at, enum fleet_table *table,
                     struct fleet_value values[FLEET_COLUMNS])
{
    *table = FLEET_UNITS;
    if (*at >= n)
        return false;
    const unsigned char which = bytes[(*at)++];
    *table = which < FLEET_TABLES ? (enum fleet_table)which : FLEET_TABLES;
    bool whole = which < FLEET_TABLES;
    for (size_t k = 0; whole && tables[which].kinds[k] != '\0'; k++)
        whole = take(bytes, n, at, &values[k]) && (values[k].kind == '\0' || values[k].kind == tables[which].kinds[k]);
    if (!whole)
        *table = FLEET_TABLES;
    return whole;
}

void fleet_failed(struct fleet_rows *rows, const char *identity, const char *status, const char *reason)
{
    const double none = nan("");
    fleet_row(rows, FLEET_UNITS, identity, status, reason, 0, none, none, none, none, 0, BEAMFIT_VERSION, NULL);
}
