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
/* The same, above 0 and at most `most` (INFINITY: any). */
enum bf_status options_positive(const char *what, const char *text, double most, double *out, struct bf_error *err);
/* A whole number in [least, most]. */
enum bf_status options_count(const char *what, const char *text, long least, long most, long *out,
                             struct bf_error *err);

/* After options_next() has said −1, of a command without names: BF_USAGE when a word is left over. */
enum bf_status options_only(int argc, char **argv, struct bf_error *err);

#endif
