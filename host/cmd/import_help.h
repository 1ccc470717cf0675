/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_help.h — the options of `beamfit import`, and what --help prints around them */
#ifndef BEAMFIT_IMPORT_HELP_H
#define BEAMFIT_IMPORT_HELP_H

#include "ground/ground.h"

enum option_code {
    OPTION_LIST = 256,
    OPTION_CHANNEL,
    OPTION_TIME,
    OPTION_TIME_UNIT,
    OPTION_RATE,
    OPTION_FREQUENCY,
    OPTION_AVERAGES,
    OPTION_WINDOW,
    OPTION_SCALE,
    OPTION_RESAMPLE,
    OPTION_TRIGGER,
    OPTION_GATE,
    OPTION_FROM,
    OPTION_TO,
    OPTION_FREE_DECAY,
    OPTION_FREE_FROM,
    OPTION_UNKNOWN_LEVEL,
    OPTION_DIGITS,
    OPTION_FORMAT,
    OPTION_SEPARATOR,
    OPTION_DECIMAL
};

extern const char import_about[], import_closing[];
extern const struct option_row import_options[];

#endif
