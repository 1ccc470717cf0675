/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_answer.h — what the names and the values of diagnose's answer share. Private to show/. */
#ifndef BEAMFIT_DIAGNOSE_ANSWER_H
#define BEAMFIT_DIAGNOSE_ANSWER_H

enum { DIAGNOSE_LISTED = 12 }; /* candidates that the text lists */

#endif
