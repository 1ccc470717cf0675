/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Beams that are not linear: CVODE (BDF, dense Newton). The one file that sees SUNDIALS. */
#include "truth_internal.h"

#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

struct run {
    const struct truth_system *system;
    const struct truth_grid *grid;
    double *const *u;               /* NULL in lock step: `input` holds, and the clamp's motion is worked out */
    double *input;                  /* [n_inputs] at the time asked for */
    double *delayed;                /* [n_laws] */
    double *jacobian;               /* [n_states²] */
    double *history[TRUTH_EFFECTS]; /* rate of a delayed law on the fine grid, [grid.n] */
    size_t history_n;
    int sliding[TRUTH_EFFECTS]; /* +1, −1: the slider of a microslip law moves; 0: it sticks */
};

/* Cubic through four neighbours of x on t0 + i dt; zero before the start. */
static double cubic_at(const double *x, size_t n, double position)
{
    if (position <= 0)
        return x[0];
    size_t i = (size_t)position;
    i = i < 1 ? 1 : i;
    i = i + 3 > n ? n - 3 : i;
    double s = position - (double)i;
    return -s * (s - 1) * (s - 2) / 6 * x[i - 1] + (s + 1) * (s - 1) * (s - 2) / 2 * x[i] -
           (s + 1) * s * (s - 2) / 2 * x[i + 1] + (s + 1) * s * (s - 1) / 6 * x[i + 2];
}

static double delayed_rate(const struct run *run, size_t law, double t_s)
{
    const struct truth_grid *grid = run->grid;
    double position = (t_s - run->system->law[law].p[1] - grid->t0_s) / grid->dt_s;
    if (position <= (double)grid->lead || run->history_n < 4)
        return 0;
    return cubic_at(run->history[law], run->history_n, position);
}

static void derivative(struct run *run, double t_s, const double *x, double *xdot)
{
    const struct truth_system *s = run->system;
    size_t n = s->n_modes, N = s->n_states;
    memset(xdot, 0, N * sizeof *xdot);
    for (size_t j = 0; j < n; j++)
        xdot[j] = s->scale[j] * x[n + j];
    truth_multiply_add(N - n, N, s->A + n * N, x, xdot + n);
    for (size_t k = 0; run->u && k < s->n_inputs; k++)
        if (!s->held[k])
            run->input[k] = cubic_at(run->u[k], 2 * run->grid->n - 1, (t_s - run->grid->t0_s) / run->grid->dt_s * 2);
    if (!run->u)
        run->input[s->n_inputs - 1] = s->base_amplitude_mps2 * sin(s->base_radps * t_s + s->base_phase_rad);
    truth_multiply_add(N - n, s->n_inputs, s->B + n * s->n_inputs, run->input, xdot + n);
    for (size_t k = 0; k < s->n_laws; k++)
        run->delayed[k] = run->history[k] ? delayed_rate(run, k, t_s) : 0;
    truth_laws_add(s, t_s, x, run->delayed, run->sliding, xdot);
}

static int right_side(realtype t_s, N_Vector x, N_Vector xdot, void *user)
{
    derivative(user, t_s, N_VGetArrayPointer(x), N_VGetArrayPointer(xdot));
    return 0;
}

/* SUNDIALS keeps columns; ours are rows. */
static int jacobian(realtype t_s, N_Vector x, N_Vector xdot, SUNMatrix matrix, void *user, N_Vector a, N_Vector b,
                    N_Vector c)
{
    (void)t_s, (void)xdot, (void)a, (void)b, (void)c;
    const struct run *run = user;
    const struct truth_system *s = run->system;
    size_t N = s->n_states;
    memcpy(run->jacobian, s->A, N * N * sizeof(double));
    truth_laws_tangent(s, N_VGetArrayPointer(x), run->sliding, run->jacobian);
    for (size_t j = 0; j < N; j++) {
        double *column = SUNDenseMatrix_Column(matrix, (sunindextype)j);
        for (size_t i = 0; i < N; i++)
            column[i] = run->jacobian[i * N + j];
    }
    return 0;
}

static double law_rate(const struct truth_system *s, size_t law, const double *x)
{
    double rate = 0;
    for (size_t j = 0; j < s->n_modes; j++)
        rate += s->law[law].row[j] * x[s->n_modes + j];
    return rate;
}

/* Zero where a slider changes: sticking, |M| reaches the limit; sliding, the rate turns back. */
static int slider_roots(realtype t_s, N_Vector state, realtype *root, void *user)
{
    (void)t_s;
    const struct run *run = user;
    const struct truth_system *s = run->system;
    const double *x = N_VGetArrayPointer(state);
    for (size_t k = 0; k < s->n_laws; k++) {
        const struct truth_law *law = &s->law[k];
        if (law->kind != TRUTH_MICROSLIP)
            root[k] = 1;
        else if (run->sliding[k])
            root[k] = law_rate(s, k, x) * run->sliding[k];
        else
            root[k] = law->p[1] - fabs(x[law->state]);
    }
    return 0;
}

static void switch_sliders(struct run *run, const int *found, double *x)
{
    const struct truth_system *s = run->system;
    for (size_t k = 0; k < s->n_laws; k++) {
        const struct truth_law *law = &s->law[k];
        if (law->kind != TRUTH_MICROSLIP || !found[k])
            continue;
        double limit = law->p[1], moment = x[law->state];
        if (run->sliding[k]) {
            x[law->state] = moment * (1 - 1e-12); /* inside the limit, so the next root is a new one */
            run->sliding[k] = 0;
        } else if (law_rate(s, k, x) * moment > 0) {
            x[law->state] = copysign(limit, moment);
            run->sliding[k] = moment > 0 ? 1 : -1;
        }
    }
}

struct solver {
    SUNContext context;
    void *memory;
    N_Vector x, tolerance;
    SUNMatrix matrix;
    SUNLinearSolver linear;
};

static void solver_free(struct solver *solver)
{
    if (solver->memory)
        CVodeFree(&solver->memory);
    if (solver->linear)
        SUNLinSolFree(solver->linear);
    if (solver->matrix)
        SUNMatDestroy(solver->matrix);
    if (solver->x)
        N_VDestroy(solver->x);
    if (solver->tolerance)
        N_VDestroy(solver->tolerance);
    if (solver->context)
        SUNContext_Free(&solver->context);
}

/* p and v of a mode are velocities in m√kg/s; a microslip moment counts against its limit. */
static void fill_tolerance(const struct truth_system *s, double relative, double *tolerance)
{
    for (size_t i = 0; i < s->n_states; i++)
        tolerance[i] = 1e-3 * relative;
    for (size_t k = 0; k < s->n_laws; k++)
        if (s->law[k].kind == TRUTH_MICROSLIP)
            tolerance[s->law[k].state] = relative * s->law[k].p[1];
}

/* A blow lasts some samples; a solver at rest must not leap over it, nor over a delay. A live run has no grid: its steps are short. */
static double longest_step(const struct run *run)
{
    double longest_s = 1e-3;
    if (run->grid)
        longest_s = fmin(longest_s, 2.5 * run->grid->dt_s * (double)run->grid->oversampling);
    for (size_t k = 0; run->grid && k < run->system->n_laws; k++)
        if (run->history[k])
            longest_s = fmin(longest_s, run->system->law[k].p[1] - 4 * run->grid->dt_s);
    return longest_s;
}

static int solver_make(struct solver *solver, struct run *run, double t_s, double tolerance, bool sliders)
{
    const struct truth_system *s = run->system;
    sunindextype N = (sunindextype)s->n_states;
    if (SUNContext_Create(NULL, &solver->context) != 0)
        return -1;
    solver->x = N_VNew_Serial(N, solver->context);
    solver->tolerance = N_VNew_Serial(N, solver->context);
    solver->matrix = SUNDenseMatrix(N, N, solver->context);
    solver->linear = SUNLinSol_Dense(solver->x, solver->matrix, solver->context);
    solver->memory = CVodeCreate(CV_BDF, solver->context);
    if (!solver->x || !solver->tolerance || !solver->matrix || !solver->linear || !solver->memory)
        return -1;
    N_VConst(0, solver->x);
    fill_tolerance(s, tolerance, N_VGetArrayPointer(solver->tolerance));
    double longest_s = longest_step(run);
    int bad = CVodeInit(solver->memory, right_side, t_s, solver->x);
    bad |= CVodeSVtolerances(solver->memory, tolerance, solver->tolerance);
    bad |= CVodeSetUserData(solver->memory, run);
    bad |= CVodeSetLinearSolver(solver->memory, solver->linear, solver->matrix);
    bad |= CVodeSetJacFn(solver->memory, jacobian);
    bad |= CVodeSetMaxNumSteps(solver->memory, 1000000);
    bad |= CVodeSetMaxStep(solver->memory, longest_s);
    if (sliders)
        bad |= CVodeRootInit(solver->memory, (int)s->n_laws, slider_roots);
    return bad == 0 ? 0 : -1;
}

/* To t_s, through every change of a slider. Returns a CVODE code. */
static int advance(struct solver *solver, struct run *run, double t_s)
{
    double reached;
    for (;;) {
        int code = CVode(solver->memory, t_s, solver->x, &reached, CV_NORMAL);
        if (code != CV_ROOT_RETURN)
            return code;
        int found[TRUTH_EFFECTS];
        CVodeGetRootInfo(solver->memory, found);
        switch_sliders(run, found, N_VGetArrayPointer(solver->x));
        code = CVodeReInit(solver->memory, reached, solver->x);
        if (code < 0)
            return code;
    }
}

/* Held inputs take the value that they have within the fine step from t_s on. True: one of them jumps. */
static bool take_held(struct run *run, size_t step)
{
    const struct truth_system *s = run->system;
    bool jump = false;
    for (size_t k = 0; k < s->n_inputs; k++) {
        double next = s->held[k] ? run->u[k][2 * step + 1] : run->input[k];
        jump = jump || fabs(next - run->input[k]) > 0;
        run->input[k] = next;
    }
    return jump;
}

static int integrate(struct solver *solver, struct run *run, double *const *y, char message[TRUTH_MESSAGE])
{
    const struct truth_system *s = run->system;
    const struct truth_grid *grid = run->grid;
    double *xdot = truth_array(s->n_states), *out = truth_array(s->n_outputs), *x = N_VGetArrayPointer(solver->x);
    int code = 0;
    for (size_t i = grid->lead; i < grid->n && code >= 0; i++) {
        double t_s = grid->t0_s + (double)i * grid->dt_s;
        if (i > grid->lead) {
            if (take_held(run, i - 1))
                code = CVodeReInit(solver->memory, t_s - grid->dt_s, solver->x);
            code = code < 0 ? code : advance(solver, run, t_s);
        }
        for (size_t k = 0; k < s->n_laws; k++)
            if (run->history[k])
                run->history[k][i] = law_rate(s, k, x);
        run->history_n = i + 1;
        derivative(run, t_s, x, xdot);
        truth_system_observe(s, t_s, x, xdot, out);
        for (size_t k = 0; k < s->n_outputs; k++)
            y[k][i] = out[k];
    }
    free(xdot);
    free(out);
    return code >= 0 ? 0 : truth_fail(message, "CVODE stopped with code %d", code);
}

static bool run_make(struct run *run, const struct truth_system *s, const struct truth_grid *grid, double *const *u)
{
    bool sliders = false;
    *run = (struct run){.system = s, .grid = grid, .u = u};
    run->input = truth_array(s->n_inputs);
    run->delayed = truth_array(TRUTH_EFFECTS);
    run->jacobian = truth_array(s->n_states * s->n_states);
    for (size_t k = 0; k < s->n_laws; k++) {
        sliders = sliders || s->law[k].kind == TRUTH_MICROSLIP;
        if (u && s->law[k].kind == TRUTH_DELAYED_FEEDBACK)
            run->history[k] = truth_array(grid->n);
    }
    return sliders;
}

static void run_free(struct run *run)
{
    free(run->input);
    free(run->delayed);
    free(run->jacobian);
    for (size_t k = 0; k < TRUTH_EFFECTS; k++)
        free(run->history[k]);
}

int truth_solve_ode(const struct truth_system *s, const struct truth_spec *spec, const struct truth_grid *grid,
                    double *const *u, double *const *y, char message[TRUTH_MESSAGE])
{
    struct run run;
    struct solver solver = {0};
    bool sliders = run_make(&run, s, grid, u);
    int status = -1;
    if (solver_make(&solver, &run, grid->t0_s + (double)grid->lead * grid->dt_s, spec->tolerance, sliders) == 0)
        status = integrate(&solver, &run, y, message);
    else
        truth_fail(message, "CVODE cannot be set up");
    solver_free(&solver);
    run_free(&run);
    return status;
}

struct truth_ode {
    struct run run;
    struct solver solver;
    double t_s, *xdot;
};

struct truth_ode *truth_ode_new(const struct truth_system *s, const struct truth_spec *spec,
                                char message[TRUTH_MESSAGE])
{
    struct truth_ode *ode = calloc(1, sizeof *ode);
    if (!ode)
        abort();
    bool sliders = run_make(&ode->run, s, NULL, NULL);
    ode->xdot = truth_array(s->n_states);
    if (solver_make(&ode->solver, &ode->run, 0, spec->tolerance, sliders) == 0)
        return ode;
    truth_fail(message, "CVODE cannot be set up");
    truth_ode_free(ode);
    return NULL;
}

int truth_ode_hold(struct truth_ode *ode, const double *u)
{
    size_t n = ode->run.system->n_inputs - 1;
    if (memcmp(ode->run.input, u, n * sizeof *u) == 0)
        return 0;
    memcpy(ode->run.input, u, n * sizeof *u);
    return CVodeReInit(ode->solver.memory, ode->t_s, ode->solver.x);
}

int truth_ode_advance(struct truth_ode *ode, double t_s, double *y)
{
    double *x = N_VGetArrayPointer(ode->solver.x);
    int code = advance(&ode->solver, &ode->run, t_s);
    ode->t_s = t_s;
    derivative(&ode->run, t_s, x, ode->xdot);
    truth_system_observe(ode->run.system, t_s, x, ode->xdot, y);
    return code < 0 ? code : 0;
}

void truth_ode_free(struct truth_ode *ode)
{
    if (!ode)
        return;
    solver_free(&ode->solver);
    run_free(&ode->run);
    free(ode->xdot);
    free(ode);
}
