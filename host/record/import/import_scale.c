/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Scales as people write them: numbers, arithmetic ("9.81/0.1"), and sensitivities with units ("100mV/g", "5 mm/s/V"). */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "import_channel.h"
#include "import_scale.h"
#include "import_units.h"

enum { DEEPEST = 32 }; /* brackets */

/* ---- Arithmetic: + − * / and brackets, from left to right ---- */

struct reader {
    const char *at, *end;
    int depth;
    size_t operators;
    bool bad;
};

static void blanks(struct reader *r)
{
    while (r->at < r->end && (*r->at == ' ' || *r->at == '\t'))
        r->at++;
}

/* Is the next character one of these? Then it is taken. */
static char take(struct reader *r, const char *wanted)
{
    blanks(r);
    return r->at < r->end && *r->at != '\0' && strchr(wanted, *r->at) != NULL ? *r->at++ : '\0';
}

static double sum(struct reader *r);

static double term(struct reader *r)
{
    double x = 0.0;
    if (take(r, "(") != '\0') {
        x = ++r->depth < DEEPEST ? sum(r) : (double)NAN;
        r->depth--;
        r->bad = r->bad || take(r, ")") == '\0';
        return x;
    }
    blanks(r);
    const char *after = number_scan(r->at, r->end, '.', &x);
    r->bad = r->bad || after == NULL || r->depth >= DEEPEST;
    r->at = after != NULL ? after : r->end;
    return x;
}

static double product(struct reader *r)
{
    double x = term(r);
    for (char c; !r->bad && (c = take(r, "*/")) != '\0'; r->operators++)
        x = c == '*' ? x * term(r) : x / term(r);
    return x;
}

static double sum(struct reader *r)
{
    double x = product(r);
    for (char c; !r->bad && (c = take(r, "+-")) != '\0'; r->operators++)
        x = c == '+' ? x + product(r) : x - product(r);
    return x;
}

/* ---- Units ---- */

/* [from, to) as a unit, without blanks and brackets around it; false: it is none. */
static bool unit_between(const char *from, const char *to, struct import_unit *out)
{
    char text[24];
    while (from < to && (*from == ' ' || *from == '('))
        from++;
    while (to > from && (to[-1] == ' ' || (to[-1] == ')' && memchr(from, '(', (size_t)(to - from)) == NULL)))
        to--;
    const size_t n = (size_t)(to - from);
    if (n == 0 || n >= sizeof text)
        return false;
    memcpy(text, from, n);
    text[n] = '\0';
    return import_unit(text, out);
}

/* "mV/g", "mm/s/V", "mV/(m/s^2)": the stroke between two units. */
static bool split_units(const char *text, struct import_unit *over, struct import_unit *under)
{
    const char *end = text + strlen(text);
    for (const char *c = strchr(text, '/'); c != NULL; c = strchr(c + 1, '/'))
        if (unit_between(text, c, over) && unit_between(c + 1, end, under))
            return true;
    return false;
}

static bool electric(const struct import_unit *unit)
{
    return strcmp(unit->SI, "V") == 0 || strcmp(unit->SI, "A") == 0 || strcmp(unit->SI, "C") == 0;
}

enum bf_status import_scale_read(const char *text, struct import_scale *out, struct bf_error *err)
{
    struct import_unit over, under;
    struct reader r = {.at = text, .end = text + strlen(text)};
    out->factor = sum(&r);
    out->sensitivity = NULL;
    blanks(&r);
    if (r.bad || !isfinite(out->factor))
        return bf_fail(err, BF_USAGE,
                       "--scale '%.60s' is not a number; write e.g. 9.80665, 1/22.5, 9.81/0.1, or a sensitivity "
                       "such as 100mV/g",
                       text);
    if (out->factor == 0)
        return bf_fail(err, BF_USAGE, "--scale %.60s: a factor of 0 leaves nothing", text);
    if (r.at == r.end)
        return BF_OK;
    if (!split_units(r.at, &over, &under))
        return bf_fail(err, BF_USAGE,
                       "--scale %.60s: '%.30s' is no quotient of two units; write e.g. 100mV/g, 10.2mV/(m/s^2), "
                       "22.5mV/N, 5mm/s/V",
                       text, r.at);
    if (r.operators > 0)
        return bf_fail(err, BF_USAGE, "--scale %.60s: give one number before the units of a sensitivity", text);
    if (!(out->factor > 0))
        return bf_fail(err, BF_USAGE,
                       "--scale %.60s: a sensitivity is positive; a channel that points the other way is said in the "
                       "model (gain: -1)",
                       text);
    if (strcmp(over.SI, under.SI) == 0 || electric(&over) == electric(&under))
        return bf_fail(err, BF_USAGE,
                       "--scale %.60s: one of the two units must be of the cable (V, mV, pC ...), the other of what "
                       "is measured",
                       text);
    out->sensitivity = r.at;
    return BF_OK;
}

/* ---- For a channel ---- */

/* The unit of the channel's numbers: what the file states, else what goes through a cable. */
static enum bf_status unit_of_channel(const struct import_file *file, const struct import_channel *channel,
                                      const struct import_unit *cable, struct import_unit *out, struct bf_error *err)
{
    if (strcmp(import_format_name(file->format), "wav") == 0)
        return bf_fail(err, BF_USAGE,
                       "%s holds fractions of full scale, to which no sensitivity applies; give the factor instead: "
                       "full scale in V over V per unit, e.g. 2.5/0.1*9.80665",
                       file->path);
    if (channel->unit[0] == '\0') {
        const bool charge = strcmp(cable->SI, "C") == 0;
        *out = charge ? *cable : (struct import_unit){cable->SI, cable->SI, 1};
        bf_warn("%s: the unit of channel '%.*s' is not stated; its numbers are taken as %s", file->path, IMPORT_SHOWN,
                channel->name, charge ? cable->suffix : cable->SI);
        return BF_OK;
    }
    if (import_unit(channel->unit, out) && strcmp(out->SI, cable->SI) == 0)
        return BF_OK;
    return bf_fail(err, BF_USAGE,
                   "--scale: channel '%.*s' of %s is in '%.20s', not in %s: the sensitivity is in its numbers already, "
                   "or it is another channel",
                   IMPORT_SHOWN, channel->name, file->path, channel->unit, cable->SI);
}

enum bf_status import_scale_factor(const struct import_scale *scale, const struct import_file *file,
                                   const struct import_channel *channel, const char *column, double *factor,
                                   const char **unit, struct bf_error *err)
{
    struct import_unit over, under, own, name;
    const bool named = import_unit_of_name(column, &name);
    *factor = scale->factor;
    *unit = scale->unit != NULL ? scale->unit : named ? name.suffix : "";
    if (scale->sensitivity == NULL || !split_units(scale->sensitivity, &over, &under))
        return BF_OK;
    const struct import_unit *cable = electric(&over) ? &over : &under, *measured = electric(&over) ? &under : &over;
    if (unit_of_channel(file, channel, cable, &own, err) != BF_OK)
        return err->status;
    if (named && strcmp(name.SI, measured->SI) != 0)
        return bf_fail(err, BF_USAGE,
                       "--scale: column '%.*s' is in %s by its name, and the sensitivity is one of %s; rename the "
                       "column, or check the data sheet",
                       IMPORT_SHOWN, column, name.suffix, measured->suffix);
    const double cable_per_measured =
        electric(&over) ? scale->factor * over.factor / under.factor : under.factor / (scale->factor * over.factor);
    *factor = own.factor / cable_per_measured / (named ? name.factor : 1.0);
    *unit = named ? name.suffix : measured->SI;
    return BF_OK;
}
