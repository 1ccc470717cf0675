/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fuzz_import.h"

/* matio asks for as much memory as a damaged header says; import_isolated() limits it, and here this does. */
const char *__asan_default_options(void); // NOLINT(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)
const char *__asan_default_options(void)  // NOLINT(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)
{
    return "max_allocation_size_mb=64:allocator_may_return_null=1";
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    fuzz_import(data, n, "mat");
    return 0;
}
