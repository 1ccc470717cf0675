/* SPDX-License-Identifier: GPL-3.0-or-later */
/* link.h — the memory of a board: what download and drive need beside the functions of board.h. */
#ifndef BEAMFIT_LINK_H
#define BEAMFIT_LINK_H

#include "board.h"

/* what: for messages, "writing the drive". */
enum bf_status link_write(struct link *link, const char *what, uint32_t address, size_t n, const void *bytes,
                          struct bf_error *err);

/* CRC-32 that the board takes of its memory. */
enum bf_status link_crc(struct link *link, uint32_t address, size_t n, uint32_t *crc, struct bf_error *err);

/* Which page BEAM_WIRE_IMAGE shows: BEAM_WIRE_PAGE_ACTIVE or _STAGING. */
enum bf_status link_show_page(struct link *link, int page, struct bf_error *err);

#endif
