/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * import.h — foreign recordings made records.
 *
 *     import_read()     finds the channels of a file of any known format
 *     import_record()   makes a record of those that are chosen: names, units, time axis, the part that is kept
 *     import_free()     frees the channels
 *
 * Every byte of the file is hostile until it is checked. One file knows each format (import_format.h).
 */
#ifndef BEAMFIT_IMPORT_H
#define BEAMFIT_IMPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ground/ground.h"
#include "record/record.h"

/* FORMATS — of foreign files: UFF 58, MATLAB, LabVIEW, sound, text tables. */

struct import_format;                                                /* one of them; static, never freed */
const char *import_format_name(const struct import_format *format);  /* "uff"; "unknown" for NULL */
const struct import_format *import_format_by_name(const char *name); /* in any case; NULL when there is none */

/* "csv (text table), lvm (LabVIEW), …", cut to size: the end of a message. */
void import_format_list(size_t size, char text[]);

/* READING — the channels of a file, as the file has them. */

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
    bool over_frequency;         /* that axis is one of frequencies, in Hz */
    struct number_digits digits; /* most digits printed in text, for times; {0, 0}: binary */
};

struct import_file {
    const struct import_format *format;
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
    const struct import_format *format;
    char separator; /* between the columns of text: ',' ';' '\t' ' ' */
    char point;     /* of decimal fractions: '.' ',' */
};

/* BF_BAD_FILE: not readable, not of the format, damaged. *out needs import_free() only after BF_OK. */
enum bf_status import_read(const char *path, const struct import_reading *how, struct import_file *out,
                           struct bf_error *err);
void import_free(struct import_file *file);

/* Do its name and its unit say that the channel holds times? *factor_to_s: one of its unit in seconds. */
bool import_looks_like_time(const struct import_channel *channel, double *factor_to_s);

/* CHOOSING — what the user wants of a file, and the record made of it. */

/* Names are those of the file or of the record to be, or "#3" for the third channel. */
struct import_pick {
    const char *from; /* channel */
    const char *to;   /* column; NULL: its own name */
};
struct import_scale {
    const char *name;        /* channel or column */
    double factor;           /* or the number before the units of a sensitivity */
    const char *unit;        /* after scaling; NULL: what the column's name says */
    const char *sensitivity; /* "mV/g", "mm/s/V": the units; NULL: a factor */
};

/*
 * "1/22.5", "9.81/0.1", "100mV/g" into factor and sensitivity (which points into text). One unit of a sensitivity is electric (V, A, C):
 * the channel's; the other is the column's. BF_USAGE.
 */
enum bf_status import_scale_read(const char *text, struct import_scale *out, struct bf_error *err);

struct import_choice {
    const char *time; /* channel of times; NULL: the file's own axis, or the channel that looks like time */
    const char
        *frequency; /* channel of frequencies (Hz): the columns are of frequency responses; NULL: as the file says */
    const char *time_unit; /* "s", "ms", "us", "min"; NULL: as the file says, else seconds */
    double rate_Hz;        /* > 0: overrides any time */
    double averages;       /* > 0: behind the coherence of a frequency response */
    double window_s;       /* > 0: time constant of an exponential window on it */
    double resample_Hz;    /* > 0: times that are not uniform are brought to this rate */
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

/*
 * Two files of one run: the second's columns at the times of the first, where both have some. trigger: a column of each that has the same
 * edge after a quiet beginning; the second's times are moved so that the edges meet, and its trigger is left out. NULL: the times agree as
 * they are. "1:NAME", "2:NAME" in the choice say of which file a channel is; from, to and the excitation are the first's. Between
 * samples the second's channels are band-limited. BF_USAGE, BF_BAD_FILE.
 */
enum bf_status import_joined(const struct import_file files[2], const struct import_choice *choice,
                             const char *const trigger[2], struct record *out, struct bf_error *err);

#endif
