/* SPDX-License-Identifier: MIT */
/*
 * What one step costs at most, in instructions of a Cortex-M4F (-O2, no contraction). Each term is a loop of beam_step.c,
 * beam_law.c or beam_chain.c: its turns, which the plan's counts state, times the instructions of a turn, which the
 * emulator counts (tests/target/cost_run.c steps plans that take every turn).
 */
#include "beam_plan.h"

enum { /* a step without effects and history, beam_step() */
       LINEAR_FIXED = 70,
       LINEAR_PAIR = 64, /* two blocks: turned, and read by the output */
       /* beam_linear_step(): further inputs and outputs */
       MANY_FIXED = 120,
       /* beam_general_step() */
       GENERAL_FIXED = 330,
       TURN_PAIR = 40,
       COLUMN_FIXED = 16,
       COLUMN_PAIR = 24,
       ROW_FIXED = 40,
       ROW_PAIR = 24,
       TAP = 14, /* of a row and an input that is remembered */
       INPUT = 60,
       USE_LOOKED_AT = 14,
       CALL = 60, /* beside what the effect itself takes */
       /* beam_chain_step() */
       CHAIN_FIXED = 70,
       LINK_FIXED = 110,
       LINK_TAP = 12
};

enum { /* beam_laws_solve(): once; one evaluation; one port of it; one law point; a pair of ports */
       SOLVE_FIXED = 120,
       SOLVE_PORT = 60,
       EVALUATION = 190,
       EVALUATION_POINT = 150,
       EVALUATION_PORT = 130,
       EVALUATION_PAIR = 80,
       SOLVE_CUBE = 4 /* a third of n³ multiply-adds of the elimination, with their loads and stores */
};

static uint32_t call_of(const struct beam_effect *effect)
{
    return CALL + (effect->step_instructions > 0 ? effect->step_instructions : (uint32_t)BEAM_STEP_UNSTATED);
}

static uint32_t drives(const struct beam_plan *plan)
{
    uint32_t sum = (uint32_t)(plan->n.n_inputs * plan->n.n_uses) * USE_LOOKED_AT;
    for (int use = 0; use < plan->n.n_uses; use++)
        for (int i = 0; i < plan->n.n_inputs && plan->use[use].effect->drive; i++)
            if (plan->use[use].channels >> i & 1u)
                sum += call_of(plan->use[use].effect);
    return plan->n.base_use >= 0 ? sum + call_of(plan->use[plan->n.base_use].effect) : sum;
}

static uint32_t chains(const struct beam_plan *plan)
{
    uint32_t sum = 0;
    for (int o = 0; o < plan->n.n_outputs; o++) {
        sum += CHAIN_FIXED;
        for (int c = 0; c < plan->n.n_links[o]; c++) {
            const struct beam_link *link = &plan->n.link[o][c];
            const struct beam_effect *effect = plan->use[link->use].effect;
            sum += LINK_FIXED + (uint32_t)link->n_taps * LINK_TAP;
            sum += (effect->map ? call_of(effect) : 0u) + (effect->signal ? call_of(effect) : 0u);
        }
    }
    return sum;
}

static uint32_t laws(const struct beam_plan *plan)
{
    const uint32_t n = (uint32_t)plan->n.n_ports;
    uint32_t once = EVALUATION + n * EVALUATION_PORT + n * n * EVALUATION_PAIR + n * n * n * SOLVE_CUBE;
    for (int p = 0; p < plan->n.n_ports; p++)
        if (plan->n.port_coordinate[p] == 0)
            once += EVALUATION_POINT + call_of(plan->use[plan->n.port_use[p]].effect);
    return n == 0 ? 0 : SOLVE_FIXED + n * SOLVE_PORT + (uint32_t)plan->n.law_evaluations * once;
}

uint32_t beam_step_bound(const struct beam_plan *plan)
{
    const struct beam_plan_counts *n = &plan->n;
    const uint32_t pairs = ((uint32_t)n->n_blocks + 1) / 2, outputs = (uint32_t)n->n_outputs;
    const uint32_t inputs = (uint32_t)n->n_inputs + (n->base_use >= 0), ports = (uint32_t)n->n_ports;
    const int n_taps = n->n_taps;
    const uint32_t rows = outputs + 2 * ports, taps = (uint32_t)n_taps;
    if (n->n_uses == 0 && n->n_taps == 1 && n->n_inputs == 1 && n->n_outputs == 1)
        return LINEAR_FIXED + pairs * LINEAR_PAIR;
    const uint32_t columns = (inputs > 0 ? inputs - 1 : 0) + ports;
    const uint32_t turned = pairs * TURN_PAIR + columns * (COLUMN_FIXED + pairs * COLUMN_PAIR);
    const uint32_t read = rows * (ROW_FIXED + pairs * ROW_PAIR + inputs * taps * TAP);
    if (n->n_uses == 0 && n->n_taps == 1)
        return MANY_FIXED + turned + read;
    return GENERAL_FIXED + inputs * INPUT + turned + read + drives(plan) + chains(plan) + laws(plan);
}
