/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "board_give.h"

enum bf_status board_check_image(const char *name, const struct beam_image_file *image,
                                 const struct target_controller *board, struct bf_error *err)
{
    const enum beam_image_fault fault = target_image_check(image, board);
    if (fault == BEAM_IMAGE_FINE)
        return BF_OK;
    return bf_fail_at(err, name, 0, "the board would refuse this image: %s", beam_image_fault_text(fault));
}

enum bf_status board_give(struct link *link, const struct device_key *key, const char *key_path,
                          const struct device_key *signing, const char *name, bool sign, struct beam_image_file *image,
                          struct link_download *done, struct bf_error *err)
{
    if (sign) {
        const uint32_t seen = link->info.stored > link->info.counter ? link->info.stored : link->info.counter;
        if (seen == UINT32_MAX)
            return bf_fail(err, BF_DEVICE, "%s: the board's counter is at its end; it takes no further model",
                           port_path(link->port));
        target_image_sign(image, signing, link->info.device, seen + 1);
    }
    const struct target_controller board = {.key = signing,
                                            .device = link->info.device,
                                            .stored = -1,
                                            .sample_Hz = 1e-3 * (double)link->info.sample_mHz,
                                            .core_Hz = (double)link->info.core_Hz};
    if (board_check_image(name, image, &board, err) != BF_OK || link_unlock(link, key, key_path, err) != BF_OK ||
        link_download(link, image, done, err) != BF_OK)
        return err->status;
    return BF_OK;
}
