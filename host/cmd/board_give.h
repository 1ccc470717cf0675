/* SPDX-License-Identifier: GPL-3.0-or-later */
/* board_give.h — an image to a board, as `download` and `fleet download` do it. */
#ifndef BEAMFIT_BOARD_GIVE_H
#define BEAMFIT_BOARD_GIVE_H

#include "board/board.h"

/* What a board would say of it, said before anything is sent; name: for messages. The counter is judged where the board's is known. */
enum bf_status board_check_image(const char *name, const struct beam_image_file *image,
                                 const struct target_controller *board, struct bf_error *err);

/*
 * Signs it for this board with the next counter where `sign`, checks it, unlocks the board, and makes it the running model. key unlocks; signing signs
 * and judges the code of a signed image, which may be the same; NULL: the board judges that, and `sign` is false.
 */
enum bf_status board_give(struct link *link, const struct device_key *key, const char *key_path,
                          const struct device_key *signing, const char *name, bool sign, struct beam_image_file *image,
                          struct link_download *done, struct bf_error *err);

#endif
