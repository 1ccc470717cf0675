/* SPDX-License-Identifier: GPL-3.0-or-later */
/* ask.h — runs commands in a rig's directory and looks at what they say; a test ends where they say something else. */
#ifndef TESTS_ASK_H
#define TESTS_ASK_H

#include <jansson.h>
#include "rig.h"

/* `beamfit arguments…` ends with this status. What it printed: on standard output for status 0, else on standard error; valid until the next run. */
const char *ran(struct rig *rig, int status, const char *const arguments[]);
#define RAN(rig, status, ...) ran(rig, status, (const char *[]){__VA_ARGS__, NULL})

/* The answer of `beamfit arguments… --json`, an object; the caller frees it. */
json_t *answer(struct rig *rig, const char *const arguments[]);
#define ANSWER(rig, ...) answer(rig, (const char *[]){__VA_ARGS__, NULL})

void says(const char *text, const char *part);

/* A script of bash ends with status 0. */
void must(struct rig *rig, const char *script);

#endif
