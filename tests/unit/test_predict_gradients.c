/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Every column of the Jacobian against extrapolated differences of the prediction (Ridders: central differences over a
 * falling step, extrapolated by Neville, with an error estimate of their own). For every effect of the catalogue.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "predict_case.h"
#include "signals.h"

enum { LEVELS = 12, CHANNELS = 3, SAMPLES = 192 };
static const double shrink = 1.4, linear_goal = 1e-8;

/* Worst relative deviation of a channel, and the reference's own error estimate there. */
struct deviation {
    double error, estimate;
};

/* The point of the derivative: linear unknowns, and the sign that their columns have there (a mode has none). */
struct point {
    double *amplitude, *column;
};

/* Real and imaginary column of a mode at the first instant of each channel: later the phases have run apart. */
static bool same_sign(const struct predict_case *c, const struct point *at, size_t pair)
{
    size_t rows = c->out.n_rows, n = rows / CHANNELS;
    double sum = 0.0;
    for (size_t k = pair * rows; k < (pair + 2) * rows && k < c->out.n_nuisance * rows; k += n)
        sum += c->out.nuisance[k] * at->column[k];
    return sum >= 0.0;
}

/* y + Σ amplitude · column. */
static void whole_prediction(const struct predict_case *c, const struct point *at, double y[])
{
    size_t rows = c->out.n_rows;
    memcpy(y, c->out.y, rows * sizeof *y);
    for (size_t k = 0; k < c->out.n_nuisance; k++) {
        const double *column = c->out.nuisance + k * rows;
        double same = same_sign(c, at, k / 2 * 2) ? 1.0 : -1.0;
        for (size_t i = 0; i < rows; i++)
            y[i] += same * at->amplitude[k] * column[i];
    }
}

/* A step may be too large for the model (a law that grows without bound): then a smaller one is taken. */
static bool predict_at(struct predict_case *c, const double direction[], double t, const struct point *at, double y[])
{
    struct bf_error err;
    double *theta = bf_alloc(c->n, sizeof *theta);
    for (size_t i = 0; i < c->n; i++)
        theta[i] = c->theta[i] + t * direction[i];
    enum bf_status status = predictor_run(c->predictor, theta, NULL, &c->out, &err);
    free(theta);
    if (status == BF_OK)
        whole_prediction(c, at, y);
    return status == BF_OK;
}

static double channel_norm(const double a[], const double b[], size_t channel, size_t n)
{
    double sum = 0.0;
    for (size_t i = channel * n; i < (channel + 1) * n; i++)
        sum += (a[i] - (b != NULL ? b[i] : 0.0)) * (a[i] - (b != NULL ? b[i] : 0.0));
    return sqrt(sum);
}

/* best[rows] and its estimated error in each channel (2-norms), improved from a first step h. */
static void ridders(struct predict_case *c, const double direction[], const struct point *at, double h, double best[],
                    double estimate[CHANNELS])
{
    size_t rows = c->out.n_rows, n = rows / CHANNELS;
    double *table = bf_alloc((2 * LEVELS + 2) * rows, sizeof *table), *old = table + LEVELS * rows;
    double *up = old + LEVELS * rows, *down = up + rows;
    size_t level = 0;
    for (size_t step = 0; step < LEVELS; step++, h /= shrink) {
        memcpy(old, table, LEVELS * rows * sizeof *old);
        if (!predict_at(c, direction, h, at, up) || !predict_at(c, direction, -h, at, down)) {
            level = 0;
            continue;
        }
        for (size_t i = 0; i < rows; i++)
            table[i] = (up[i] - down[i]) / (2.0 * h);
        double factor = shrink * shrink;
        for (size_t j = 1; j <= level; j++, factor *= shrink * shrink) {
            double *now = table + j * rows;
            const double *left = now - rows, *before = old + (j - 1) * rows;
            for (size_t i = 0; i < rows; i++)
                now[i] = (factor * left[i] - before[i]) / (factor - 1.0);
            for (size_t ch = 0; ch < CHANNELS; ch++) {
                double e = fmax(channel_norm(now, left, ch, n), channel_norm(now, before, ch, n));
                if (e < estimate[ch]) {
                    estimate[ch] = e;
                    memcpy(best + ch * n, now + ch * n, n * sizeof *best);
                }
            }
        }
        level++;
    }
    free(table);
}

static bool has_kinks(const struct beam_effect *effect)
{
    return effect->law != NULL || effect->drive != NULL;
}

/* Column along a direction against the reference; J and y are of the run at c->theta. */
static struct deviation deviation_along(struct predict_case *c, const double direction[], const double J[],
                                        const double y[], const struct point *at)
{
    size_t rows = c->out.n_rows, n = rows / CHANNELS;
    double *column = bf_alloc(2 * rows, sizeof *column), *best = column + rows, estimate[CHANNELS];
    for (size_t j = 0; j < c->n; j++)
        for (size_t i = 0; i < rows; i++)
            column[i] += direction[j] * J[j * rows + i];
    for (size_t ch = 0; ch < CHANNELS; ch++)
        estimate[ch] = INFINITY;
    ridders(c, direction, at, 0.1, best, estimate);
    if (c->model.n_effects == 1 && has_kinks(c->model.effects[0].effect))
        ridders(c, direction, at, 1e-3, best, estimate); /* inside one piece */
    struct deviation worst = {0.0, 0.0};
    for (size_t ch = 0; ch < CHANNELS; ch++) {
        double size = fmax(channel_norm(best, NULL, ch, n), 1e-5 * channel_norm(y, NULL, ch, n));
        if (!(size > 0.0))
            size = 1.0;
        worst.error = fmax(worst.error, channel_norm(column, best, ch, n) / size);
        worst.estimate = fmax(worst.estimate, estimate[ch] / size);
    }
    free(column);
    return worst;
}

/*
 * A tenth of this is the largest step: enough to change y by a tenth where the parameter's range allows that, because the
 * rounding of y (not of the Jacobian) limits the reference.
 */
static double natural_scale(const struct predict_case *c, size_t i, const double J[], const double y[])
{
    const struct parameter_ref *ref = &c->refs[i];
    size_t rows = c->out.n_rows, n = rows / CHANNELS;
    double scale = INFINITY, size = fabs(c->theta[i]);
    for (size_t ch = 0; ch < CHANNELS; ch++)
        scale = fmin(scale, channel_norm(y, NULL, ch, n) / channel_norm(J + i * rows, NULL, ch, n));
    if (ref->role == ROLE_RESIDUAL)
        return isfinite(scale) ? scale : 1.0;
    if (ref->role == ROLE_EFFECT &&
        c->model.effects[ref->owner].effect->parameters[ref->slot].flags & BEAM_PARAMETER_POSITION)
        return 0.09; /* m: a tenth of it stays inside one element */
    size = size > 0.0 ? size : 1.0;
    return fmin(fmax(scale, size), 9.0 * size);
}

struct summary {
    struct deviation worst;
    char label[160];
    bool refused;
};

static void note(struct summary *s, const struct deviation *d, const char *label)
{
    if (d->error < s->worst.error)
        return;
    s->worst = *d;
    snprintf(s->label, sizeof s->label, "%s", label);
}

/* The Jacobian and y at the case's parameters, copied. */
static void run_at_point(struct predict_case *c, struct point *at, double **J, double **y)
{
    uint64_t seed = signal_seed(7);
    bool *want = bf_alloc(c->n, sizeof *want);
    memset(want, 1, c->n * sizeof *want);
    case_run(c, want);
    size_t rows = c->out.n_rows, unknowns = c->out.n_nuisance;
    at->amplitude = bf_alloc(unknowns, sizeof(double));
    at->column = bf_alloc(unknowns * rows, sizeof(double));
    for (size_t k = 0; k < unknowns; k++)
        at->amplitude[k] = 1e-3 * signal_normal(&seed);
    if (unknowns > 0) {
        predictor_set_nuisance(c->predictor, at->amplitude);
        case_run(c, want);
        memcpy(at->column, c->out.nuisance, unknowns * rows * sizeof(double));
    }
    *J = bf_alloc((c->n + 1) * rows, sizeof(double));
    *y = *J + c->n * rows;
    memcpy(*J, c->out.jacobian, c->n * rows * sizeof(double));
    whole_prediction(c, at, *y);
    free(want);
}

/* Own parameters one by one (or all of them), and one random direction through everything of the beam. */
static struct summary check_case(struct predict_case *c, bool every_parameter)
{
    struct summary s = {.label = ""};
    uint64_t seed = signal_seed(5);
    struct point at;
    double *J, *y, *direction = bf_alloc(c->n, sizeof *direction);
    run_at_point(c, &at, &J, &y);
    for (size_t i = 0; i < c->n; i++) {
        if (!every_parameter && c->refs[i].role != ROLE_EFFECT)
            continue;
        direction[i] = natural_scale(c, i, J, y);
        struct deviation d = deviation_along(c, direction, J, y, &at);
        direction[i] = 0.0;
        note(&s, &d, c->refs[i].label);
    }
    for (size_t i = 0; i < c->n; i++) /* the beam's parameters act through the effect too */
        if (c->refs[i].role < ROLE_RESIDUAL)
            direction[i] = fabs(c->theta[i]) * (2.0 * signal_uniform(&seed) - 1.0);
    struct deviation d = deviation_along(c, direction, J, y, &at);
    note(&s, &d, "all of the beam's");
    free(at.amplitude);
    free(at.column);
    free(J);
    free(direction);
    return s;
}

/* ---- The beam itself ---- */

static void check_beam(enum intersample intersample, const char *effects, bool inputs)
{
    struct predict_options options = {.intersample = intersample, .fine_splines = 24, .modes = 6};
    /* at 1200 Hz no mode stands at the edge of the band, where a free decay gains or loses an unknown */
    struct predict_case c = {.record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, inputs)};
    struct bf_error err;
    fixture_model(&c.model, effects);
    assert_int_equal(case_open(&c, &options, &err), BF_OK);
    struct summary s = check_case(&c, true);
    print_message("  %-28s worst %.2g at %s (reference good to %.1g)\n", inputs ? "beam" : "free decay", s.worst.error,
                  s.label, s.worst.estimate);
    /* with held inputs the acceleration is a small difference of large numbers: y itself is good to 1e-9 only */
    double goal = intersample == INTERSAMPLE_BAND_LIMITED ? linear_goal : 3e-7;
    assert_true(s.worst.estimate < goal);
    assert_true(s.worst.error < goal);
    case_close(&c);
}

static void beam_band_limited(void **state)
{
    (void)state;
    check_beam(INTERSAMPLE_BAND_LIMITED, "", true);
}

static void beam_zero_order_hold(void **state)
{
    (void)state;
    check_beam(INTERSAMPLE_ZERO_ORDER_HOLD, "", true);
}

static void beam_first_order_hold(void **state)
{
    (void)state;
    check_beam(INTERSAMPLE_FIRST_ORDER_HOLD, "", true);
}

static void free_decay_with_a_filter(void **state)
{
    (void)state;
    check_beam(
        INTERSAMPLE_BAND_LIMITED,
        "  - {kind: sensor_highpass, tau_s: 0.1}\n  - {kind: root_compliance, compliance_radpNm: 0.01, loss_s: 3e-5}\n",
        false);
}

/* Effects that meet in one place of the code. */
static void check_together(const char *effects, bool inputs, const char *filter, double goal)
{
    struct predict_options options = {.fine_splines = 24, .modes = 6};
    struct predict_case c = {.record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, inputs)};
    struct bf_error err;
    if (filter != NULL)
        record_add_meta(&c.record, RECORD_FILTER, filter);
    fixture_model(&c.model, effects);
    if (case_open(&c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
    struct summary s = check_case(&c, true);
    print_message("  worst %.2g at %s (reference good to %.1g)\n", s.worst.error, s.label, s.worst.estimate);
    assert_true(s.worst.estimate < goal);
    assert_true(s.worst.error < goal);
    case_close(&c);
}

static void shaken_clamp_with_masses_filters_and_a_shifted_patch(void **state)
{
    (void)state;
    check_together("  - {kind: patch_position, shift_m: 0.004}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: tip_mass, mass_kg: 0.003}\n"
                   "  - {kind: point_mass, mass_kg: 0.002, at_m: {value: 0.3507, fixed: false}}\n"
                   "  - {kind: hysteretic_damping, loss_factor: 0.004}\n"
                   "  - {kind: sensor_highpass, tau_s: 0.05}\n",
                   true, NULL, 3e-8);
}

static void clock_with_drives_filters_signals_and_a_shifted_blow(void **state)
{
    (void)state;
    check_together("  - {kind: clock_error, relative: 0.002}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: drive_saturation, level_V: 20}\n"
                   "  - {kind: input_position, shift_m: 0.004}\n"
                   "  - {kind: sensor_lag, channel: tip_mps, tau_s: 0.0004}\n"
                   "  - {kind: mains_hum, amplitude: 0.2, frequency_Hz: 50, phase_rad: 0.3}\n",
                   true, NULL, 3e-8);
}

static void free_decay_on_a_shaken_clamp_under_a_wrong_clock(void **state)
{
    (void)state;
    check_together("  - {kind: clock_error, relative: 0.002}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: sensor_highpass, tau_s: 0.05}\n",
                   false, NULL, 3e-8);
}

/* Once with the recorder's filter undone and applied again, once without. */
static void clock_with_hum_on_saturated_sensors(void **state)
{
    (void)state;
    const char *effects = "  - {kind: clock_error, relative: 0.002}\n"
                          "  - {kind: sensor_highpass, tau_s: 0.05}\n"
                          "  - {kind: mains_hum, amplitude: 0.2, frequency_Hz: 50, phase_rad: 0.3}\n"
                          "  - {kind: sensor_saturation, channel: piezo_V, level: 1}\n"
                          "  - {kind: sensor_saturation, channel: tip_mps, level: 0.5}\n";
    check_together(effects, true, NULL, 3e-8);
    check_together(effects, true, "Butterworth order 8 at 480 Hz, forward and backward", 3e-8);
}

static void clock_with_a_law(void **state)
{
    (void)state;
    check_together("  - {kind: clock_error, relative: 0.002}\n"
                   "  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: 0.3507}\n",
                   true, NULL, 1e-6);
}

static void law_on_a_shaken_clamp_behind_a_drive(void **state)
{
    (void)state;
    check_together("  - {kind: drive_saturation, level_V: 20}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: input_position, shift_m: 0.004}\n"
                   "  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: 0.3507}\n",
                   true, NULL, 1e-6);
}

static void shifted_patch_with_a_law_on_it(void **state)
{
    (void)state;
    check_together("  - {kind: patch_position, shift_m: 0.004}\n"
                   "  - {kind: coulomb_friction, moment_Nm: 1e-3, velocity_radps: 0.5}\n",
                   true, NULL, 1e-6);
}

/* ---- The catalogue ---- */

/* Values at which every effect acts on this record,and no knot near a place. */
static void strengthen(struct predict_case *c)
{
    struct model_effect *e = &c->model.effects[0];
    double factor = 5.0;
    for (int i = 0; i < e->effect->n_parameters; i++) {
        if (e->effect->parameters[i].flags & BEAM_PARAMETER_POSITION)
            factor = 50.0, e->parameters[i].value = 0.3507; /* the middle of an element of 19.4 mm */
        if (strcmp(e->parameters[i].name, "gap_m") == 0)
            e->parameters[i].value = 1e-5;
    }
    if (e->effect->terms != NULL)
        e->parameters[0].value *= factor; /* so strong that the rounding of y does not limit the reference */
}

static bool open_effect(struct predict_case *c, const char *id, struct bf_error *err)
{
    struct predict_options options = {.fine_splines = 24, .modes = 6, .threads = 1};
    *c = (struct predict_case){.record = case_record("case.csv", SAMPLES, 1.0 / 1024.0, 2.0, true)};
    fixture_model(&c->model, "");
    if (model_add_effect(&c->model, id, "", err) != BF_OK) {
        case_parameters(c);
        return false;
    }
    strengthen(c);
    return case_open(c, &options, err) == BF_OK;
}

/* Some parameter of the effect moves the prediction: an effect that is accepted must act. */
static bool acts(const struct predict_case *c)
{
    double sum = 0.0;
    for (size_t i = 0; i < c->n; i++)
        for (size_t k = 0; c->refs[i].role == ROLE_EFFECT && k < c->out.n_rows; k++)
            sum += fabs(c->out.jacobian[i * c->out.n_rows + k]);
    return sum > 0.0;
}

/* False: the Jacobian is wrong. */
static bool check_effect(struct predict_case *c, const struct beam_effect *effect)
{
    struct bf_error err;
    bool *want = bf_alloc(c->n, sizeof *want);
    memset(want, 1, c->n * sizeof *want);
    enum bf_status status = predictor_run(c->predictor, c->theta, want, &c->out, &err);
    free(want);
    if (status != BF_OK || !acts(c)) {
        print_message("  %-22s %s\n", effect->id, status != BF_OK ? err.text : "does nothing to the prediction");
        return false;
    }
    struct summary s = check_case(c, false);
    double goal = has_kinks(effect) ? fmax(linear_goal, 10.0 * s.worst.estimate) : linear_goal;
    bool good = s.worst.error < goal && s.worst.estimate < 1e-4;
    print_message("  %-22s %-34s %9.1e %9.1e%s\n", effect->id, s.label, s.worst.error, s.worst.estimate,
                  good ? "" : "  <-- wrong");
    return good;
}

static void every_effect(void **state)
{
    (void)state;
    size_t refused = 0, checked = 0, wrong = 0;
    print_message("  %-22s %-34s %9s %9s\n", "effect", "worst parameter", "error", "reference");
    for (int k = 0; k < beam_effects_count; k++) {
        struct predict_case c;
        struct bf_error err = {0};
        if (open_effect(&c, beam_effects[k]->id, &err)) {
            wrong += !check_effect(&c, beam_effects[k]);
            checked++;
        } else {
            assert_true(err.text[0] != '\0');
            print_message("  %-22s refused: %s\n", beam_effects[k]->id, err.text);
            refused++;
        }
        case_close(&c);
    }
    print_message("  %zu effects checked, %zu refused\n", checked, refused);
    assert_int_equal(refused, 0);
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(beam_band_limited),
        cmocka_unit_test(beam_zero_order_hold),
        cmocka_unit_test(beam_first_order_hold),
        cmocka_unit_test(free_decay_with_a_filter),
        cmocka_unit_test(shaken_clamp_with_masses_filters_and_a_shifted_patch),
        cmocka_unit_test(clock_with_drives_filters_signals_and_a_shifted_blow),
        cmocka_unit_test(free_decay_on_a_shaken_clamp_under_a_wrong_clock),
        cmocka_unit_test(clock_with_hum_on_saturated_sensors),
        cmocka_unit_test(clock_with_a_law),
        cmocka_unit_test(law_on_a_shaken_clamp_behind_a_drive),
        cmocka_unit_test(shifted_patch_with_a_law_on_it),
        cmocka_unit_test(every_effect),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
