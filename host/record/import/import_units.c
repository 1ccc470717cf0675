/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Names and units of foreign channels: what people and programs write, and what a column of a record is called. */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "import_units.h"

static const struct {
    const char *written; /* lower-case prefixes matter: "mV" is not "MV"; words are compared without case */
    struct import_unit unit;
} units[] = {
    {"V", {"V", "V", 1}},
    {"volt", {"V", "V", 1}},
    {"volts", {"V", "V", 1}},
    {"mV", {"mV", "V", 1e-3}},
    {"millivolts", {"mV", "V", 1e-3}},
    {"uV", {"uV", "V", 1e-6}},
    {"kV", {"kV", "V", 1e3}},
    {"A", {"A", "A", 1}},
    {"mA", {"mA", "A", 1e-3}},
    {"pC", {"pC", "C", 1e-12}},
    {"N", {"N", "N", 1}},
    {"newton", {"N", "N", 1}},
    {"newtons", {"N", "N", 1}},
    {"mN", {"mN", "N", 1e-3}},
    {"kN", {"kN", "N", 1e3}},
    {"lbf", {"lbf", "N", 4.4482216152605}},
    {"lb", {"lbf", "N", 4.4482216152605}},
    {"pounds", {"lbf", "N", 4.4482216152605}},
    {"Nm", {"Nm", "Nm", 1}},
    {"m/s^2", {"mps2", "mps2", 1}},
    {"m/s2", {"mps2", "mps2", 1}},
    {"m/s/s", {"mps2", "mps2", 1}},
    {"m/s**2", {"mps2", "mps2", 1}},
    {"m/(s^2)", {"mps2", "mps2", 1}},
    {"m/s\xc2\xb2", {"mps2", "mps2", 1}},
    {"m/s\xb2", {"mps2", "mps2", 1}},
    {"m_s2", {"mps2", "mps2", 1}},
    {"mps2", {"mps2", "mps2", 1}},
    {"mm/s^2", {"mmps2", "mps2", 1e-3}},
    {"mm/s2", {"mmps2", "mps2", 1e-3}},
    {"mmps2", {"mmps2", "mps2", 1e-3}},
    {"g", {"g", "mps2", 9.80665}},
    {"gn", {"g", "mps2", 9.80665}},
    {"g's", {"g", "mps2", 9.80665}},
    {"mg", {"mg", "mps2", 9.80665e-3}},
    {"m/s", {"mps", "mps", 1}},
    {"mps", {"mps", "mps", 1}},
    {"mm/s", {"mmps", "mps", 1e-3}},
    {"mmps", {"mmps", "mps", 1e-3}},
    {"in/s", {"inps", "mps", 0.0254}},
    {"m", {"m", "m", 1}},
    {"meter", {"m", "m", 1}},
    {"meters", {"m", "m", 1}},
    {"mm", {"mm", "m", 1e-3}},
    {"um", {"um", "m", 1e-6}},
    {"\xc2\xb5m", {"um", "m", 1e-6}},
    {"\xce\xbcm", {"um", "m", 1e-6}},
    {"in", {"in", "m", 0.0254}},
    {"strain", {"strain", "strain", 1}},
    {"m/m", {"strain", "strain", 1}},
    {"um/m", {"ustrain", "strain", 1e-6}},
    {"ustrain", {"ustrain", "strain", 1e-6}},
    {"microstrain", {"ustrain", "strain", 1e-6}},
    {"Pa", {"Pa", "Pa", 1}},
    {"s", {"s", "s", 1}},
    {"sec", {"s", "s", 1}},
    {"secs", {"s", "s", 1}},
    {"second", {"s", "s", 1}},
    {"seconds", {"s", "s", 1}},
    {"sekunden", {"s", "s", 1}},
    {"ms", {"ms", "s", 1e-3}},
    {"msec", {"ms", "s", 1e-3}},
    {"milliseconds", {"ms", "s", 1e-3}},
    {"us", {"us", "s", 1e-6}},
    {"usec", {"us", "s", 1e-6}},
    {"\xc2\xb5s", {"us", "s", 1e-6}},
    {"\xce\xbcs", {"us", "s", 1e-6}},
    {"microseconds", {"us", "s", 1e-6}},
    {"ns", {"ns", "s", 1e-9}},
    {"min", {"min", "s", 60}},
    {"Hz", {"Hz", "Hz", 1}},
    {"kHz", {"kHz", "Hz", 1e3}},
};
enum { UNITS = sizeof units / sizeof *units };

bool import_unit(const char *text, struct import_unit *out)
{
    for (size_t i = 0; i < UNITS && text[0] != '\0'; i++) {
        if (tolower((unsigned char)text[0]) != tolower((unsigned char)units[i].written[0]))
            continue;
        bool word = strlen(units[i].written) > 4 || strcmp(units[i].written, "volt") == 0;
        if (word ? strcasecmp(units[i].written, text) == 0 : strcmp(units[i].written, text) == 0) {
            *out = units[i].unit;
            return true;
        }
    }
    return false;
}

bool import_unit_of_name(const char *column, struct import_unit *out)
{
    for (const char *last = strrchr(column, '_'); last != NULL && last > column;) {
        if (import_unit(last + 1, out))
            return true;
        size_t n = (size_t)(last - column); /* "accel_m_s2": the unit itself has a '_' */
        last = memrchr(column, '_', n);
        if (last == NULL || strcmp(last, "_m_s2") != 0)
            return false;
    }
    return false;
}

size_t import_split_unit(const char *text, size_t n, const char **unit, size_t *unit_n)
{
    *unit = text + n;
    *unit_n = 0;
    char close = n > 0 ? text[n - 1] : '\0', open = close == ')' ? '(' : '[', copy[16];
    const char *from = close == ')' || close == ']' ? memrchr(text, open, n) : NULL;
    if (from == NULL || from == text)
        return n;
    size_t length = (size_t)(text + n - 1 - (from + 1));
    if (length == 0 || length >= sizeof copy)
        return n;
    memcpy(copy, from + 1, length);
    copy[length] = '\0';
    struct import_unit known;
    if (close == ')' && !import_unit(copy, &known))
        return n; /* "Response (Trigger)" */
    *unit = from + 1;
    *unit_n = length;
    for (n = (size_t)(from - text); n > 0 && (text[n - 1] == ' ' || text[n - 1] == '_');)
        n--;
    return n;
}

/* The letters at s as a unit. */
static bool unit_at(const char *s, const char *end, struct import_unit *unit)
{
    char word[12];
    size_t n = 0;
    while (s < end && (*s == ' ' || *s == '\t' || *s == '[' || *s == '(' || *s == ';' || *s == ','))
        s++;
    while (s < end && n < sizeof word - 1 && isalpha((unsigned char)*s))
        word[n++] = *s++;
    word[n] = '\0';
    return import_unit(word, unit);
}

/* The first number in the text, and the unit behind it or, in brackets, before it. */
static double number_and_unit(const char *text, const char *end, char point, struct import_unit *unit, bool *has_unit)
{
    double x;
    const char *s = text, *after = NULL;
    for (; s < end && after == NULL; s++)
        after = number_scan(s, end, point, &x);
    if (after == NULL)
        return 0;
    const bool comma = end - after >= 2 && *after == ',' && isdigit((unsigned char)after[1]);
    const char *longer = comma ? number_scan(s - 1, end, ',', &x) : NULL; /* the table itself may have no fractions */
    after = longer != NULL ? longer : after;
    const char *bracket = text;
    while (bracket < s && *bracket != '(' && *bracket != '[')
        bracket++;
    *has_unit = unit_at(after, end, unit) || unit_at(bracket, s, unit);
    return x;
}

/* Where the key is in the text; a short one must be a word: "offset" has no fs in it. NULL: nowhere. */
static const char *find_key(const char *text, const char *key)
{
    size_t n = strlen(key);
    const char *at = strstr(text, key);
    while (at != NULL && n <= 2 && ((at > text && isalnum((unsigned char)at[-1])) || isalnum((unsigned char)at[n])))
        at = strstr(at + 1, key);
    return at;
}

double import_rate_in_text(const char *text, size_t n, char point)
{
    static const struct {
        const char *key;
        bool interval;
    } keys[] = {{"sample rate", false},
                {"sampling rate", false},
                {"sample_rate", false},
                {"sampling_rate", false},
                {"samplerate", false},
                {"sample frequency", false},
                {"abtastrate", false},
                {"sampling frequency", false},
                {"sampling_frequency", false},
                {"sample interval", true},
                {"sampling interval", true},
                {"sample period", true},
                {"sampling period", true},
                {"sample_interval", true},
                {"delta_x", true},
                {"fs", false},
                {"dt", true}};
    char lower[256];
    size_t length = n < sizeof lower - 1 ? n : sizeof lower - 1;
    for (size_t i = 0; i < length; i++)
        lower[i] = text[i] == '\0' ? ' ' : (char)tolower((unsigned char)text[i]);
    lower[length] = '\0';
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        const char *at = find_key(lower, keys[i].key);
        if (at == NULL)
            continue;
        struct import_unit unit = {"", "", 1};
        bool has_unit = false;
        double x = number_and_unit(text + (at - lower) + strlen(keys[i].key), text + n, point, &unit, &has_unit);
        if (has_unit && strcmp(unit.SI, keys[i].interval ? "s" : "Hz") != 0)
            return 0;
        x *= has_unit ? unit.factor : 1;
        return x > 0 ? (keys[i].interval ? 1 / x : x) : 0;
    }
    return 0;
}

static void append(char *text, size_t size, const char *more)
{
    size_t n = strlen(text);
    snprintf(text + n, size - n, "%s", more);
}

char *import_column_name(const struct import_channel *channel)
{
    struct import_unit unit, own;
    size_t size = strlen(channel->name) + 40, n = 0;
    char *name = bf_alloc(size, 1);
    for (const char *c = channel->name; *c != '\0'; c++)
        if (isascii((unsigned char)*c) && isalnum((unsigned char)*c))
            name[n++] = *c;
        else if (n > 0 && name[n - 1] != '_')
            name[n++] = '_';
    while (n > 0 && name[n - 1] == '_')
        n--;
    name[n] = '\0';
    if (n == 0)
        append(name, size, "channel");
    if (strcmp(name, "time_s") == 0)
        append(name, size, "_channel");
    if (import_unit(channel->unit, &unit) && !import_unit_of_name(name, &own)) {
        append(name, size, "_");
        append(name, size, unit.suffix);
    }
    return name;
}

/* The next word of letters, digits and UTF-8 bytes in lower case; false at the end. */
static bool next_word(const char **s, char word[32])
{
    size_t n = 0;
    while (**s != '\0' && isascii((unsigned char)**s) && !isalnum((unsigned char)**s))
        ++*s;
    for (; **s != '\0' && (!isascii((unsigned char)**s) || isalnum((unsigned char)**s)); ++*s)
        if (n < 31)
            word[n++] = (char)tolower((unsigned char)**s);
    word[n] = '\0';
    return n > 0;
}

bool import_looks_like_time(const struct import_channel *channel, double *factor_to_s)
{
    static const char *const words[] = {"time", "t",       "zeit", "temps",     "tiempo", "tempo", "tid", "tijd",
                                        "sec",  "seconds", "secs", "timestamp", "times",  "ms",    "msec"};
    const char *dot = strrchr(channel->name, '.'), *s = dot != NULL ? dot + 1 : channel->name;
    char word[32], next[32];
    struct import_unit unit;
    *factor_to_s = 1;
    bool stated = channel->unit[0] != '\0', is_time = strcasecmp(channel->name, "X_Value") == 0;
    if (stated && (!import_unit(channel->unit, &unit) || strcmp(unit.SI, "s") != 0))
        return false; /* "T", "Â°C" */
    if (!next_word(&s, word))
        return false;
    if (strcmp(word, "elapsed") == 0 || strcmp(word, "relative") == 0)
        next_word(&s, word);
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        is_time |= strcmp(word, words[i]) == 0;
    bool more = next_word(&s, next), named = more && import_unit(next, &unit) && strcmp(unit.SI, "s") == 0;
    if (!is_time || (more && !named && strcmp(word, "t") == 0))
        return false;
    if (stated ? import_unit(channel->unit, &unit) : named || import_unit(word, &unit))
        *factor_to_s = unit.factor;
    return true;
}
