/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "run_program.h"

static void give_up(const char *what, const char *name)
{
    fprintf(stderr, "tests: cannot %s %s\n", what, name);
    exit(99);
}

static void join(char path[1024], const char *dir, const char *name)
{
    if (snprintf(path, 1024, "%s/%s", dir, name) >= 1024)
        give_up("name", name);
}

void make_directory(char path[64])
{
    snprintf(path, 64, "/tmp/beamfit-test-XXXXXX");
    if (mkdtemp(path) == NULL)
        give_up("make a directory in", "/tmp");
}

void remove_directory(const char *path)
{
    struct outcome *outcome = malloc(sizeof *outcome);
    if (outcome == NULL)
        give_up("remove", path);
    run_program("/", (const char *[]){"rm", "-rf", path, NULL}, outcome);
    free(outcome);
}

void write_file(const char *dir, const char *name, const void *bytes, size_t size)
{
    char path[1024];
    join(path, dir, name);
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(bytes, 1, size, file) != size || fclose(file) != 0)
        give_up("write", path);
}

void write_text(const char *dir, const char *name, const char *text)
{
    write_file(dir, name, text, strlen(text));
}

int file_exists(const char *dir, const char *name)
{
    char path[1024];
    join(path, dir, name);
    return access(path, F_OK) == 0;
}

static void read_file(const char *path, char text[PROGRAM_TEXT])
{
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        give_up("read", path);
    text[fread(text, 1, PROGRAM_TEXT - 1, file)] = 0;
    fclose(file);
}

int file_is(const char *dir, const char *name, const char *text)
{
    char path[1024];
    join(path, dir, name);
    if (access(path, F_OK) != 0)
        return 0;
    char *found = malloc(PROGRAM_TEXT);
    if (found == NULL)
        give_up("read", path);
    read_file(path, found);
    int same = strcmp(found, text) == 0;
    free(found);
    return same;
}

int count_files(const char *dir)
{
    DIR *stream = opendir(dir);
    if (stream == NULL)
        give_up("list", dir);
    int n = -2; /* . and .. */
    while (readdir(stream) != NULL)
        n++;
    closedir(stream);
    return n;
}

/* In the child: redirect, go to dir, become the program. file_limit < 0: none. */
static void become(const char *dir, long file_limit, const char *program, const char *const arguments[],
                   const char *out, const char *err)
{
    int in_fd = open("/dev/null", O_RDONLY);
    int out_fd = open(out, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    int err_fd = open(err, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (in_fd < 0 || out_fd < 0 || err_fd < 0 || dup2(in_fd, 0) < 0 || dup2(out_fd, 1) < 0 || dup2(err_fd, 2) < 0)
        _exit(98);
    if (chdir(dir) != 0)
        _exit(97);
    if (file_limit >= 0) {
        struct rlimit limit = {(rlim_t)file_limit, (rlim_t)file_limit};
        signal(SIGXFSZ, SIG_IGN); /* write() fails instead, as on a full disk */
        if (setrlimit(RLIMIT_FSIZE, &limit) != 0)
            _exit(96);
    }
    execvp(program, (char *const *)arguments);
    _exit(127);
}

static void run(const char *dir, long file_limit, const char *program, const char *const arguments[],
                struct outcome *outcome)
{
    char logs[64], out[1024], err[1024];
    make_directory(logs);
    join(out, logs, "out");
    join(err, logs, "err");
    pid_t child = fork();
    if (child < 0)
        give_up("start", program);
    if (child == 0)
        become(dir, file_limit, program, arguments, out, err);
    int state;
    struct rusage used;
    if (wait4(child, &state, 0, &used) != child)
        give_up("wait for", program);
    outcome->memory_kB = used.ru_maxrss;
    outcome->status = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
    read_file(out, outcome->out);
    read_file(err, outcome->err);
    unlink(out);
    unlink(err);
    rmdir(logs);
}

void run_program(const char *dir, const char *const arguments[], struct outcome *outcome)
{
    run(dir, -1, arguments[0], arguments, outcome);
}

void run_beamfit_on_small_disk(const char *dir, long bytes, const char *const arguments[], struct outcome *outcome)
{
    enum { MOST = 32 };
    const char *program = getenv("BEAMFIT");
    const char *argv[MOST] = {"beamfit"};
    if (program == NULL || program[0] != '/')
        give_up("find the program: set BEAMFIT to its absolute path, not", program ? program : "(nothing)");
    size_t n = 1;
    for (; arguments[n - 1] != NULL; n++) {
        if (n == MOST - 1)
            give_up("pass so many arguments to", program);
        argv[n] = arguments[n - 1];
    }
    run(dir, bytes, program, argv, outcome);
}

void run_beamfit(const char *dir, const char *const arguments[], struct outcome *outcome)
{
    run_beamfit_on_small_disk(dir, -1, arguments, outcome);
}
