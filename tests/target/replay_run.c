/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Steps every case and prints its name, its steps, a hash of all outputs, the last output's bits and how many steps
 * said what but OK. The same source runs on the host (replay_run FILE) and on the boards, whose loader puts the file
 * into memory; what they print must be equal. A board that can count adds instructions per step: mean and largest.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "replay_case.h"

#ifdef __arm__
extern const struct replay_file target_cases; /* a place of the linker script */
uint32_t target_count(void);                  /* instructions so far; 0 where nothing counts */
#else
static uint32_t target_count(void)
{
    return 0;
}
#endif

struct tally {
    uint32_t hash, last, not_ok, mean, worst;
};

static uint32_t hash_word(uint32_t hash, uint32_t word)
{
    return (hash ^ word) * 16777619u;
}

static int take_plan(const struct replay_case *c, struct beam_plan *plan)
{
    memset(plan, 0, sizeof *plan);
    plan->n = c->n;
    plan->x = c->x;
    for (uint32_t i = 0; i < c->n_uses; i++) {
        plan->use[i].effect = beam_effect_find(c->use[i].id);
        plan->use[i].channels = c->use[i].channels;
        memcpy(plan->use[i].p, c->use[i].p, sizeof plan->use[i].p);
        if (plan->use[i].effect == NULL)
            return 0;
    }
    return beam_plan_check(plan) == BEAM_OK;
}

static struct tally run(const struct replay_case *c, const struct beam_plan *plan, uint32_t overhead)
{
    static struct beam_state state;
    struct tally t = {.hash = 2166136261u};
    uint32_t random = 1;
    uint64_t sum = 0;
    beam_reset(plan, &state);
    for (uint32_t k = 0; k < c->steps; k++) {
        const float u[BEAM_INPUTS] = {c->amplitude * replay_noise(&random)};
        float y[BEAM_OUTPUTS];
        const uint32_t begin = target_count();
        const enum beam_status status = beam_step(plan, &state, u, y);
        const uint32_t taken = target_count() - begin - overhead;
        sum += taken;
        if (taken > t.worst)
            t.worst = taken;
        memcpy(&t.last, &y[0], sizeof t.last);
        t.hash = hash_word(hash_word(t.hash, t.last), (uint32_t)status);
        t.not_ok += status != BEAM_OK;
    }
    t.mean = (uint32_t)((sum + c->steps / 2) / c->steps);
    return t;
}

static int run_all(const struct replay_file *file)
{
    static struct beam_plan plan;
    const struct replay_case *c = (const struct replay_case *)(file + 1);
    const uint32_t begin = target_count(), overhead = target_count() - begin;
    if (file->magic != REPLAY_MAGIC || file->n_cases == 0)
        return 1;
    for (uint32_t i = 0; i < file->n_cases; i++, c++) {
        if (!take_plan(c, &plan))
            return 2;
        const struct tally t = run(c, &plan, overhead);
        printf("%-24s %8lu %08lx %08lx %lu", c->name, (unsigned long)c->steps, (unsigned long)t.hash,
               (unsigned long)t.last, (unsigned long)t.not_ok);
        if (overhead > 0)
            printf(" %lu %lu", (unsigned long)t.mean, (unsigned long)t.worst);
        printf("\n");
    }
    return 0;
}

#ifdef __arm__
int main(void)
{
    return run_all(&target_cases);
}
#else
int main(int argc, char **argv)
{
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    long size = 0;
    if (file == NULL || fseek(file, 0, SEEK_END) != 0 || (size = ftell(file)) < (long)sizeof(struct replay_file))
        return 3;
    struct replay_file *all = malloc((size_t)size);
    if (all == NULL || fseek(file, 0, SEEK_SET) != 0 || fread(all, (size_t)size, 1, file) != 1)
        return 3;
    (void)fclose(file);
    const int status = run_all(all);
    free(all);
    return status;
}
#endif
