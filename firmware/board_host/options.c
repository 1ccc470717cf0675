/* SPDX-License-Identifier: MIT */
/* Command line, key file. */
#include "host.h"
#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

void host_fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    fputs("board_host: ", stderr);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    exit(1);
}

static const char usage[] =
    "usage: board_host [--sample-Hz F] [--core-MHz F] [--key FILE] [--unlock-key FILE] [--device HEX] [--nvm FILE] "
    "[--pty-link PATH]\n"
    "                  [--plant SOCKET | --replay CODES] [--virtual] [--ticks N] [--power-cut N] [--alarm FILE]\n"
    "The firmware on this machine. Prints 'port: /dev/pts/N', then READY.\n"
    "Time is counted in samples: a busy machine makes the board late, and it misses none.\n"
    "  --sample-Hz F    sample rate, 1..20000, default 1000 (the built-in model's)\n"
    "  --core-MHz F     clock of the controller that this machine stands for, default 168: what a step may cost\n"
    "  --key FILE       the device's key: 32 bytes or 64 hexadecimal digits, mode 0600; without it nothing can be "
    "unlocked\n"
    "  --unlock-key F   another key that unlocks sessions; --key then only signs images\n"
    "  --device HEX     identity, 24 hexadecimal digits, default that of 'board_host_1'\n"
    "  --nvm FILE       the flash's contents, made when absent; without it they are forgotten\n"
    "  --pty-link PATH  symbolic link to the port, replaced when it exists\n"
    "  --plant SOCKET   beam_truth --live answers there; --replay CODES: one sensor code a line; neither: mid scale\n"
    "  --alarm FILE     the alarm's pin: 1 or 0 in this file\n"
    "  --virtual        as fast as the plant answers, 8 turns of the background loop a sample; else in real time\n"
    "  --ticks N        power down after N samples\n"
    "  --power-cut N    die in the middle of the N-th operation of the flash, exit status 42\n";

static uint64_t number(const char *text)
{
    char *end;
    errno = 0;
    const unsigned long long value = strtoull(text, &end, 10);
    if (errno != 0 || *end != 0 || end == text)
        host_fail("'%s' is no whole number", text);
    return value;
}

static int digit(char c)
{
    const char *at = c == 0 ? NULL : strchr("0123456789abcdef", c | 0x20);
    return at ? (int)(at - "0123456789abcdef") : -1;
}

/* 2n digits and nothing else. */
static bool hexadecimal(size_t n, const char *text, uint8_t out[])
{
    for (size_t i = 0; i < n; i++) {
        const int high = digit(text[2 * i]), low = high < 0 ? -1 : digit(text[2 * i + 1]);
        if (low < 0)
            return false;
        out[i] = (uint8_t)(high << 4 | low);
    }
    return true;
}

/* Options with a number; false: it is none of them. */
static bool take_number(int c, struct host_options *out)
{
    switch (c) {
    case 't':
        out->ticks = number(optarg);
        return true;
    case 'c':
        out->power_cut = number(optarg);
        return true;
    case 's':
        out->sample_Hz = strtod(optarg, NULL);
        return true;
    case 'm':
        out->core_MHz = strtod(optarg, NULL);
        return true;
    default:
        return false;
    }
}

static void take(int c, struct host_options *out)
{
    switch (c) {
    case 'l':
        out->pty_link = optarg;
        break;
    case 'k':
        out->key = optarg;
        break;
    case 'u':
        out->unlock_key = optarg;
        break;
    case 'n':
        out->nvm = optarg;
        break;
    case 'p':
        out->plant = optarg;
        break;
    case 'r':
        out->replay = optarg;
        break;
    case 'a':
        out->alarm = optarg;
        break;
    case 'v':
        out->is_virtual = true;
        break;
    case 'd':
        if (strlen(optarg) != 24 || !hexadecimal(12, optarg, out->device))
            host_fail("--device wants 24 hexadecimal digits");
        break;
    case 'h':
        fputs(usage, stdout);
        exit(0);
    default:
        fputs(usage, stderr);
        exit(2);
    }
}

void host_options_read(int argc, char **argv, struct host_options *out)
{
    static const struct option names[] = {{"pty-link", 1, 0, 'l'},   {"key", 1, 0, 'k'},       {"device", 1, 0, 'd'},
                                          {"nvm", 1, 0, 'n'},        {"sample-Hz", 1, 0, 's'}, {"plant", 1, 0, 'p'},
                                          {"replay", 1, 0, 'r'},     {"virtual", 0, 0, 'v'},   {"ticks", 1, 0, 't'},
                                          {"power-cut", 1, 0, 'c'},  {"core-MHz", 1, 0, 'm'},  {"alarm", 1, 0, 'a'},
                                          {"unlock-key", 1, 0, 'u'}, {"help", 0, 0, 'h'},      {0, 0, 0, 0}};
    *out = (struct host_options){.sample_Hz = 1000.0, .core_MHz = 168.0};
    memcpy(out->device, "board_host_1", sizeof out->device);
    for (int c; (c = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (!take_number(c, out))
            take(c, out);
    if (optind != argc || (out->plant && out->replay)) {
        fputs(usage, stderr);
        exit(2);
    }
    if (!(out->sample_Hz >= 1.0 && out->sample_Hz <= 20000.0))
        host_fail("--sample-Hz wants 1..20000");
    if (!(out->core_MHz >= 1.0 && out->core_MHz <= 4000.0))
        host_fail("--core-MHz wants 1..4000");
}

void host_key_read(const char *path, uint8_t key[32])
{
    struct stat stat;
    char text[66] = {0};
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0 || fstat(fd, &stat) != 0)
        host_fail("%s: %s", path, strerror(errno));
    if (!S_ISREG(stat.st_mode) || (stat.st_mode & 077) != 0)
        host_fail("%s: others may read this key; chmod 600 it", path);
    const ssize_t n = read(fd, text, sizeof text);
    close(fd);
    if (n == 32)
        memcpy(key, text, 32);
    else if ((n != 64 && n != 65) || (n == 65 && text[64] != '\n') || !hexadecimal(32, text, key))
        host_fail("%s: a key is 32 bytes, or 64 hexadecimal digits", path);
    explicit_bzero(text, sizeof text);
}
