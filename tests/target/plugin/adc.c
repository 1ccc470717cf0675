/* SPDX-License-Identifier: GPL-2.0-or-later */
/* ADC1 (software start, end of conversion, overrun, interrupt 18) and the DAC's first channel. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "board.h"

enum {
    ADC_BASE = 0x40012000, /* ADC1 at 0x000, common registers at 0x300 */
    DAC_BASE = 0x40007400,
    SR = 0x00,
    CR1 = 0x04,
    CR2 = 0x08,
    DR = 0x4C,
    EOC = 1 << 1,
    STRT = 1 << 4,
    OVR = 1 << 5,
    EOCIE = 1 << 5,
    OVRIE = 1 << 26,
    ADON = 1,
    SWSTART = 1 << 30,
    DHR12R1 = 0x08,
    MID_SCALE = 2048,
    CONVERSION_NS = 4571, /* 96 cycles at 21 MHz */
    PLANT_MAGIC = 0x5042,
    ADC_LINE = 18
};

static struct adc_options options;
static struct memory_region adc_region, dac_region;
static struct timer conversion;
static bool has_timer, awaited;
static void *line;
static uint32_t sr, cr1, cr2, adc_register[256], dac_register[16];
static uint16_t data, sampled;
static uint64_t conversions;
static FILE *record, *live;
static int plant = -1;

static void update_line(void)
{
    if (line == NULL) {
        bool ambiguous = false;
        void *core = qemu.find_object("", "armv7m", &ambiguous);
        line = core != NULL ? qemu.input_line(core, ADC_LINE) : NULL;
        if (line == NULL)
            board_end(1, "no interrupt controller");
    }
    qemu.set_line(line, ((sr & EOC) && (cr1 & EOCIE)) || ((sr & OVR) && (cr1 & OVRIE)));
}

static bool exchange(int fd, uint16_t drive, uint16_t *code)
{
    const uint8_t out[4] = {PLANT_MAGIC & 0xFF, PLANT_MAGIC >> 8, (uint8_t)drive, (uint8_t)(drive >> 8)};
    uint8_t in[2];
    if (send(fd, out, sizeof out, MSG_NOSIGNAL) != (ssize_t)sizeof out)
        return false;
    for (size_t got = 0; got < sizeof in;) {
        const ssize_t n = recv(fd, in + got, sizeof in - got, 0);
        if (n <= 0)
            return false;
        got += (size_t)n;
    }
    *code = (uint16_t)(in[0] | in[1] << 8);
    return true;
}

/* The plant learns what the D/A holds, and says what the sensor shows now. */
static uint16_t sample(void)
{
    uint16_t code = MID_SCALE;
    if (plant >= 0 && !exchange(plant, (uint16_t)dac_register[DHR12R1 / 4], &code))
        board_end(0, "the plant has gone");
    if (record != NULL && fread(&code, sizeof code, 1, record) != 1)
        board_end(0, "the record has ended");
    return code & 0xFFFu;
}

static void copy_live(void)
{
    uint8_t buffer[256];
    if (live == NULL || conversions == 0)
        return;
    qemu.memory(options.live_at, buffer, options.live_bytes, false);
    if (fwrite(buffer, options.live_bytes, 1, live) != 1)
        board_end(1, "the live file takes no more");
}

static void converted(void *unused)
{
    (void)unused;
    if (!awaited) /* a reset came between */
        return;
    awaited = false;
    data = sampled;
    if (sr & EOC)
        sr |= OVR;
    sr |= EOC;
    conversions++;
    update_line();
}

static void poke(void)
{
    uint32_t ones = UINT32_MAX;
    if (options.poke_at == 0 || conversions != options.poke_at)
        return;
    qemu.memory(options.poke, &ones, sizeof ones, true);
    options.poke_at = 0;
}

static void start_conversion(void)
{
    copy_live();
    poke();
    if (options.dead > 0 && conversions >= options.dead)
        return;
    if (options.stop > 0 && conversions >= options.stop)
        board_end(0, "stopped as told");
    sampled = sample();
    sr |= STRT;
    if (!has_timer)
        qemu.timer_init(&conversion, NULL, VIRTUAL_CLOCK, NANOSECONDS, 0, converted, NULL);
    has_timer = awaited = true;
    qemu.timer_at(&conversion, qemu.now_ns(VIRTUAL_CLOCK) + CONVERSION_NS);
}

static uint64_t adc_read(void *device, hwaddr at, unsigned size)
{
    (void)device;
    (void)size;
    switch (at) {
    case SR:
        return sr;
    case CR1:
        return cr1;
    case CR2:
        return cr2;
    case DR:
        sr &= ~(uint32_t)EOC;
        update_line();
        return data;
    default:
        return adc_register[at / 4];
    }
}

static void adc_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    (void)device;
    (void)size;
    switch (at) {
    case SR:
        sr &= (uint32_t)value;
        update_line();
        break;
    case CR1:
        cr1 = (uint32_t)value;
        update_line();
        break;
    case CR2:
        cr2 = (uint32_t)value & ~(uint32_t)SWSTART;
        if ((value & SWSTART) && (value & ADON))
            start_conversion();
        break;
    default:
        adc_register[at / 4] = (uint32_t)value;
    }
}

static uint64_t dac_read(void *device, hwaddr at, unsigned size)
{
    (void)device;
    (void)size;
    return dac_register[at / 4];
}

static void dac_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    (void)device;
    (void)size;
    dac_register[at / 4] = (uint32_t)value;
}

static int connect_to(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (fd < 0 || strlen(path) >= sizeof address.sun_path)
        return -1;
    memcpy(address.sun_path, path, strlen(path) + 1);
    if (connect(fd, (const struct sockaddr *)&address, sizeof address) == 0)
        return fd;
    (void)close(fd);
    return -1;
}

bool adc_open(const struct adc_options *wanted)
{
    options = *wanted;
    dac_register[DHR12R1 / 4] = MID_SCALE;
    if (options.live_bytes > 256)
        return false;
    if (options.record != NULL && (record = fopen(options.record, "rb")) == NULL)
        return false;
    if (options.live != NULL && (live = fopen(options.live, "wb")) == NULL)
        return false;
    return options.plant == NULL || (plant = connect_to(options.plant)) >= 0;
}

void adc_map(void *system)
{
    static const struct memory_ops adc_ops = {
        .read = adc_read, .write = adc_write, .endianness = LITTLE_ENDIAN_DEVICE, .impl = {4, 4, false}};
    static const struct memory_ops dac_ops = {
        .read = dac_read, .write = dac_write, .endianness = LITTLE_ENDIAN_DEVICE, .impl = {4, 4, false}};
    qemu.region_io(&adc_region, NULL, &adc_ops, NULL, "adc1", sizeof adc_register);
    qemu.map(system, ADC_BASE, &adc_region, 10);
    qemu.region_io(&dac_region, NULL, &dac_ops, NULL, "dac", sizeof dac_register);
    qemu.map(system, DAC_BASE, &dac_region, 10);
}

void adc_reset(void)
{
    sr = cr1 = cr2 = 0;
    awaited = false;
    dac_register[DHR12R1 / 4] = MID_SCALE;
    if (conversions >= options.dead)
        options.dead = 0;
}

uint64_t adc_conversions(void)
{
    return conversions;
}

void adc_close(void)
{
    if (live != NULL && fclose(live) != 0)
        fprintf(stderr, "[board] the live file is not whole\n");
}
