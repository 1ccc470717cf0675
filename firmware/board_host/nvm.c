/* SPDX-License-Identifier: MIT */
/* Flash in a file: programming clears bits only; a cut leaves a word half programmed, or a slot half erased. */
#include "host.h"
#include "board.h"
#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BYTES = HOST_NVM_SLOTS * HOST_NVM_SLOT_BYTES, CUT = 42 };

static uint8_t *flash;
static uint64_t operations, cut_at;

void host_nvm_open(const char *path, uint64_t power_cut)
{
    int fd = -1;
    struct stat stat = {.st_size = 0};
    if (path) {
        fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
        if (fd < 0 || fstat(fd, &stat) != 0)
            host_fail("%s: %s", path, strerror(errno));
        if (stat.st_size != 0 && stat.st_size != BYTES)
            host_fail("%s: a flash has %d bytes", path, BYTES);
        if (ftruncate(fd, BYTES) != 0)
            host_fail("%s: %s", path, strerror(errno));
    }
    void *memory = mmap(NULL, BYTES, PROT_READ | PROT_WRITE, path ? MAP_SHARED : MAP_PRIVATE | MAP_ANONYMOUS, fd, 0);
    if (memory == MAP_FAILED)
        host_fail("flash: %s", strerror(errno));
    flash = memory;
    if (stat.st_size == 0)
        memset(flash, 0xFF, BYTES);
    if (fd >= 0)
        close(fd);
    cut_at = power_cut;
}

static bool inside(int slot, uint32_t offset, size_t n)
{
    return slot >= 0 && slot < HOST_NVM_SLOTS && offset <= HOST_NVM_SLOT_BYTES && n <= HOST_NVM_SLOT_BYTES - offset;
}

static bool is_cut(void)
{
    return ++operations == cut_at;
}

bool board_nvm_read(int slot, uint32_t offset, size_t n, uint8_t out[])
{
    if (!inside(slot, offset, n))
        return false;
    memcpy(out, flash + (size_t)slot * HOST_NVM_SLOT_BYTES + offset, n);
    return true;
}

/* Which bits of a word got through before the power went: different ones in every operation. */
static uint32_t torn(uint32_t word)
{
    const uint32_t kept = (uint32_t)(operations * 0x9E3779B97F4A7C15u >> 32);
    return word | kept;
}

bool board_nvm_program(int slot, uint32_t offset, size_t words, const uint32_t data[])
{
    if (offset % 4 != 0 || words > HOST_NVM_SLOT_BYTES / 4 || !inside(slot, offset, 4 * words))
        return false;
    uint32_t *at = (uint32_t *)(void *)(flash + (size_t)slot * HOST_NVM_SLOT_BYTES + offset);
    for (size_t i = 0; i < words; i++) {
        if (is_cut()) {
            at[i] &= torn(data[i]);
            _exit(CUT);
        }
        at[i] &= data[i];
    }
    return true;
}

/* Time is counted in ticks, and none takes place meanwhile. */
bool board_nvm_erase_stalls(int slot)
{
    (void)slot;
    return false;
}

bool board_nvm_erase(int slot)
{
    if (!inside(slot, 0, 0))
        return false;
    uint8_t *at = flash + (size_t)slot * HOST_NVM_SLOT_BYTES;
    if (is_cut()) {
        memset(at, 0xFF, HOST_NVM_SLOT_BYTES / 2);
        _exit(CUT);
    }
    memset(at, 0xFF, HOST_NVM_SLOT_BYTES);
    return true;
}
