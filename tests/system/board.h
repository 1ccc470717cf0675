/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * board.h — board_host as a person would start it, and a bad line between it and the program: noise, cut cables, a rate.
 * board_host is looked for beside the program that BEAMFIT names.
 */
#ifndef TESTS_BOARD_H
#define TESTS_BOARD_H

#include <sys/types.h>
#include "run_program.h"

struct board {
    pid_t process;
    char port[64];
};

/* Starts it in dir with these further arguments (NULL at the end) and waits until it is ready; ends the test if it is not. */
void board_start(struct board *board, const char *dir, const char *const arguments[]);
/* SIGTERM, and waits. Does nothing when it was stopped. */
void board_stop(struct board *board);
/* SIGKILL, as a power cut. */
void board_kill(struct board *board);

/* A key file of mode 0600 with these 32 bytes. */
void write_key(const char *dir, const char *name, const char bytes[32]);

struct line_faults {
    double noise;   /* of a byte: flipped, lost or doubled */
    long cut_after; /* bytes in both directions until the cable is cut: silence; 0: never */
    int unplug;     /* 1: the port vanishes then, as with a USB adapter */
    long baud;      /* 0: as fast as it goes */
    unsigned seed;
};

/* A second port whose bytes go to and from `port`. */
struct line {
    pid_t process;
    char port[64];
    int counts; /* the number of bytes passed comes here when it is stopped */
};
void line_start(struct line *line, const char *port, const struct line_faults *faults);
/* Returns the bytes passed in both directions, damaged ones included. */
long line_stop(struct line *line);

#endif
