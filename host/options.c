/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "options.h"

#include <math.h>

#include "decimal.h"

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
