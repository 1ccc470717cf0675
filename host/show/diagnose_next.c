/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Typed literally, these commands end at the error that the diagnosis states: the effects are added with the values that were found. */
#include "diagnose_next.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Begins a command; what is printed to the stream ends up in it. */
static FILE *begin(struct diagnose_next *next, size_t *size)
{
    next->command[next->n] = NULL;
    return open_memstream(&next->command[next->n], size);
}

static void end(struct diagnose_next *next, FILE *out)
{
    (void)fclose(out);
    next->n++;
}

/* A path as a shell takes it. */
static void put_path(FILE *out, const char *path)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-/+=:,@%";
    if (path[strspn(path, plain)] == '\0') {
        (void)fprintf(out, " %s", path);
        return;
    }
    (void)fputs(" '", out);
    for (const char *c = path; *c != '\0'; c++)
        (void)(*c == '\'' ? fputs("'\\''", out) : fputc(*c, out));
    (void)fputc('\'', out);
}

/* " hit.csv chirp.csv --check hit2.csv" */
static void put_records(FILE *out, const struct diagnosis *d, bool with_checks)
{
    for (size_t r = 0; r < d->n_records; r++)
        put_path(out, d->records[r].path);
    for (size_t r = 0; r < d->n_checks && with_checks; r++) {
        if (r == 0)
            (void)fputs(" --check", out);
        put_path(out, d->checks[r].path);
    }
}

/* " mass_kg=0.5", or " mass_kg@hit1.csv=0.5 mass_kg@hit2.csv=0.6" of one that differs from record to record. */
static void put_value(FILE *out, const struct model_effect *own, int slot)
{
    const char *name = own->effect->parameters[slot].name;
    if (!own->by_record[slot])
        (void)fprintf(out, " %s=%.7g", name, own->parameters[slot].value);
    for (size_t k = 0; own->by_record[slot] && k < own->n_per_record; k++) {
        char text[MODEL_NAME + sizeof own->per_record[k].record + 32];
        if (own->per_record[k].parameter != slot)
            continue;
        (void)snprintf(text, sizeof text, "%s@%s=%.7g", name, own->per_record[k].record, own->per_record[k].value);
        put_path(out, text);
    }
}

static void add_effect(struct diagnose_next *next, const struct hypothesis *h, size_t i, const char *from)
{
    const struct model_effect *own = &h->model.effects[h->n_base + i];
    size_t size = 0;
    FILE *out = begin(next, &size);
    if (out == NULL)
        return;
    (void)fputs("beamfit add", out);
    put_path(out, from);
    (void)fprintf(out, " %s", own->effect->id);
    if (own->channel[0] != '\0')
        (void)fprintf(out, " --channel %s", own->channel);
    for (int j = 0; j < own->effect->n_parameters; j++) {
        const struct beam_parameter_info *info = &own->effect->parameters[j];
        put_value(out, own, j);
        if (effect_parameter_is_held(info) && !own->parameters[j].fixed && !own->by_record[j])
            (void)fprintf(out, " --free %s", info->name);
        else if (!effect_parameter_is_held(info) && own->parameters[j].fixed)
            (void)fprintf(out, " --fix %s", info->name);
    }
    (void)fprintf(out, " -o added%zu.yaml", i + 1);
    end(next, out);
}

static void fit_found(struct diagnose_next *next, const struct diagnosis *d, const struct hypothesis *best,
                      const char *model)
{
    size_t size = 0;
    FILE *out = begin(next, &size);
    if (out == NULL)
        return;
    (void)fputs("beamfit fit", out);
    put_path(out, model);
    put_records(out, d, true);
    (void)fprintf(out, " -o with_%s.yaml", best->effects[0]->id);
    end(next, out);
    if (best->explains || (out = begin(next, &size)) == NULL)
        return;
    (void)fprintf(out, "beamfit diagnose with_%s.yaml", best->effects[0]->id);
    put_records(out, d, true);
    end(next, out);
}

/* The found model as a file: what is free of the rig, too, stands in it. */
static void write_found(struct diagnose_next *next, const struct diagnosis *d)
{
    size_t size = 0;
    FILE *out = begin(next, &size);
    if (out == NULL)
        return;
    (void)fputs("beamfit diagnose", out);
    put_path(out, d->model->path ? d->model->path : "MODEL");
    put_records(out, d, true);
    (void)fputs(" -o found.yaml", out);
    end(next, out);
}

static void next_of_missing(struct diagnose_next *next, const struct diagnosis *d, const char *written, bool put_right)
{
    const struct hypothesis *best = &d->hypotheses[0];
    char from[32], last[32];
    (void)snprintf(last, sizeof last, "added%zu.yaml", best->n_effects);
    if (written == NULL && (d->free_rig || put_right)) {
        write_found(next, d);
        written = "found.yaml";
    }
    for (size_t i = 0; written == NULL && i < best->n_effects; i++) {
        (void)snprintf(from, sizeof from, "added%zu.yaml", i);
        add_effect(next, best, i, i == 0 ? (d->model->path ? d->model->path : "MODEL") : from);
    }
    fit_found(next, d, best, written ? written : last);
}

/* What would explain most if it had been changed between the records. */
static void next_of_differing(struct diagnose_next *next, const struct diagnosis *d)
{
    add_effect(next, &d->by_record[0], 0, d->model->path ? d->model->path : "MODEL");
    fit_found(next, d, &d->by_record[0], "added1.yaml");
}

/* "tip_mass+sensor_lag@accel_mps2", as discriminate takes it */
static void put_rival(FILE *out, const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++) {
        const char *channel = h->model.effects[h->n_base + i].channel;
        (void)fprintf(out, "%s%s%s%s", i > 0 ? "+" : " ", h->effects[i]->id, channel[0] != '\0' ? "@" : "", channel);
    }
}

static void next_of_ambiguous(struct diagnose_next *next, const struct diagnosis *d)
{
    size_t n = 0, size = 0;
    FILE *out = begin(next, &size);
    if (out == NULL)
        return;
    (void)fputs("beamfit discriminate", out);
    put_path(out, d->model->path ? d->model->path : "MODEL");
    for (size_t i = 0; i < d->n_hypotheses && n < DISCRIMINATE_RIVALS; i++)
        if (i == 0 || d->hypotheses[i].rival) {
            put_rival(out, &d->hypotheses[i]);
            n++;
        }
    put_records(out, d, false);
    (void)fputs(" -o next.csv", out);
    end(next, out);
}

/* Their files are as they were: nothing that reads them again ends where the diagnosis did. */
static bool records_are_wrong(const struct channel_factors *factors)
{
    for (size_t i = 0; i < factors->n; i++)
        if (factors->all[i].block == NULL)
            return true;
    return false;
}

void diagnose_next(const struct diagnosis *d, const char *written, const struct channel_factors *factors,
                   struct diagnose_next *out)
{
    *out = (struct diagnose_next){0};
    if (records_are_wrong(factors))
        return;
    if (d->verdict == VERDICT_MISSING)
        next_of_missing(out, d, written, factors->n > 0);
    else if (d->verdict == VERDICT_AMBIGUOUS && factors->n == 0)
        next_of_ambiguous(out, d);
    else if (d->n_by_record > 0 && factors->n == 0)
        next_of_differing(out, d);
    else if (factors->n > 0 && written == NULL)
        write_found(out, d);
}

void diagnose_next_free(struct diagnose_next *next)
{
    for (size_t i = 0; i < next->n; i++)
        free(next->command[i]);
    *next = (struct diagnose_next){0};
}
