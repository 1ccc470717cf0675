/* SPDX-License-Identifier: GPL-3.0-or-later */
/* options.h — what the commands' use of getopt_long has in common: one wording of mistakes. */
#ifndef BEAMFIT_OPTIONS_H
#define BEAMFIT_OPTIONS_H

#include <getopt.h>
#include "error.h"

/*
 * getopt_long() without its own messages; short_options begin with ':'. −1 at the end of the options. A mistake ('?' or
 * ':' of getopt) fills err and returns '?': then return BF_USAGE.
 */
int options_next(int argc, char **argv, const char *short_options, const struct option *long_options,
                 struct bf_error *err);

/* A finite number, else BF_USAGE with a message that names `what`. */
enum bf_status options_number(const char *what, const char *text, double *out, struct bf_error *err);

#endif
