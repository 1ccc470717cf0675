/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <fcntl.h>
#include <libgen.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "board.h"

static void give_up(const char *what, const char *name)
{
    fprintf(stderr, "tests: cannot %s %s\n", what, name);
    exit(99);
}

static void find_board(char path[1024])
{
    const char *program = getenv("BEAMFIT");
    char copy[1024];
    if (program == NULL || snprintf(copy, sizeof copy, "%s", program) >= (int)sizeof copy ||
        snprintf(path, 1024, "%s/board_host", dirname(copy)) >= 1024)
        give_up("find board_host: set BEAMFIT to an absolute path, not", program ? program : "(nothing)");
}

/* Lines of its output until READY. */
static void await_ready(struct board *board, int from)
{
    char text[1024];
    size_t n = 0;
    board->port[0] = 0;
    while (n + 1 < sizeof text) {
        const ssize_t got = read(from, text + n, sizeof text - 1 - n);
        if (got <= 0)
            break;
        n += (size_t)got;
        text[n] = 0;
        if (strstr(text, "READY\n") == NULL)
            continue;
        const char *port = strstr(text, "port: ");
        if (port != NULL && sscanf(port, "port: %63s", board->port) == 1)
            return;
    }
    give_up("start", "board_host");
}

void board_start(struct board *board, const char *dir, const char *const arguments[])
{
    enum { MOST = 24 };
    char path[1024];
    const char *argv[MOST] = {"board_host"};
    int ends[2];
    find_board(path);
    for (size_t n = 1; arguments[n - 1] != NULL; n++) {
        if (n == MOST - 1)
            give_up("pass so many arguments to", path);
        argv[n] = arguments[n - 1];
    }
    if (pipe2(ends, O_CLOEXEC) != 0 || (board->process = fork()) < 0)
        give_up("start", path);
    if (board->process == 0) {
        if (chdir(dir) != 0 || dup2(ends[1], 1) < 0)
            _exit(98);
        execv(path, (char *const *)argv);
        _exit(127);
    }
    close(ends[1]);
    await_ready(board, ends[0]);
    close(ends[0]);
}

static void end(pid_t *process, int signal)
{
    int ended;
    if (*process <= 0)
        return;
    kill(*process, signal);
    waitpid(*process, &ended, 0);
    *process = 0;
}

void board_stop(struct board *board)
{
    end(&board->process, SIGTERM);
}

void board_kill(struct board *board)
{
    end(&board->process, SIGKILL);
}

void write_key(const char *dir, const char *name, const char bytes[32])
{
    char path[1024];
    write_file(dir, name, bytes, 32);
    if (snprintf(path, sizeof path, "%s/%s", dir, name) >= (int)sizeof path || chmod(path, 0600) != 0)
        give_up("protect", name);
}
