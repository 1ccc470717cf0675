/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * replay_cases FILE — the paper's beam under the patch's voltage in a controller's sizes: linear, with two inputs'
 * worth of blocks (memory), with each effect of the catalogue that such a plan can carry, and with several at once.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "replay_case.h"

static const struct beam_description paper = {.basis = BEAM_BASIS_PATCH,
                                              .parameters = {.EI_beam_Nm2 = 0.491F,
                                                             .EI_patch_Nm2 = 0.793F,
                                                             .rho_beam_kgpm = 0.093F,
                                                             .rho_patch_kgpm = 0.433F,
                                                             .cDI_beam_sNm2 = 0.649e-5F,
                                                             .cDI_patch_sNm2 = 1.255e-5F,
                                                             .gamma_sNpm2 = 0.013F,
                                                             .Ks_V = 4682.342F,
                                                             .KB_NmpV = 2.2e-4F},
                                              .n_inputs = 1,
                                              .n_outputs = 1,
                                              .input = {{BEAM_INPUT_PATCH_MOMENT, 0.0F}},
                                              .output = {{.kind = BEAM_OUTPUT_PATCH_STRAIN}}};

static struct beam_description description;
static struct beam_model model;
static struct beam_work work;
static struct beam_plan plan;
static FILE *out;
static uint32_t n_cases;

static void must(int ok, const char *what)
{
    if (ok)
        return;
    fprintf(stderr, "replay_cases: %s\n", what);
    exit(1);
}

static void add_effect(const char *id)
{
    struct beam_use *use = &description.use[description.n_uses++];
    use->effect = beam_effect_find(id);
    must(use->effect != NULL, id);
    for (int j = 0; j < use->effect->n_parameters; j++) {
        const struct beam_parameter_info *info = &use->effect->parameters[j];
        use->p[j] = (float)info->start * (info->role == BEAM_ROLE_PLACE ? beam_length() : 1.0F);
    }
}

/* As an export does: effects whose matrices say it all are no business of a step. */
static void drop_uses(void)
{
    for (int i = 0; i < plan.n.n_uses; i++) {
        const struct beam_effect *effect = plan.use[i].effect;
        if (effect->law || effect->filter || effect->map || effect->signal || effect->drive || effect->base)
            return;
    }
    plan.n.n_uses = 0;
}

/* The description as it stands, as a case of the file; false when a controller cannot carry it. */
static int write_case(const char *name, uint32_t steps, float dt_s)
{
    static struct replay_case c;
    enum beam_status status = beam_assemble(&description, &model);
    if (status == BEAM_OK)
        status = beam_factor(&model, &(struct beam_options){.dt_s = dt_s, .hold = BEAM_HOLD_ZERO_ORDER}, &work, &plan);
    if (status != BEAM_OK) {
        fprintf(stderr, "replay_cases: %s left out: %s\n", name, beam_status_text(status));
        return 0;
    }
    drop_uses();
    memset(&c, 0, sizeof c);
    (void)snprintf(c.name, sizeof c.name, "%s", name);
    c.steps = steps;
    c.amplitude = 60.0F; /* V */
    c.n_uses = (uint32_t)plan.n.n_uses;
    for (int i = 0; i < plan.n.n_uses; i++) {
        (void)snprintf(c.use[i].id, sizeof c.use[i].id, "%s", plan.use[i].effect->id);
        c.use[i].channels = plan.use[i].channels;
        memcpy(c.use[i].p, plan.use[i].p, sizeof c.use[i].p);
    }
    c.n = plan.n;
    c.x = plan.x;
    must(fwrite(&c, sizeof c, 1, out) == 1, "cannot write");
    n_cases++;
    return 1;
}

int main(int argc, char **argv)
{
    must(argc == 4, "usage: replay_cases FILE STEPS EFFECT_STEPS");
    out = fopen(argv[1], "wb");
    must(out != NULL, "cannot open the file");
    const uint32_t steps = (uint32_t)strtoul(argv[2], NULL, 10), effect_steps = (uint32_t)strtoul(argv[3], NULL, 10);
    struct replay_file head = {REPLAY_MAGIC, 0};
    must(fwrite(&head, sizeof head, 1, out) == 1, "cannot write");
    description = paper;
    must(write_case("linear", steps, 1e-3F), "linear");
    must(write_case("linear_10kHz", steps, 1e-4F), "linear_10kHz");
    for (int e = 0; e < beam_effects_count; e++) {
        description = paper;
        add_effect(beam_effects[e]->id);
        (void)write_case(beam_effects[e]->id, effect_steps, 1e-3F);
    }
    static const char *const together[][BEAM_USES] = {
        {"cubic_stiffness", "sensor_saturation"},
        {"coulomb_friction", "drive_saturation", "mains_hum"},
        {"stop_contact", "drive_hysteresis", "sensor_highpass", "sensor_lag", "feedthrough"}};
    for (size_t i = 0; i < sizeof together / sizeof *together; i++) {
        char name[REPLAY_NAME];
        description = paper;
        for (int j = 0; j < BEAM_USES && together[i][j] != NULL; j++)
            add_effect(together[i][j]);
        (void)snprintf(name, sizeof name, "several_%zu", i + 1);
        must(write_case(name, steps, 1e-3F), name);
    }
    head.n_cases = n_cases;
    must(fseek(out, 0, SEEK_SET) == 0 && fwrite(&head, sizeof head, 1, out) == 1 && fclose(out) == 0, "cannot write");
    return 0;
}
