/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Instructions from one address to the first of some others, both included: a function from its entry to its returns. */
#include <stdio.h>
#include "board.h"

enum { ENDS = 8 };

static uint64_t begin_at, end_at[ENDS], begun, executed, passes, sum, worst;
static int n_ends;
static bool inside;

static void at_begin(unsigned vcpu, void *user)
{
    (void)vcpu;
    (void)user;
    inside = true;
    begun = executed;
}

static void at_end(unsigned vcpu, void *user)
{
    (void)vcpu;
    (void)user;
    if (!inside)
        return;
    const uint64_t taken = executed - begun + 1;
    inside = false;
    passes++;
    sum += taken;
    if (taken > worst)
        worst = taken;
}

static void translated(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    (void)id;
    for (size_t i = 0, n = qemu_plugin_tb_n_insns(tb); i < n; i++) {
        struct qemu_plugin_insn *insn = qemu_plugin_tb_get_insn(tb, i);
        const uint64_t at = qemu_plugin_insn_vaddr(insn);
        if (at == begin_at)
            qemu_plugin_register_vcpu_insn_exec_cb(insn, at_begin, QEMU_PLUGIN_CB_NO_REGS, NULL);
        for (int e = 0; e < n_ends; e++)
            if (at == end_at[e])
                qemu_plugin_register_vcpu_insn_exec_cb(insn, at_end, QEMU_PLUGIN_CB_NO_REGS, NULL);
        qemu_plugin_register_vcpu_insn_exec_inline(insn, QEMU_PLUGIN_INLINE_ADD_U64, &executed, 1);
    }
}

bool count_end(uint64_t address)
{
    if (n_ends == ENDS)
        return false;
    end_at[n_ends++] = address;
    return true;
}

void count_from(qemu_plugin_id_t id, uint64_t address)
{
    begin_at = address;
    if (begin_at != 0 && n_ends > 0)
        qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
}

void count_report(void)
{
    if (passes > 0)
        fprintf(stderr, "[board] instructions: mean %llu, largest %llu of %llu passes\n",
                (unsigned long long)((sum + passes / 2) / passes), (unsigned long long)worst,
                (unsigned long long)passes);
}
