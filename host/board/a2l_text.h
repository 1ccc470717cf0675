/* SPDX-License-Identifier: GPL-3.0-or-later */
/* a2l_text.h — the fixed text of an A2L file: its meta language for XCP (ASAM MCD-1 XCP 1.1) and the line's settings. */
#ifndef BEAMFIT_A2L_TEXT_H
#define BEAMFIT_A2L_TEXT_H

extern const char *const a2l_head[]; /* pieces, NULL after the last */
/* Formats: address, bytes. */
extern const char a2l_segment[];
/* Formats: MAX_CTO, MAX_DTO, lists, events, entry bytes, lists of the event, its cycle and the cycle's unit. */
extern const char a2l_protocol[];

#endif
