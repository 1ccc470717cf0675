/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The pictures of a diagnosis: plot_misfit.c, plot_drift.c, plot_force.c. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <dirent.h>
#include <math.h>
#include "show/show.h"
#include "show/plot.h"
#include "test_files.h"

static char directory[300];

static int make_place(void **state)
{
    (void)state;
    const int n = snprintf(directory, sizeof directory, "%s/pictures", temporary_directory());
    return n > 0 && (size_t)n < sizeof directory ? 0 : -1;
}

static int clear_place(void **state)
{
    (void)state;
    DIR *d = getenv("BEAMFIT_KEEP") == NULL ? opendir(directory) : NULL;
    for (struct dirent *entry = d != NULL ? readdir(d) : NULL; entry != NULL; entry = readdir(d)) {
        char path[700];
        (void)snprintf(path, sizeof path, "%s/%s", directory, entry->d_name);
        (void)unlink(path);
    }
    if (d != NULL)
        (void)closedir(d);
    (void)rmdir(directory);
    remove_temporary_directory();
    return 0;
}

static void check_start(const char *stem, const char *kind, const char *magic)
{
    char path[700], bytes[8] = "";
    (void)snprintf(path, sizeof path, "%s/%s.%s", directory, stem, kind);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    assert_int_equal(fread(bytes, 1, 4, f), 4);
    assert_int_equal(fseek(f, 0, SEEK_END), 0);
    assert_true(ftell(f) > 3000);
    (void)fclose(f);
    assert_memory_equal(bytes, magic, 4);
}

/* Both pictures are whole, and drawing them again by hand prints nothing: no warning, no empty plot. */
static void check_picture(const char *stem)
{
    char command[1000], said[400];
    check_start(stem, "png", "\x89PNG");
    check_start(stem, "pdf", "%PDF");
    (void)snprintf(command, sizeof command, "cd '%s' && gnuplot '%s.gp' 2>&1", directory, stem);
    FILE *gnuplot = popen(command, "r");
    assert_non_null(gnuplot);
    const size_t n = fread(said, 1, sizeof said - 1, gnuplot);
    said[n] = '\0';
    assert_int_equal(pclose(gnuplot), 0);
    assert_string_equal(said, "");
}

enum { BANDS = 6, LEVELS = 9, N = 3000, BINS = 24 };

static struct plot_misfit some_misfit(double band[PLOT_STATES][BANDS], double at[PLOT_STATES][LEVELS])
{
    static const double mode_Hz[BANDS] = {6.1, 36.0, 91.0, 170.0, 288.0, 442.0};
    static double level[LEVELS];
    struct plot_misfit q = {.directory = directory,
                            .title = "Misfit before and after adding tip_mass (verdict: missing)",
                            .n_bands = BANDS,
                            .band_Hz = mode_Hz,
                            .bands_are_modes = true,
                            .n_levels = LEVELS,
                            .level = level};
    for (int k = 0; k < LEVELS; k++)
        level[k] = exp2(-k - 0.5);
    for (int s = 0; s < PLOT_STATES; s++) {
        for (int b = 0; b < BANDS; b++)
            band[s][b] = s < PLOT_AFTER ? 3.0 + 10.0 * b + s : 1.0 + 0.01 * s;
        for (int k = 0; k < LEVELS; k++)
            at[s][k] = s < PLOT_AFTER ? 1.0 + 40.0 * level[k] : 1.0;
        q.band[s] = band[s];
        q.at_level[s] = at[s];
    }
    return q;
}

static void test_misfit(void **state)
{
    (void)state;
    struct bf_error err;
    double band[PLOT_STATES][BANDS], at[PLOT_STATES][LEVELS];
    struct plot_misfit q = some_misfit(band, at);
    q.stem = "misfit";
    assert_int_equal(plot_misfit(&q, &err), BF_OK);
    check_picture("misfit");
}

/* No held-out records, no explanation, a band without noise. */
static void test_misfit_with_parts_missing(void **state)
{
    (void)state;
    struct bf_error err;
    double band[PLOT_STATES][BANDS], at[PLOT_STATES][LEVELS];
    struct plot_misfit q = some_misfit(band, at);
    for (int s = PLOT_BEFORE_HELD_OUT; s < PLOT_STATES; s++) {
        for (int b = 0; b < BANDS; b++)
            band[s][b] = NAN;
        for (int k = 0; k < LEVELS; k++)
            at[s][k] = NAN;
    }
    band[PLOT_BEFORE][2] = NAN;
    q.stem = "misfit_parts";
    assert_int_equal(plot_misfit(&q, &err), BF_OK);
    check_picture("misfit_parts");
    for (int k = 0; k < LEVELS; k++)
        at[PLOT_BEFORE][k] = NAN;
    q.stem = "misfit_bands";
    assert_int_equal(plot_misfit(&q, &err), BF_OK);
    check_picture("misfit_bands");
}

static void test_ranking(void **state)
{
    (void)state;
    struct bf_error err;
    static const struct plot_rank rows[] = {{"tip_mass", 0.994, 0.994, 1.94e8, true},
                                            {"point_mass", 0.996, 1.02, 1.94e8, true},
                                            {"root_compliance + sensor_highpass", 12.1, 15.0, 3.2e5, false},
                                            {"it's 'odd'", 40.0, NAN, -12.0, false},
                                            {"quadratic_drag", 71.0, 88.0, NAN, false},
                                            {"(the model as it is)", 88.8, 90.3, NAN, false}};
    struct plot_ranking q = {
        .directory = directory, .stem = "ranking", .title = "Explanations, verdict: ambiguous", .n = 6, .rows = rows};
    assert_int_equal(plot_ranking(&q, &err), BF_OK);
    check_picture("ranking");
    q.stem = "ranking_one";
    q.n = 1;
    q.rows = &rows[5];
    assert_int_equal(plot_ranking(&q, &err), BF_OK);
    check_picture("ranking_one");
    q.n = 0;
    assert_int_equal(plot_ranking(&q, &err), BF_USAGE);
}

static void test_drift(void **state)
{
    (void)state;
    struct bf_error err;
    double t_s[12], amplitude[12], f_Hz[12], zeta[12], f_sd[12], zeta_sd[12], flat_Hz[12], flat[12];
    for (int k = 0; k < 12; k++) {
        t_s[k] = 0.1 * k;
        amplitude[k] = exp2(-k) * 0.2;
        f_Hz[k] = 36.0 * (1.0 + 0.02 * amplitude[k]);
        zeta[k] = 0.005 + 0.01 * amplitude[k];
        f_sd[k] = 1e-5 / amplitude[k];
        zeta_sd[k] = 1e-6 / amplitude[k];
        flat_Hz[k] = k == 5 ? (double)NAN : 36.05;
        flat[k] = k == 5 ? (double)NAN : 0.006;
    }
    struct plot_drift_curve measured = {.n = 12, .t_s = t_s, .amplitude = amplitude, .amplitude_sd = 1e-6};
    measured.frequency_Hz = f_Hz, measured.frequency_sd_Hz = f_sd;
    measured.damping = zeta, measured.damping_sd = zeta_sd;
    const struct plot_drift_curve
        before = {.n = 12, .t_s = t_s, .amplitude = amplitude, .frequency_Hz = flat_Hz, .damping = flat},
        after = {.n = 12, .t_s = t_s, .amplitude = amplitude, .frequency_Hz = f_Hz, .damping = zeta};
    struct plot_drift_mode modes[PLOT_DRIFT_MODES + 1] = {{"Mode 2, 36 Hz", 1, 1, 1, &measured, &before, &after}};
    struct plot_drift q = {.directory = directory,
                           .stem = "drift",
                           .title = "piezo_V, before and after adding quadratic_drag (verdict: missing)",
                           .quantity = "piezo_V",
                           .n_modes = 1,
                           .modes = modes};
    assert_int_equal(plot_drift(&q, &err), BF_OK);
    check_picture("drift");
    q.stem = "drift_before";
    modes[0].n_after = 0;
    modes[1] = modes[2] = modes[3] = modes[0];
    q.n_modes = 3;
    assert_int_equal(plot_drift(&q, &err), BF_OK);
    check_picture("drift_before");
    q.n_modes = 4;
    assert_int_equal(plot_drift(&q, &err), BF_USAGE);
    q.n_modes = 0;
    assert_int_equal(plot_drift(&q, &err), BF_USAGE);
}

static void test_stabilisation(void **state)
{
    (void)state;
    struct bf_error err;
    static struct stabilisation_pole poles[] = {
        {1, 6.6, 0.002, false, false}, {2, 6.61, 0.003, true, false}, {3, 6.61, 0.003, true, true}};
    static double line_Hz[] = {2.0, 4.0, 6.0, 8.0, 10.0}, magnitude[] = {0.1, 0.2, 1.0, 0.2, 0.0};
    static const double mode_Hz[] = {6.7, 6.75, 41.0};
    const struct stabilisation found = {.modes = 3,
                                        .to_Hz = 10.0,
                                        .n_poles = 3,
                                        .poles = poles,
                                        .n_lines = 5,
                                        .line_Hz = line_Hz,
                                        .magnitude = magnitude};
    struct plot_stabilisation q = {.directory = directory,
                                   .stem = "stabilisation",
                                   .title = "Poles of it's 'free' models",
                                   .found = &found,
                                   .n_modes = 3,
                                   .mode_Hz = mode_Hz};
    assert_int_equal(plot_stabilisation(&q, &err), BF_OK);
    check_picture("stabilisation");
    const struct stabilisation none = {.modes = 3, .to_Hz = 10.0};
    q.found = &none;
    q.n_modes = 0;
    q.stem = "stabilisation_none";
    assert_int_equal(plot_stabilisation(&q, &err), BF_OK);
    check_picture("stabilisation_none");
}

static void test_force(void **state)
{
    (void)state;
    struct bf_error err;
    static double f[N], w[N], v[N], w_bin[BINS], f_of_w[BINS], v_bin[BINS], f_of_v[BINS], size[40], force[40], lines[N];
    static const double mode_Hz[] = {6.1, 36.0};
    for (int k = 0; k < N; k++) {
        const double t = k / 1000.0;
        w[k] = 1e-3 * exp(-t) * sin(40.0 * t);
        v[k] = 40.0 * 1e-3 * exp(-t) * cos(40.0 * t);
        f[k] = 1e7 * w[k] * w[k] * w[k] + 0.1 * v[k];
        lines[k] = 1e-3 / (1.0 + (k - 19) * (k - 19));
    }
    for (int b = 0; b < BINS; b++) {
        w_bin[b] = 1e-3 * (2.0 * b / (BINS - 1) - 1.0);
        f_of_w[b] = b == 3 ? (double)NAN : 1e7 * w_bin[b] * w_bin[b] * w_bin[b];
        v_bin[b] = 40.0 * w_bin[b];
        f_of_v[b] = 0.1 * v_bin[b];
    }
    for (int k = 0; k < 40; k++) {
        size[k] = 1e-3 * exp2(-0.2 * k);
        force[k] = 3e6 * size[k] * size[k] * size[k];
    }
    const struct plot_force q = {.directory = directory,
                                 .stem = "force",
                                 .title = "Missing force at x = 0.457 m",
                                 .force = "Force (N)",
                                 .displacement = "Displacement (m)",
                                 .velocity = "Velocity (m/s)",
                                 .n = N,
                                 .f = f,
                                 .w = w,
                                 .v = v,
                                 .n_bins = BINS,
                                 .w_bin = w_bin,
                                 .f_of_w = f_of_w,
                                 .v_bin = v_bin,
                                 .f_of_v = f_of_v,
                                 .n_sizes = 40,
                                 .size_w = size,
                                 .size_f = force,
                                 .n_lines = N,
                                 .df_Hz = 1.0 / 3.0,
                                 .spectrum = lines,
                                 .n_modes = 2,
                                 .mode_Hz = mode_Hz};
    assert_int_equal(plot_force(&q, &err), BF_OK);
    check_picture("force");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_misfit),        cmocka_unit_test(test_misfit_with_parts_missing),
        cmocka_unit_test(test_ranking),       cmocka_unit_test(test_drift),
        cmocka_unit_test(test_stabilisation), cmocka_unit_test(test_force)};
    return cmocka_run_group_tests(tests, make_place, clear_place);
}
