/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The float library behind functions that name no number type of the library: see beam_case.h. */
#include "beam.h"

int shadow_load(const int counts[], const double numbers[]);
int shadow_continue(int n, const double *u, double *y);
int shadow_run(const int counts[], const double numbers[], const char *const ids[], const unsigned channels[],
               const double parameters[], int n_uses, int n, const double *u, double *y);
int shadow_hit_tail(const int counts[], const double numbers[], int n, int tail, double dt_s, double t0_s,
                    double band_Hz, double *y);
int shadow_factor_run(int basis, int hold, double dt_s, double damping, int n, const double *u, double *y);
int shadow_poles(int basis, double memory_share, double relaxation_s, double frequency_Hz[BEAM_N], int *n_real);
double case_hit(double t_s, double t0_s, double band_Hz);

static struct beam_plan loaded;
static struct beam_state state;

static void copy_plan(const int counts[], const double numbers[])
{
    for (int i = 0; i < BEAM_PLAN_COUNTS; i++)
        ((int *)&loaded.n)[i] = counts[i];
    for (int i = 0; i < BEAM_PLAN_NUMBERS; i++)
        ((float *)&loaded.x)[i] = (float)numbers[i];
}

int shadow_load(const int counts[], const double numbers[])
{
    copy_plan(counts, numbers);
    beam_reset(&loaded, &state);
    return beam_plan_check(&loaded);
}

int shadow_continue(int n, const double *u, double *y)
{
    float in[BEAM_INPUTS], out[BEAM_OUTPUTS];
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < loaded.n.n_inputs; i++)
            in[i] = (float)u[i * n + k];
        const int status = beam_step(&loaded, &state, in, out);
        if (status != BEAM_OK)
            return status;
        for (int o = 0; o < loaded.n.n_outputs; o++)
            y[o * n + k] = (double)out[o];
    }
    return BEAM_OK;
}

int shadow_run(const int counts[], const double numbers[], const char *const ids[], const unsigned channels[],
               const double parameters[], int n_uses, int n, const double *u, double *y)
{
    copy_plan(counts, numbers);
    for (int e = 0; e < n_uses; e++) {
        loaded.use[e].effect = beam_effect_find(ids[e]);
        loaded.use[e].channels = channels[e];
        for (int i = 0; i < BEAM_EFFECT_PARAMETERS; i++)
            loaded.use[e].p[i] = (float)parameters[e * BEAM_EFFECT_PARAMETERS + i];
    }
    beam_reset(&loaded, &state);
    const int status = beam_plan_check(&loaded);
    return status != BEAM_OK ? status : shadow_continue(n, u, y);
}

int shadow_hit_tail(const int counts[], const double numbers[], int n, int tail, double dt_s, double t0_s,
                    double band_Hz, double *y)
{
    int status = shadow_load(counts, numbers);
    for (int k = 0; k < n && status == BEAM_OK; k++) {
        const float in[BEAM_INPUTS] = {(float)case_hit(k * dt_s, t0_s, band_Hz)};
        float out[BEAM_OUTPUTS];
        status = beam_step(&loaded, &state, in, out);
        if (k >= n - tail)
            y[k - n + tail] = (double)out[0];
    }
    return status;
}

static void describe(int basis, double damping, struct beam_description *d)
{
    *d = (struct beam_description){
        .basis = basis == 0 ? BEAM_BASIS_UNIFORM : BEAM_BASIS_PATCH,
        .parameters = {.EI_beam_Nm2 = 0.491F,
                       .EI_patch_Nm2 = 0.793F,
                       .rho_beam_kgpm = 0.093F,
                       .rho_patch_kgpm = 0.433F,
                       .cDI_beam_sNm2 = 0.649e-5F * (float)damping,
                       .cDI_patch_sNm2 = 1.255e-5F * (float)damping,
                       .gamma_sNpm2 = 0.013F * (float)damping,
                       .Ks_V = 4682.342F,
                       .KB_NmpV = 1.746e-2F},
        .n_inputs = 2,
        .n_outputs = 4,
        .input = {{.kind = BEAM_INPUT_POINT_FORCE, .at_m = 0.0254F}, {.kind = BEAM_INPUT_PATCH_MOMENT}},
        .output = {{.kind = BEAM_OUTPUT_PATCH_STRAIN},
                   {.kind = BEAM_OUTPUT_ACCELERATION, .at_m = 0.0214F},
                   {.kind = BEAM_OUTPUT_VELOCITY, .at_m = 0.44F},
                   {.kind = BEAM_OUTPUT_DISPLACEMENT, .at_m = 0.44F}},
    };
}

int shadow_factor_run(int basis, int hold, double dt_s, double damping, int n, const double *u, double *y)
{
    static struct beam_description description;
    static struct beam_model model;
    static struct beam_work work;
    const struct beam_options options = {.dt_s = (float)dt_s, .hold = (enum beam_hold)hold};
    describe(basis, damping, &description);
    int status = beam_assemble(&description, &model);
    if (status == BEAM_OK)
        status = beam_factor(&model, &options, &work, &loaded);
    if (status == BEAM_OK)
        status = beam_plan_check(&loaded);
    beam_reset(&loaded, &state);
    return status != BEAM_OK ? status : shadow_continue(n, u, y);
}

int shadow_poles(int basis, double memory_share, double relaxation_s, double frequency_Hz[BEAM_N], int *n_real)
{
    static struct beam_description description;
    static struct beam_model model;
    static struct beam_work work;
    describe(basis, 1.0, &description);
    int status = beam_assemble(&description, &model);
    if (memory_share > 0.0) {
        model.n_memories = 1;
        model.memory[0].relaxation_s = (float)relaxation_s;
        for (int i = 0; i < BEAM_N; i++)
            for (int j = 0; j < BEAM_N; j++)
                model.memory[0].form[i][j] = (float)memory_share * model.K[i][j];
    }
    if (status == BEAM_OK)
        status = beam_find_poles(&model, &work);
    *n_real = work.poles.n_real;
    for (int k = 0; k < BEAM_N; k++) {
        const double re = (double)work.poles.re[k], im = (double)work.poles.im[k];
        frequency_Hz[k] = sqrt(re * re + im * im) / (2.0 * acos(-1.0));
    }
    return status;
}
