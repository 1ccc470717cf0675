/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fuzz_import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    fuzz_import(data, n, "npy");
    return 0;
}
