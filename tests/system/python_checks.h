/* SPDX-License-Identifier: GPL-3.0-or-later */
/* python_checks.h — checks that are functions of a script of this folder, each called in a rig's directory. */
#ifndef TESTS_PYTHON_CHECKS_H
#define TESTS_PYTHON_CHECKS_H

/* Runs `script name`; status 77 skips the test aloud, any other but 0 fails it with what the script said. */
void python_check(void **state, const char *script, const char *name);

#endif
