/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * qemu_api.h — what the plugin uses of QEMU 7.2: the TCG plugin interface (version 1), and functions of the emulator
 * itself, which its binary exports and which are looked up by name. The second kind has no promise of staying as it is:
 * qemu_find() refuses any other version.
 */
#ifndef QEMU_API_H
#define QEMU_API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- TCG plugin interface, version 1 ---- */
#define QEMU_PLUGIN_EXPORT __attribute__((visibility("default")))
enum { QEMU_PLUGIN_VERSION = 1 };
enum qemu_plugin_cb_flags { QEMU_PLUGIN_CB_NO_REGS };
enum qemu_plugin_op { QEMU_PLUGIN_INLINE_ADD_U64 };
typedef uint64_t qemu_plugin_id_t;
typedef struct qemu_info_t {
    const char *target_name;
    struct {
        int min, cur;
    } version;
    bool system_emulation;
    union {
        struct {
            int smp_vcpus, max_vcpus;
        } system;
    };
} qemu_info_t;
/* What the plugin gives: */
extern QEMU_PLUGIN_EXPORT int qemu_plugin_version;
QEMU_PLUGIN_EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv);
/* What it takes: */
struct qemu_plugin_tb;
struct qemu_plugin_insn;
void qemu_plugin_register_vcpu_init_cb(qemu_plugin_id_t id, void (*callback)(qemu_plugin_id_t id, unsigned vcpu));
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id,
                                           void (*callback)(qemu_plugin_id_t id, struct qemu_plugin_tb *tb));
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t id, void (*callback)(qemu_plugin_id_t id, void *user), void *user);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *tb, size_t i);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *insn);
void qemu_plugin_register_vcpu_insn_exec_inline(struct qemu_plugin_insn *insn, enum qemu_plugin_op op, void *at,
                                                uint64_t addend);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *insn, void (*callback)(unsigned vcpu, void *user),
                                            enum qemu_plugin_cb_flags flags, void *user);

/* ---- The emulator's own functions, as they are in 7.2 ---- */
typedef uint64_t hwaddr;
struct memory_ops { /* MemoryRegionOps */
    uint64_t (*read)(void *device, hwaddr at, unsigned size);
    void (*write)(void *device, hwaddr at, uint64_t value, unsigned size);
    void *read_with_attributes, *write_with_attributes;
    int endianness;
    struct {
        unsigned min, max;
        bool unaligned;
        void *accepts;
    } valid;
    struct {
        unsigned min, max;
        bool unaligned;
    } impl;
};
enum { LITTLE_ENDIAN_DEVICE = 2, VIRTUAL_CLOCK = 1, NANOSECONDS = 1, GUEST_RESET = 7 };

/* Room for the emulator's own structs, larger than they are in 7.2. */
struct memory_region {
    _Alignas(16) uint8_t room[4096];
};
struct timer {
    _Alignas(16) uint8_t room[512];
};

struct qemu {
    void (*region_io)(struct memory_region *, void *owner, const struct memory_ops *, void *device, const char *,
                      uint64_t);
    void (*region_rom_device)(struct memory_region *, void *owner, const struct memory_ops *, void *device,
                              const char *, uint64_t, void **error);
    void *(*region_memory)(struct memory_region *);
    void (*map)(void *container, hwaddr at, struct memory_region *, int priority);
    void *(*system_memory)(void);
    void *(*find_object)(const char *path, const char *type, bool *ambiguous);
    void *(*input_line)(void *device, int n);
    void (*set_line)(void *line, int level);
    void (*timer_init)(struct timer *, void *group, int clock, int scale, int attributes, void (*done)(void *),
                       void *user);
    void (*timer_at)(struct timer *, int64_t ns);
    int64_t (*now_ns)(int clock);
    void (*memory)(hwaddr at, void *buffer, hwaddr n, bool write);
    void (*at_reset)(void (*reset)(void *user), void *user);
    void (*reset)(int cause);
};

/* All of them; false, and said on standard error, when this is not the QEMU they belong to. */
bool qemu_find(const qemu_info_t *info, struct qemu *out);

#endif
