/* SPDX-License-Identifier: GPL-3.0-or-later */
/* board_options.h — what the commands that talk to a board have in common: --port, --baud, and their wording. */
#ifndef BEAMFIT_BOARD_OPTIONS_H
#define BEAMFIT_BOARD_OPTIONS_H

#include <stdbool.h>
#include "ground/ground.h"
#include "board/board.h"

/* In a command's table of options. */
#define BOARD_OPTIONS                                                                                                  \
    {'p',    0,    "port",                                                                                             \
     "PORT", NULL, "serial port of the board, e.g. /dev/ttyUSB0; a pseudo terminal of an emulated board"},             \
    {                                                                                                                  \
        'b', 0, "baud", "RATE", NULL, "bit/s (default 115200)"                                                         \
    }

enum { BOARD_MOST_PRESCALE = 255 };

struct board_options {
    const char *port;
    long baud; /* 0: not given */
};

/* One of BOARD_OPTIONS. BF_USAGE for any other code: it is then options_next()'s '?', which has filled err. */
enum bf_status board_take_option(int code, struct board_options *out, struct bf_error *err);
/* After parsing: is there a port? command: its name. */
enum bf_status board_check_options(const struct board_options *options, const char *command, struct bf_error *err);
enum bf_status board_open(const struct board_options *options, struct link *link, struct bf_error *err);

/*
 * Every how many samples the line carries: 1 on a pseudo terminal without --baud, which has no rate. wanted 0: the least
 * that fits. More than the line carries is BF_USAGE, with the least prescale and the rate that would do.
 */
enum bf_status board_prescale(const struct board_options *options, const struct link *link, long wanted,
                              unsigned *prescale, struct bf_error *err);

#endif
