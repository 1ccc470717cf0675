/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Instructions, counted on an emulated board, beside what lib/ states of them. A line each:
 *
 *     call ID stated counted      the costliest call of an effect's law, map, signal, drive or base, arguments of any size
 *     step tracking_N bound counted   what follows N modes, learning in every sample
 *     step NAME bound counted     the costliest step of a plan whose law never settles: every evaluation, every elimination
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "beam.h"
#include "track.h"

uint32_t target_count(void); /* instructions so far */

enum { TRIES = 4000, STEPS = 12 };

static uint32_t random_state = 1;

static uint32_t random_word(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return random_state >> 8;
}

/* Of either sign, of any size from 1e-9 to 1e9 of `unit`; now and then 0. */
static float any(float unit)
{
    static const float decades[] = {1e-9F, 1e-6F, 1e-3F, 1e-2F, 0.1F, 0.5F, 1.0F, 2.0F, 10.0F, 1e3F, 1e6F, 1e9F};
    const float size = decades[random_word() % 12] * (1.0F + (float)(random_word() % 1000) * 1e-3F);
    return random_word() % 16 == 0 ? 0.0F : (random_word() & 1u ? size : -size) * unit;
}

/* ---- Calls ---- */

static uint32_t overhead;

static void draw_parameters(const struct beam_effect *effect, float p[BEAM_EFFECT_PARAMETERS])
{
    for (int j = 0; j < effect->n_parameters; j++) {
        const struct beam_parameter_info *info = &effect->parameters[j];
        const double drawn = info->start * (random_word() % 3 == 0 ? (double)fabsf(any(1.0F)) : 1.0);
        p[j] = (float)(drawn < info->minimum ? info->minimum : drawn > info->maximum ? info->maximum : drawn);
    }
}

/* One call with arguments drawn anew; its instructions. Nothing is asked of what it returns. */
static uint32_t call(const struct beam_effect *effect)
{
    float p[BEAM_EFFECT_PARAMETERS] = {0.0F}, z[BEAM_DRIVE_STATES];
    static const float units[] = {1.0F, 1e-3F, 1e-6F};
    const float unit = units[random_word() % 3];
    draw_parameters(effect, p);
    struct beam_law_input in = {.t_s = fabsf(any(1.0F)), .dt_s = 1e-3F};
    struct beam_law_output law;
    struct beam_sample_output sample = {.y = 0.0F};
    struct beam_drive_output drive = {.u = 0.0F};
    memset(&law, 0, sizeof law);
    for (int i = 0; i < BEAM_LAW_WIDTH; i++) {
        in.w[i] = any(unit);
        in.v[i] = any(1e3F * unit);
        in.w_old[i] = random_word() % 2 ? in.w[i] : any(unit);
    }
    for (int s = 0; s < BEAM_LAW_STATES; s++)
        in.z[s] = any(unit);
    z[0] = any(unit);
    const float v = any(1.0F), u = any(1.0F), u_old = any(1.0F), t_s = fabsf(any(1.0F));
    const uint32_t begin = target_count();
    if (effect->law)
        (void)effect->law(p, &in, &law);
    else if (effect->map)
        (void)effect->map(p, v, u, &sample);
    else if (effect->signal)
        (void)effect->signal(p, t_s, v, &sample);
    else if (effect->drive)
        (void)effect->drive(p, u, u_old, z, &drive);
    else
        (void)effect->base(p, t_s, &sample);
    return target_count() - begin - overhead;
}

static void count_calls(void)
{
    for (int e = 0; e < beam_effects_count; e++) {
        const struct beam_effect *effect = beam_effects[e];
        uint32_t worst = 0;
        if (!effect->law && !effect->map && !effect->signal && !effect->drive && !effect->base)
            continue;
        for (int i = 0; i < TRIES; i++) {
            const uint32_t taken = call(effect);
            worst = taken > worst ? taken : worst;
        }
        printf("call %s %lu %lu\n", effect->id, (unsigned long)effect->step_instructions, (unsigned long)worst);
    }
}

/* ---- Steps ---- */

static struct beam_plan plan;
static struct beam_state state;
static uint32_t calls; /* of the law in this step */

/*
 * The ports' compliance is 1 and their free motion 0, so w = −g: the residual g − f shrinks a little with each evaluation, and
 * the tangents are drawn anew. Newton's step is solved every time, and never small.
 */
static int restless(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    (void)p;
    const float residual = (random_word() & 1u ? 1.0F : -1.0F) * (10.0F - 0.004F * (float)calls++);
    for (int i = 0; i < BEAM_LAW_WIDTH; i++) {
        out->f[i] = -in->w[i] - residual;
        for (int j = 0; j < BEAM_LAW_WIDTH; j++) {
            out->f_w[i][j] = any(1e-9F);
            out->f_v[i][j] = any(1e-9F);
        }
    }
    return 0;
}

static int unmoved(const beam_real p[], beam_real v, beam_real u, struct beam_sample_output *out)
{
    out->y = v + p[0] * u;
    return 0;
}

static int through(const beam_real p[], beam_real u, beam_real u_old, const beam_real z[BEAM_DRIVE_STATES],
                   struct beam_drive_output *out)
{
    (void)u_old;
    out->u = u + p[0] * z[0];
    out->z[0] = u;
    return 0;
}

static const struct beam_effect law_effect = {.id = "restless", .law = restless, .step_instructions = 380};
static const struct beam_effect map_effect = {.id = "unmoved", .map = unmoved, .step_instructions = 12};
static const struct beam_effect drive_effect = {.id = "through", .drive = through, .step_instructions = 14};

static void begin_plan(int n_blocks, int ports, int width, int evaluations)
{
    memset(&plan, 0, sizeof plan);
    plan.n = (struct beam_plan_counts){.n_blocks = (beam_count)n_blocks,
                                       .n_inputs = 1,
                                       .n_outputs = 1,
                                       .n_ports = (beam_count)ports,
                                       .base_use = -1,
                                       .n_taps = 1,
                                       .law_evaluations = (beam_count)evaluations};
    plan.n.input_ring[0] = (struct beam_ring){0, 2};
    plan.n.command_ring = plan.n.output_ring[0] = (struct beam_ring){2, 1};
    plan.x.dt_s = 1e-3F;
    for (int p = 0; p < ports; p++) {
        plan.n.port_use[p] = (beam_count)(p / width);
        plan.n.port_coordinate[p] = (beam_count)(p % width);
        plan.use[p / width] = (struct beam_use){.effect = &law_effect};
        plan.n.n_uses = (beam_count)(p / width + 1);
        plan.x.weight[p] = 1.0F;
        plan.x.compliance[1 + 2 * p][p] = plan.x.compliance[2 + 2 * p][p] = 1.0F;
    }
}

static void add_use(const struct beam_effect *effect, int n_taps)
{
    const beam_count u = plan.n.n_uses++, taps = (beam_count)n_taps;
    plan.use[u] = (struct beam_use){.effect = effect, .channels = 1, .p = {1e-3F}};
    if (effect->drive)
        return;
    struct beam_link *link = &plan.n.link[0][plan.n.n_links[0]++];
    *link = (struct beam_link){.use = u, .n_taps = taps, .ring = {4, (beam_count)(n_taps + 2)}};
}

static void count_steps(const char *name)
{
    uint32_t worst = 0;
    if (beam_plan_check(&plan) != BEAM_OK) {
        printf("step %s is no plan\n", name);
        exit(1);
    }
    beam_reset(&plan, &state);
    for (int k = 0; k < STEPS; k++) {
        const float u[BEAM_INPUTS] = {any(1e-3F)};
        float y[BEAM_OUTPUTS];
        calls = 0;
        const uint32_t begin = target_count();
        (void)beam_step(&plan, &state, u, y);
        const uint32_t taken = target_count() - begin - overhead;
        worst = taken > worst ? taken : worst;
    }
    printf("step %s %lu %lu\n", name, (unsigned long)beam_step_bound(&plan), (unsigned long)worst);
}

static void count_laws(void)
{
    static const int evaluations[] = {1, 4, 16};
    char name[48];
    for (int ports = 1; ports <= BEAM_PORTS; ports++)
        for (int e = 0; e < 3; e++) {
            begin_plan(BEAM_BLOCKS, ports, 1, evaluations[e]);
            (void)snprintf(name, sizeof name, "laws_%d_evaluations_%d", ports, evaluations[e]);
            count_steps(name);
        }
    begin_plan(BEAM_BLOCKS, BEAM_PORTS, 2, 16);
    count_steps("wide_laws_8_evaluations_16");
    begin_plan(10, 1, 1, 100);
    count_steps("laws_1_evaluations_100");
}

static void count_rest(void)
{
    static const int blocks[] = {1, 2, 10, BEAM_BLOCKS};
    char name[48];
    for (int i = 0; i < 4; i++) {
        begin_plan(blocks[i], 0, 1, 1);
        (void)snprintf(name, sizeof name, "blocks_%d", blocks[i]);
        count_steps(name);
        add_use(&drive_effect, 0);
        (void)snprintf(name, sizeof name, "drive_blocks_%d", blocks[i]);
        count_steps(name);
    }
    begin_plan(10, 0, 1, 1);
    for (int c = 0; c < BEAM_CHAIN; c++)
        add_use(&map_effect, c < 2 ? 20 : 0);
    count_steps("chain_of_maps");
    begin_plan(BEAM_BLOCKS, 0, 1, 1);
    for (int d = 0; d < BEAM_USES; d++)
        add_use(&drive_effect, 0);
    count_steps("drives_8");
    begin_plan(BEAM_BLOCKS, 1, 1, 16);
    plan.n.n_taps = 9; /* of a band-limited hold, three rows */
    plan.n.beam_latency = plan.n.latency = 4;
    plan.n.input_ring[0] = (struct beam_ring){0, 10};
    plan.n.command_ring = plan.n.output_ring[0] = (struct beam_ring){10, 5};
    count_steps("taps_9");
}

/* Modes that move and are learnt from in every sample. */
static void count_tracking(void)
{
    static struct beam_image image;
    for (int modes = 1; modes <= BEAM_TRACKED; modes++) {
        uint32_t worst = 0;
        image.plan.x.dt_s = 1e-3F;
        image.front.setup = (struct beam_image_setup){.noise_rms = 1.0F, .averaging_s = 1.0F};
        image.front.tracking = (struct beam_image_tracking){.wander_s = 1e3F, .kappa = 0.01F};
        for (int b = 0; b < modes; b++) { /* not the first blocks: the search for them counts */
            const int block = BEAM_BLOCKS - 2 * BEAM_TRACKED + 2 * b + 1;
            image.front.tracking.blocks |= 1u << block;
            image.front.tracking.heard[b][0] = 1.0F;
            memcpy(image.plan.x.phi[block], (float[]){-0.01F, 0.1F, -0.1F, -0.01F}, sizeof *image.plan.x.phi);
            image.plan.x.gamma[0][2 * block] = 0.1F;
            state.x[2 * block] = 10.0F;
        }
        for (int k = 0; k < 200; k++) {
            const uint32_t begin = target_count();
            track_sample(&image, &state, any(1e-3F) > 0.0F ? 1.0F : -1.0F, true);
            const uint32_t taken = target_count() - begin - overhead;
            worst = taken > worst ? taken : worst;
        }
        printf("step tracking_%d %lu %lu\n", modes,
               (unsigned long)beam_image_tracking_bound(image.front.tracking.blocks), (unsigned long)worst);
    }
}

int main(void)
{
    const uint32_t begin = target_count();
    overhead = target_count() - begin;
    count_calls();
    count_rest();
    count_tracking();
    count_laws();
    return 0;
}
