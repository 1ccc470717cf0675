/* SPDX-License-Identifier: GPL-3.0-or-later */
/* link.h — private to board/: what its files share of link. */
#ifndef BEAMFIT_LINK_PRIVATE_H
#define BEAMFIT_LINK_PRIVATE_H

#include "board.h"

/* CRC-32 that the board takes of its memory. */
enum bf_status link_crc(struct link *link, uint32_t address, size_t n, uint32_t *crc, struct bf_error *err);

/* Which page BEAM_WIRE_IMAGE shows: BEAM_WIRE_PAGE_ACTIVE or _STAGING. */
enum bf_status link_show_page(struct link *link, int page, struct bf_error *err);

#endif
