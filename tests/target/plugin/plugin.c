/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A TCG plugin for QEMU 7.2's netduinoplus2: maps the devices that the emulator lacks over its stubs, and counts
 * instructions between two addresses.
 *     -plugin stm32f405.so,rec=F|plant=F,stop=N,live=F,live_at=A,live_bytes=N,flash=F,cut=N,seed=N,erase_ns=N,uid=24 hex,
 *             stack=N,dead=N,poke=A,poke_at=N,begin=A,end=A[,end=A…]
 */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "board.h"

int qemu_plugin_version = QEMU_PLUGIN_VERSION;
struct qemu qemu;

#define RAM_AT 0x20000000u

static const char *unique_id = "0123456789abcdef01234567";
static uint64_t stack_bytes;

/* QMP's VersionInfo */
struct version {
    struct {
        int64_t major, minor, micro;
    } * number;
};
typedef struct version *query_version(void **error);

bool qemu_find(const qemu_info_t *info, struct qemu *out)
{
    query_version *query;
    const struct {
        const char *name;
        void *at;
    } wanted[] = {{"memory_region_init_io", &out->region_io},
                  {"memory_region_init_rom_device", &out->region_rom_device},
                  {"memory_region_get_ram_ptr", &out->region_memory},
                  {"memory_region_add_subregion_overlap", &out->map},
                  {"get_system_memory", &out->system_memory},
                  {"object_resolve_path_type", &out->find_object},
                  {"qdev_get_gpio_in", &out->input_line},
                  {"qemu_set_irq", &out->set_line},
                  {"timer_init_full", &out->timer_init},
                  {"timer_mod_ns", &out->timer_at},
                  {"qemu_clock_get_ns", &out->now_ns},
                  {"cpu_physical_memory_rw", &out->memory},
                  {"qemu_register_reset", &out->at_reset},
                  {"qemu_system_reset_request", &out->reset},
                  {"qmp_query_version", &query}};
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        void *const found = dlsym(RTLD_DEFAULT, wanted[i].name);
        if (found == NULL) {
            fprintf(stderr, "[board] this QEMU does not export %s\n", wanted[i].name);
            return false;
        }
        memcpy(wanted[i].at, &found, sizeof found);
    }
    void *error = NULL;
    const struct version *version = query(&error);
    if (version == NULL || version->number->major != 7 || version->number->minor != 2 ||
        strcmp(info->target_name, "arm") != 0) {
        fprintf(stderr, "[board] made for qemu-system-arm 7.2 only\n");
        return false;
    }
    return true;
}

static void devices_reset(void *unused)
{
    (void)unused;
    clock_reset(watchdog_reset());
    adc_reset();
    flash_reset();
    timer_reset();
}

static void mapped(qemu_plugin_id_t id, unsigned vcpu)
{
    (void)id;
    if (vcpu != 0)
        return;
    void *system = qemu.system_memory();
    adc_map(system);
    flash_map(system);
    clock_map(system, unique_id);
    timer_map(system);
    watchdog_map(system);
    qemu.at_reset(devices_reset, NULL);
}

/* The stack lies at the bottom of the RAM, which was zero: how many of its bytes were ever written? */
static void report_stack(void)
{
    uint8_t memory[8192];
    uint64_t untouched = 0;
    if (stack_bytes == 0 || stack_bytes > sizeof memory)
        return;
    qemu.memory(RAM_AT, memory, stack_bytes, false);
    while (untouched < stack_bytes && memory[untouched] == 0)
        untouched++;
    fprintf(stderr, "[board] stack: %llu of %llu bytes\n", (unsigned long long)(stack_bytes - untouched),
            (unsigned long long)stack_bytes);
}

static void report(void)
{
    count_report();
    fprintf(stderr, "[board] conversions %llu, flash operations %llu\n", (unsigned long long)adc_conversions(),
            (unsigned long long)flash_operations());
}

void board_end(int status, const char *why)
{
    fprintf(stderr, "[board] %s\n", why);
    report_stack();
    report();
    adc_close();
    _exit(status);
}

static void at_exit(qemu_plugin_id_t id, void *user)
{
    (void)id;
    (void)user;
    report();
    adc_close();
}

int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv)
{
    struct adc_options adc = {.live_bytes = 48};
    struct flash_options flash = {.erase_ns = 0};
    uint64_t begin_at = 0;
    const struct {
        const char *name;
        const char **text;
        uint64_t *number;
    } known[] = {{"rec", &adc.record, NULL},          {"plant", &adc.plant, NULL},
                 {"live", &adc.live, NULL},           {"flash", &flash.image, NULL},
                 {"uid", &unique_id, NULL},           {"stop", NULL, &adc.stop},
                 {"live_at", NULL, &adc.live_at},     {"live_bytes", NULL, &adc.live_bytes},
                 {"cut", NULL, &flash.cut},           {"seed", NULL, &flash.seed},
                 {"erase_ns", NULL, &flash.erase_ns}, {"begin", NULL, &begin_at},
                 {"stack", NULL, &stack_bytes},       {"dead", NULL, &adc.dead},
                 {"poke", NULL, &adc.poke},           {"poke_at", NULL, &adc.poke_at}};
    const size_t n_known = sizeof known / sizeof *known;
    for (int i = 0; i < argc; i++) {
        const char *value = strchr(argv[i], '=');
        size_t k = 0;
        if (value == NULL)
            return -1;
        if (strncmp(argv[i], "end=", 4) == 0 && count_end(strtoull(value + 1, NULL, 0)))
            continue;
        while (k < n_known && (strncmp(argv[i], known[k].name, strlen(known[k].name)) != 0 ||
                               argv[i] + strlen(known[k].name) != value))
            k++;
        if (k == n_known) {
            fprintf(stderr, "[board] unknown option %s\n", argv[i]);
            return -1;
        }
        if (known[k].text != NULL)
            *known[k].text = strdup(value + 1);
        else
            *known[k].number = strtoull(value + 1, NULL, 0);
    }
    if (!qemu_find(info, &qemu))
        return -1;
    if (!adc_open(&adc) || !flash_open(&flash)) {
        fprintf(stderr, "[board] a file or the plant cannot be opened\n");
        return -1;
    }
    qemu_plugin_register_vcpu_init_cb(id, mapped);
    qemu_plugin_register_atexit_cb(id, at_exit, NULL);
    count_from(id, begin_at);
    return 0;
}
