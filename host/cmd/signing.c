/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "signing.h"

#include <stdlib.h>

enum bf_status signing_take_device(struct signing *signing, const char *text, struct bf_error *err)
{
    signing->has_device = true;
    return device_id_read(text, signing->device, err);
}

enum bf_status signing_take_counter(struct signing *signing, const char *text, struct bf_error *err)
{
    long n;
    if (options_count("--counter", text, 1, UINT32_MAX, &n, err) != BF_OK)
        return BF_USAGE;
    signing->has_counter = true;
    signing->counter = (uint32_t)n;
    return BF_OK;
}

enum bf_status signing_complete(const struct signing *signing, bool may_be_none, struct bf_error *err)
{
    const bool any = signing->key_file != NULL || signing->has_device || signing->has_counter;
    if (!any && may_be_none)
        return BF_OK;
    if (signing->key_file == NULL || !signing->has_device || !signing->has_counter)
        return bf_fail(err, BF_USAGE, "signing needs --key, --device and --counter together; %s is missing",
                       signing->key_file == NULL ? "--key"
                       : signing->has_device     ? "--counter"
                                                 : "--device");
    outputs_note_input(signing->key_file); /* which is read after the outputs were looked at */
    return BF_OK;
}

enum bf_status signing_sign(const struct signing *signing, struct beam_image_file *file, struct bf_error *err)
{
    struct device_key key;
    const enum bf_status status = device_key_read(signing->key_file, &key, err);
    if (status == BF_OK)
        target_image_sign(file, &key, signing->device, signing->counter);
    device_key_wipe(&key);
    return status;
}
