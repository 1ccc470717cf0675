/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Two files of one run made one record: the second's channels at the times of the first, on their common clock or on a trigger. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import_channel.h"
#include "maths/maths.h"

/* ---- Which file a choice is about ---- */

/* "2:NAME" -> 1 and NAME; -> 0 or 1; SIZE_MAX: nothing is said. */
static size_t stated_file(const char **name)
{
    const char digit = (*name)[0];
    if ((digit != '1' && digit != '2') || (*name)[1] != ':')
        return SIZE_MAX;
    *name += 2;
    return digit == '1' ? 0 : 1;
}

struct halves {
    struct import_choice choice[2];
    struct import_pick *picks[2];
    struct import_scale *scales[2];
};

static enum bf_status share_picks(const struct import_file files[2], const struct import_choice *choice,
                                  struct halves *h, struct bf_error *err)
{
    for (size_t i = 0; i < choice->n_picks; i++) {
        struct import_pick pick = choice->picks[i];
        size_t f = stated_file(&pick.from);
        if (f == SIZE_MAX)
            f = import_find_channel(&files[0], pick.from) != IMPORT_NO_AXIS ? 0 : 1;
        if (import_find_channel(&files[f], pick.from) == IMPORT_NO_AXIS)
            return import_fail_no_channel(&files[f], "--channel", pick.from, err);
        h->picks[f][h->choice[f].n_picks++] = pick;
    }
    for (size_t f = 0; f < 2 && choice->n_picks > 0; f++)
        if (h->choice[f].n_picks == 0)
            return bf_fail(err, BF_USAGE,
                           "no --channel is of %s; take one (%zu:NAME says of which file a channel is), or "
                           "import one file only",
                           files[f].path, f + 1);
    return BF_OK;
}

static bool is_of(const struct import_file *file, const struct import_choice *half, const char *name)
{
    for (size_t i = 0; i < half->n_picks; i++)
        if (half->picks[i].to != NULL && strcmp(half->picks[i].to, name) == 0)
            return true;
    return import_find_channel(file, name) != IMPORT_NO_AXIS;
}

static void share_scales(const struct import_file files[2], const struct import_choice *choice, struct halves *h)
{
    for (size_t i = 0; i < choice->n_scales; i++) {
        struct import_scale scale = choice->scales[i];
        size_t f = stated_file(&scale.name);
        if (f == SIZE_MAX)
            f = is_of(&files[0], &h->choice[0], scale.name) ? 0 : 1;
        h->scales[f][h->choice[f].n_scales++] = scale;
    }
}

static void share_time(const struct import_file files[2], const struct import_choice *choice, struct halves *h)
{
    const char *name = choice->time;
    if (name == NULL)
        return;
    const size_t f = stated_file(&name);
    for (size_t k = 0; k < 2; k++)
        h->choice[k].time =
            f == k || (f == SIZE_MAX && (k == 0 || import_find_channel(&files[1], name) != IMPORT_NO_AXIS)) ? name
                                                                                                            : NULL;
}

static enum bf_status share(const struct import_file files[2], const struct import_choice *choice, struct halves *h,
                            struct bf_error *err)
{
    for (size_t f = 0; f < 2; f++) {
        h->choice[f] = *choice;
        h->picks[f] = bf_alloc(choice->n_picks + 1, sizeof *h->picks[f]);
        h->scales[f] = bf_alloc(choice->n_scales + 1, sizeof *h->scales[f]);
        h->choice[f].picks = h->picks[f], h->choice[f].n_picks = 0;
        h->choice[f].scales = h->scales[f], h->choice[f].n_scales = 0;
    }
    h->choice[1].from_s = h->choice[1].to_s = h->choice[1].free_from_s = (double)NAN;
    h->choice[1].free_decay = h->choice[1].unknown_level = false;
    share_time(files, choice, h);
    const enum bf_status status = share_picks(files, choice, h, err);
    if (status == BF_OK)
        share_scales(files, choice, h);
    return status;
}

/* ---- The trigger ---- */

/* When the column first is half way to its largest distance from where it begins, between samples. */
static enum bf_status trigger_time(const struct record *record, const char *name, double *t_s, struct bf_error *err)
{
    enum { LEAST = 8, SHARE = 50 };
    static const double quiet = 0.25; /* of the largest distance, before the edge */
    const double *x = record_column(record, name);
    if (x == NULL)
        return bf_fail(err, BF_USAGE, "--trigger: '%.60s' is no column made of %s; take it with --channel", name,
                       record_meta(record, "source"));
    const size_t n = record->n / SHARE > LEAST ? record->n / SHARE : LEAST;
    double base = 0.0, most = 0.0, early = 0.0;
    for (size_t k = 0; k < n && k < record->n; k++)
        base += x[k] / (double)(n < record->n ? n : record->n);
    for (size_t k = 0; k < record->n; k++)
        most = fmax(most, fabs(x[k] - base));
    for (size_t k = 0; k < n && k < record->n; k++)
        early = fmax(early, fabs(x[k] - base));
    if (!(most > 0.0) || early > quiet * most)
        return bf_fail(
            err, BF_USAGE,
            "--trigger: column '%.60s' of %s has no edge after a quiet beginning; choose another channel, or "
            "cut with --from",
            name, record_meta(record, "source"));
    size_t k = 1;
    while (fabs(x[k] - base) < 0.5 * most)
        k++;
    const double before = fabs(x[k - 1] - base), after = fabs(x[k] - base);
    *t_s = record->t0_s + ((double)k - (after - 0.5 * most) / (after - before)) * record->dt_s;
    return BF_OK;
}

/* ---- The two as one ---- */

/* Samples of the first that the second covers too: [*from, *from + *n). */
static bool overlap(const struct record *a, const struct record *b, double shift_s, size_t *from, size_t *n)
{
    const double slack = 1e-6; /* of a sample */
    const double begin = ceil((b->t0_s + shift_s - a->t0_s) / a->dt_s - slack);
    const double end = floor((b->t0_s + (double)(b->n - 1) * b->dt_s + shift_s - a->t0_s) / a->dt_s + slack);
    const double low = fmax(begin, 0.0), high = fmin(end, (double)a->n - 1.0);
    if (!(high >= low + 1.0))
        return false;
    *from = (size_t)low, *n = (size_t)(high - low) + 1;
    return true;
}

/* Are the second's samples at the first's times, to a thousandth of a step? */
static bool in_step(const struct record *a, const struct record *b, double shift_s, double *offset)
{
    const double span = (double)(a->n > b->n ? a->n : b->n);
    *offset = round((a->t0_s - b->t0_s - shift_s) / b->dt_s);
    return fabs(a->dt_s / b->dt_s - 1.0) * span < 1e-3 &&
           fabs((a->t0_s - b->t0_s - shift_s) / b->dt_s - *offset) < 1e-3;
}

static void add_moved(const struct record *b, double shift_s, size_t column, struct record *out)
{
    double *t = bf_alloc(out->n, sizeof *t), *x = bf_alloc(out->n, sizeof *x), offset;
    const bool whole = in_step(out, b, shift_s, &offset);
    for (size_t k = 0; k < out->n; k++)
        t[k] = out->t0_s + (double)k * out->dt_s - shift_s;
    if (!whole)
        resample_uniform(b->columns[column].x, b->n, b->t0_s, b->dt_s, t, out->n, b->dt_s / out->dt_s, x);
    for (size_t k = 0; k < out->n && whole; k++) {
        const double from = fmin(fmax((double)k + offset, 0.0), (double)b->n - 1.0);
        x[k] = b->columns[column].x[(size_t)from];
    }
    record_add_column(out, b->columns[column].name, x);
    free(t), free(x);
}

static void add_meta_of_second(const struct record *b, struct record *out)
{
    for (size_t i = 0; i < b->n_meta; i++) {
        char key[140];
        const bool own = strncmp(b->meta[i].key, "source", 6) == 0 || strcmp(b->meta[i].key, "time_from") == 0 ||
                         strcmp(b->meta[i].key, "resampled") == 0;
        (void)snprintf(key, sizeof key, own ? "%.120s_2" : "%.120s", b->meta[i].key);
        if (record_meta(out, key) == NULL)
            record_add_meta(out, key, b->meta[i].value);
    }
}

static enum bf_status join(const struct record *a, const struct record *b, double shift_s, const char *left_out,
                           struct record *out, struct bf_error *err)
{
    size_t from, n;
    char text[300];
    double offset;
    if (!overlap(a, b, shift_s, &from, &n))
        return bf_fail(err, BF_USAGE,
                       "the two files have no time in common: %s goes from %.9g s to %.9g s, %s from %.9g s to %.9g s; "
                       "join them on a --trigger",
                       record_meta(a, "source"), a->t0_s, a->t0_s + (double)(a->n - 1) * a->dt_s,
                       record_meta(b, "source"), b->t0_s + shift_s, b->t0_s + shift_s + (double)(b->n - 1) * b->dt_s);
    *out = (struct record){.n = n, .dt_s = a->dt_s, .t0_s = a->t0_s + (double)from * a->dt_s};
    for (size_t i = 0; i < a->n_columns; i++)
        record_add_column(out, a->columns[i].name, a->columns[i].x + from);
    for (size_t i = 0; i < b->n_columns; i++) {
        if (left_out != NULL && strcmp(b->columns[i].name, left_out) == 0)
            continue;
        if (record_column(a, b->columns[i].name) != NULL)
            return bf_fail(err, BF_USAGE, "both files would give column '%.60s'; rename one with --channel 2:%.60s=NEW",
                           b->columns[i].name, b->columns[i].name);
        add_moved(b, shift_s, i, out);
    }
    for (size_t i = 0; i < a->n_meta; i++)
        record_add_meta(out, a->meta[i].key, a->meta[i].value);
    char how[80] = "on their times";
    if (left_out != NULL)
        (void)snprintf(how, sizeof how, "on a trigger, which is known to some %.2g s", 0.5 * fmax(a->dt_s, b->dt_s));
    (void)snprintf(text, sizeof text, "%s; the second file's times moved by %.9g s, %s", how, shift_s,
                   in_step(out, b, shift_s, &offset) ? "sample by sample" : "band-limited between its samples");
    record_add_meta(out, "joined", text);
    add_meta_of_second(b, out);
    return BF_OK;
}

static enum bf_status join_files(const struct import_file files[2], const struct halves *h,
                                 const char *const trigger[2], struct record half[2], struct record *out,
                                 struct bf_error *err)
{
    double t_s[2] = {0.0, 0.0};
    for (size_t f = 0; f < 2; f++)
        if (import_record(&files[f], &h->choice[f], &half[f], err) != BF_OK)
            return err->status;
    for (size_t f = 0; f < 2 && trigger != NULL; f++)
        if (trigger_time(&half[f], trigger[f], &t_s[f], err) != BF_OK)
            return err->status;
    return join(&half[0], &half[1], t_s[0] - t_s[1], trigger != NULL ? trigger[1] : NULL, out, err);
}

enum bf_status import_joined(const struct import_file files[2], const struct import_choice *choice,
                             const char *const trigger[2], struct record *out, struct bf_error *err)
{
    struct halves h = {0};
    struct record half[2] = {{0}, {0}};
    memset(out, 0, sizeof *out);
    enum bf_status status = share(files, choice, &h, err);
    if (status == BF_OK)
        status = join_files(files, &h, trigger, half, out, err);
    for (size_t f = 0; f < 2; f++) {
        free(h.picks[f]), free(h.scales[f]);
        record_free(&half[f]);
    }
    if (status != BF_OK)
        record_free(out);
    return status;
}
