/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ground.h"

#include <math.h>
#include <stdlib.h>

int options_next(int argc, char **argv, const char *short_options, const struct option *long_options,
                 struct bf_error *err)
{
    opterr = 0;
    int code = getopt_long(argc, argv, short_options, long_options, NULL);
    if (code == ':')
        (void)bf_fail(err, BF_USAGE, "option '%s' needs a value; see 'beamfit %s --help'", argv[optind - 1], argv[0]);
    else if (code == '?' && optopt && (optopt < 128) && argv[optind - 1][1] != '-')
        (void)bf_fail(err, BF_USAGE, "no such option '-%c'; see 'beamfit %s --help'", optopt, argv[0]);
    else if (code == '?')
        (void)bf_fail(err, BF_USAGE, "no such option '%s'; see 'beamfit %s --help'", argv[optind - 1], argv[0]);
    return code == ':' ? '?' : code;
}

enum bf_status options_number(const char *what, const char *text, double *out, struct bf_error *err)
{
    if (decimal_parse(text, out) && isfinite(*out))
        return BF_OK;
    return bf_fail(err, BF_USAGE, "%s '%.60s' is not a number; write e.g. 0.05 or 1e-3", what, text);
}

enum bf_status options_positive(const char *what, const char *text, double most, double *out, struct bf_error *err)
{
    if (options_number(what, text, out, err) != BF_OK)
        return BF_USAGE;
    if (*out > 0.0 && *out <= most)
        return BF_OK;
    return isfinite(most) ? bf_fail(err, BF_USAGE, "%s '%.60s': give a number above 0, at most %g", what, text, most)
                          : bf_fail(err, BF_USAGE, "%s '%.60s': give a number above 0", what, text);
}

enum bf_status options_count(const char *what, const char *text, long least, long most, long *out, struct bf_error *err)
{
    char *end;
    *out = strtol(text, &end, 10);
    if (end == text || *end != '\0' || *out < least || *out > most)
        return bf_fail(err, BF_USAGE, "%s '%.60s': give a whole number from %ld to %ld", what, text, least, most);
    return BF_OK;
}

enum bf_status options_only(int argc, char **argv, struct bf_error *err)
{
    if (optind >= argc)
        return BF_OK;
    return bf_fail(err, BF_USAGE, "'%.60s': %s takes options only; see 'beamfit %s --help'", argv[optind], argv[0],
                   argv[0]);
}
