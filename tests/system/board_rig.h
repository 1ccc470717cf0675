/* SPDX-License-Identifier: GPL-3.0-or-later */
/* board_rig.h — a running board, its key, and images of two models for it. Include after cmocka.h. */
#ifndef TESTS_BOARD_RIG_H
#define TESTS_BOARD_RIG_H

#include "board.h"

struct board_rig {
    char dir[64]; /* holds key, wrong_key, model.yaml (drive_V to piezo_V), a.img, b.img: unsigned */
    struct board board;
    struct line line;
    struct outcome outcome;
};

/* Setup and teardown of cmocka; the board starts with an empty store in dir/nvm. */
int board_rig_setup(void **state);
int board_rig_teardown(void **state);

/* beamfit with --port PORT behind these arguments (NULL at the end), which may be followed by --key key. */
void board_run(struct board_rig *rig, const char *port, const char *const arguments[]);
/* As above, and the program's status must be this; its output is shown if not. */
void board_run_expect(struct board_rig *rig, const char *port, int status, const char *const arguments[]);

/* A number of the last answer, a JSON object; the test fails when there is none. */
double board_answer(const struct board_rig *rig, const char *key);
/* Is it this text? */
int board_answer_is(const struct board_rig *rig, const char *key, const char *text);

/* What runs on the board, read around any bad line: "built in", or the SHA-256 of the model's file and its counter. */
struct board_model {
    int downloaded;
    double counter, stored;
    char sha256[65];
};
struct board_model board_ask(struct board_rig *rig);

#endif
