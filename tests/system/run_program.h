/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * run_program.h — run the built program as a person would, in a directory of its own, and look at what it did.
 * The environment variable BEAMFIT names the program (tests/run sets it).
 */
#ifndef TESTS_RUN_PROGRAM_H
#define TESTS_RUN_PROGRAM_H

#include <stddef.h>

enum { PROGRAM_TEXT = 1 << 17 };

struct outcome {
    int status;             /* exit status; 128 + signal when it was killed */
    long memory_kB;         /* at its peak */
    char out[PROGRAM_TEXT]; /* standard output, cut to this size */
    char err[PROGRAM_TEXT]; /* standard error */
};

/* A new empty directory; the caller passes it to remove_directory(). Ends the test program when there is none. */
void make_directory(char path[64]);
void remove_directory(const char *path);

/* Files of a directory; all sizes in bytes. write_file ends the test program when it cannot. */
void write_file(const char *dir, const char *name, const void *bytes, size_t size);
void write_text(const char *dir, const char *name, const char *text);
int file_exists(const char *dir, const char *name);
/* 1 when the file holds exactly this text. */
int file_is(const char *dir, const char *name, const char *text);
int count_files(const char *dir);

/* Standard input is empty. arguments end with NULL; `beamfit` itself is added in front. */
void run_beamfit(const char *dir, const char *const arguments[], struct outcome *out);
/* The same, and no file may grow beyond this many bytes (a disk that takes no more). */
void run_beamfit_on_small_disk(const char *dir, long bytes, const char *const arguments[], struct outcome *out);
/* Any program of the PATH. */
void run_program(const char *dir, const char *const arguments[], struct outcome *out);

#endif
