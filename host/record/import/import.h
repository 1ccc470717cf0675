/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import.h — foreign recordings made records. */
#ifndef BEAMFIT_IMPORT_H
#define BEAMFIT_IMPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ground/ground.h"
#include "record/record.h"

/*
 * IMPORT — foreign recordings. Two steps: import_read() finds the channels of a file of any known kind, and
 * import_record() makes a record of the chosen ones. Every byte of the file is hostile until checked.
 *
 * One file knows each kind: import_uff.c, import_mat.c, import_lvm.c, import_wav.c, import_csv.c.
 */

enum import_format { IMPORT_UNKNOWN, IMPORT_UFF, IMPORT_MAT, IMPORT_LVM, IMPORT_WAV, IMPORT_CSV };

#define IMPORT_NO_AXIS SIZE_MAX

struct import_channel {
    char *name;           /* as the file has it, or "channel_1" */
    char *unit;           /* as the file states it; "" when it does not */
    char *about;          /* what else the file says of it, one line; "" */
    const char *unusable; /* why it cannot become a column (a spectrum, say); NULL: it can */
    size_t n;
    double *x;                   /* [n]; NaN where the file has no value */
    size_t axis;                 /* the channel that holds its times, IMPORT_NO_AXIS: none */
    double t0_s, dt_s;           /* the axis the file states; dt_s 0: none */
    struct number_digits digits; /* most digits printed in text, for times; {0, 0}: binary */
};

struct import_file {
    enum import_format format;
    const char *path; /* the caller's */
    char sha256[65];
    size_t n_bytes; /* of a MATLAB file */
    size_t n_channels;
    struct import_channel *channels;
    bool has_names;  /* the file names its channels */
    double rate_Hz;  /* sampling rate that the file states for all channels; 0: none */
    char *rate_from; /* where it states it: "line 3", "variable 'Fs'" */
    size_t n_lines;
    long *lines; /* [n_lines] line of each sample in a text file; else none */
    size_t n_meta;
    struct record_meta *meta; /* what the file says of itself */
};

/* How to read a file whose form cannot be seen in it. Zeros: find out. */
struct import_reading {
    enum import_format format;
    char separator; /* between the columns of text: ',' ';' '\t' ' ' */
    char point;     /* of decimal fractions: '.' ',' */
};

/* BF_BAD_FILE: not readable, not of the kind, damaged. *out needs import_free() only after BF_OK. */
enum bf_status import_read(const char *path, const struct import_reading *how, struct import_file *out,
                           struct bf_error *err);
void import_free(struct import_file *file);
const char *import_format_name(enum import_format format);
enum import_format import_format_by_name(const char *name); /* IMPORT_UNKNOWN when there is none */

/* What the user wants of a file. Names are those of the file or of the record to be, or "#3" for the third channel. */
struct import_pick {
    const char *from; /* channel */
    const char *to;   /* column; NULL: its own name */
};
struct import_scale {
    const char *name; /* channel or column */
    double factor;
    const char *unit; /* after scaling; NULL: what the column's name says */
};
struct import_choice {
    const char *time;      /* channel of times; NULL: the file's own axis, or the channel that looks like time */
    const char *time_unit; /* "s", "ms", "us", "min"; NULL: as the file says, else seconds */
    double rate_Hz;        /* > 0: overrides any time */
    double from_s, to_s;   /* NaN: from the start, to the end; both ends included */
    size_t n_picks;
    const struct import_pick *picks; /* none: every channel */
    size_t n_scales;
    const struct import_scale *scales;
    bool free_decay, unknown_level;
    double free_from_s;  /* NaN: not given */
    const char *command; /* for the metadata; NULL: "beamfit import" */
};

/* BF_USAGE: a choice that the file cannot satisfy; BF_BAD_FILE: the chosen data are no record. */
enum bf_status import_record(const struct import_file *file, const struct import_choice *choice, struct record *out,
                             struct bf_error *err);

/* "Sampling rate: 2.5 kHz", "Sample interval;0.4 ms" in a line of text; 0 when it says no such thing. */
double import_rate_in_text(const char *text, size_t n, char point);
bool import_looks_like_time(const struct import_channel *channel, double *factor_to_s);

#endif
