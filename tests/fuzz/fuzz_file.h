/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fuzz_file.h — the fuzzer's bytes as a file in memory with a path, for readers that open files. */
#ifndef BEAMFIT_FUZZ_FILE_H
#define BEAMFIT_FUZZ_FILE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

/* Returns a descriptor to close; path names it as long as it is open. */
static inline int fuzz_file(const uint8_t *data, size_t n, char path[32])
{
    int fd = memfd_create("fuzz", MFD_CLOEXEC);
    if (fd < 0 || write(fd, data, n) != (ssize_t)n)
        abort();
    snprintf(path, 32, "/proc/self/fd/%d", fd);
    return fd;
}

#endif
