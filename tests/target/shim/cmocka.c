/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The running half of shim/cmocka.h. */
#include "cmocka.h"

static jmp_buf way_out;

void _fail(const char *file, int line)
{
    printf("at %s:%d\n", file, line);
    longjmp(way_out, 1);
}

int cmocka_run(const struct CMUnitTest tests[], int n, int (*setup)(void **state), int (*teardown)(void **state))
{
    static volatile int failed;
    void *group = NULL;
    if (setup != NULL && setup(&group) != 0)
        return n;
    for (volatile int i = 0; i < n; i++) {
        void *state = NULL;
        volatile int good = tests[i].setup == NULL || tests[i].setup(&state) == 0;
        if (good && setjmp(way_out) == 0)
            tests[i].test(&state);
        else
            good = 0;
        if (tests[i].teardown != NULL)
            (void)tests[i].teardown(&state);
        printf("%s %s\n", good ? "passed" : "FAILED", tests[i].name);
        failed += !good;
    }
    if (teardown != NULL)
        (void)teardown(&group);
    return failed;
}
