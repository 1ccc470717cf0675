/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_channel.h — the channels of a foreign file: how a reader adds them, and how they are found by name. */
#ifndef BEAMFIT_IMPORT_CHANNEL_H
#define BEAMFIT_IMPORT_CHANNEL_H

#include "import.h"

enum { IMPORT_SHOWN = 60 }; /* characters of a name in a message */

/* A new last channel, with name[name_n] made printable and unique; x (owned, malloc) may be NULL. */
struct import_channel *import_add(struct import_file *file, const char *name, size_t name_n, double *x, size_t n);
void import_set_text(char **text, const char *s, size_t n); /* trims blanks, makes printable */
void import_add_meta(struct import_file *file, const char *key, const char *value, size_t value_n);
void import_set_rate(struct import_file *file, double rate_Hz, const char *from); /* the first one stays */

/* By the name in the file, by the column's name to be, or "#3". IMPORT_NO_AXIS when there is none. */
size_t import_find_channel(const struct import_file *file, const char *name);
enum bf_status import_fail_no_channel(const struct import_file *file, const char *option, const char *name,
                                      struct bf_error *err);
bool import_is_axis(const struct import_file *file, size_t channel); /* of another channel */
long import_line_of(const struct import_file *file, size_t sample);  /* 0: unknown */

#endif
