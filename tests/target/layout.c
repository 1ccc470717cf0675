/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sizes of these arrays say where things lie: read with nm by tests/target/board.py. */
#include "app.h"

extern char layout_live_offset[];
char layout_live_offset[offsetof(struct app, latest)];
