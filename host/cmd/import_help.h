/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_help.h — what `beamfit import --help` prints */
#ifndef BEAMFIT_IMPORT_HELP_H
#define BEAMFIT_IMPORT_HELP_H

extern const char import_help[];

#endif
