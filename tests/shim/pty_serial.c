/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * pty_serial.c — LD_PRELOAD, for tests only: pseudo terminal /dev/pts/N also appears as serial port /dev/ttyPTYN, so that
 * libserialport, which knows no pseudo terminals, can be run against an emulated board. It asks for a directory entry of
 * /sys/class/tty, and for modem lines, which are answered here; all else is the kernel's.
 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

static const char device[] = "/dev/ttyPTY", entry[] = "/sys/class/tty/ttyPTY";

static int begins(const char *path, const char *with)
{
    return strncmp(path, with, strlen(with)) == 0;
}

/* The pseudo terminal behind a path, or the path. */
static const char *real_path(const char *path, char text[64])
{
    if (!begins(path, device))
        return path;
    snprintf(text, 64, "/dev/pts/%.20s", path + strlen(device));
    return text;
}

/* The library's own function of this name, into a pointer to function. */
static void find(const char *name, void *into)
{
    void *found = dlsym(RTLD_NEXT, name);
    memcpy(into, &found, sizeof found);
}

char *realpath(const char *restrict path, char *restrict resolved)
{
    char *(*next)(const char *, char *);
    find("realpath", &next);
    char text[64];
    if (!begins(path, device))
        return next(path, resolved);
    if (access(real_path(path, text), F_OK) != 0)
        return NULL;
    return resolved != NULL ? strcpy(resolved, path) : strdup(path);
}

int stat(const char *restrict path, struct stat *restrict out)
{
    int (*next)(const char *, struct stat *);
    find("stat", &next);
    char text[64];
    return next(real_path(path, text), out);
}

int lstat(const char *restrict path, struct stat *restrict out)
{
    int (*next)(const char *, struct stat *);
    find("lstat", &next);
    if (!begins(path, entry))
        return next(path, out);
    memset(out, 0, sizeof *out);
    out->st_mode = S_IFLNK | 0777;
    return 0;
}

/* What lstat() was in programs linked against glibc before 2.33. */
int __lxstat(int version, const char *path, struct stat *out);
int __lxstat(int version, const char *path, struct stat *out)
{
    (void)version;
    return lstat(path, out);
}

ssize_t readlink(const char *restrict path, char *restrict out, size_t size)
{
    ssize_t (*next)(const char *, char *, size_t);
    find("readlink", &next);
    static const char link[] = "../../devices/virtual/tty/ttyPTY";
    if (!begins(path, entry))
        return next(path, out, size);
    const size_t n = sizeof link - 1 < size ? sizeof link - 1 : size;
    memcpy(out, link, n);
    return (ssize_t)n;
}

int open(const char *path, int flags, ...)
{
    int (*next)(const char *, int, ...);
    find("open", &next);
    char text[64];
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return next(real_path(path, text), flags, mode);
}

/* What open() is in programs compiled with _FORTIFY_SOURCE. */
int __open_2(const char *path, int flags);
int __open_2(const char *path, int flags)
{
    return open(path, flags);
}

int ioctl(int fd, unsigned long request, ...)
{
    int (*next)(int, unsigned long, ...);
    find("ioctl", &next);
    va_list more;
    va_start(more, request);
    void *argument = va_arg(more, void *);
    va_end(more);
    const int answer = next(fd, request, argument);
    if (answer == 0 || (errno != ENOTTY && errno != EINVAL) || !isatty(fd))
        return answer;
    if (request == TIOCMGET)
        *(int *)argument = TIOCM_CTS | TIOCM_DSR | TIOCM_CAR;
    return request == TIOCMGET || request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC ? 0 : answer;
}
