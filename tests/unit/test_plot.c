/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <dirent.h>
#include <math.h>
#include <stdbool.h>
#include <sys/stat.h>
#include "show/show.h"
#include "show/plot.h"
#include "show/plot_gnuplot.h"
#include "signals.h"
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
    DIR *d = opendir(directory);
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

/* The first bytes of a file of the place; its size is returned, −1 when it is not there. */
static long start_of(const char *name, char *bytes, size_t n)
{
    char path[700];
    struct stat info;
    (void)snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return -1;
    memset(bytes, 0, n);
    (void)!fread(bytes, 1, n - 1, f);
    (void)fclose(f);
    return stat(path, &info) == 0 ? (long)info.st_size : -1;
}

/* Both pictures are whole, and drawing them again by hand prints nothing: no warning, no empty plot. */
static void check_picture(const char *stem)
{
    char name[200], bytes[16], command[1000], said[400];
    (void)snprintf(name, sizeof name, "%s.png", stem);
    assert_true(start_of(name, bytes, sizeof bytes) > 5000);
    assert_memory_equal(bytes, "\x89PNG", 4);
    (void)snprintf(name, sizeof name, "%s.pdf", stem);
    assert_true(start_of(name, bytes, sizeof bytes) > 3000);
    assert_memory_equal(bytes, "%PDF", 4);
    (void)snprintf(command, sizeof command, "cd '%s' && gnuplot '%s.gp' 2>&1", directory, stem);
    FILE *gnuplot = popen(command, "r");
    assert_non_null(gnuplot);
    const size_t n = fread(said, 1, sizeof said - 1, gnuplot);
    said[n] = '\0';
    assert_int_equal(pclose(gnuplot), 0);
    assert_string_equal(said, "");
}

enum { N = 2000 };
static double measured[N], model[N];

static struct plot_panels some_panels(const char *stem)
{
    uint64_t seed = signal_seed(1);
    for (size_t i = 0; i < N; i++) {
        model[i] = exp(-0.002 * (double)i) * sin(0.3 * (double)i);
        measured[i] = model[i] + 0.01 * signal_normal(&seed);
    }
    return (struct plot_panels){.directory = directory,
                                .stem = stem,
                                .title = "a title",
                                .quantity = "accel_mps2",
                                .n = N,
                                .dt_s = 0.001,
                                .measured = measured,
                                .model = model};
}

static void four_panels(void **state)
{
    (void)state;
    struct bf_error err;
    static const double noise[3] = {1e-7, 2e-7, 1e-7};
    struct plot_panels q = some_panels("panels");
    q.noise_psd = noise;
    q.n_noise = 3;
    assert_int_equal(plot_panels(&q, &err), BF_OK);
    check_picture("panels");
    char text[4000];
    assert_true(start_of("panels.gp", text, sizeof text) > 0);
    assert_contains(text, "accel (m/s²)");
    assert_contains(text, "Frequency (Hz)");
    assert_contains(text, "Time (s)");
    assert_true(start_of("panels-time.dat", text, sizeof text) > 0);
    assert_contains(text, "# time_s measured model\n0 ");
    q = some_panels("chosen");
    q.title = NULL;
    q.t0_s = 5.0;
    q.detail_from_s = 5.2;
    q.detail_to_s = 5.25;
    q.to_Hz = 100.0;
    assert_int_equal(plot_panels(&q, &err), BF_OK);
    check_picture("chosen");
    assert_true(start_of("chosen-samples.dat", text, sizeof text) > 0);
    assert_contains(text, "\n5.2 ");
}

static void silence_and_constants_are_drawn(void **state)
{
    (void)state;
    struct bf_error err;
    struct plot_panels q = some_panels("silent");
    memset(measured, 0, sizeof measured);
    memset(model, 0, sizeof model);
    assert_int_equal(plot_panels(&q, &err), BF_OK);
    check_picture("silent");
    for (size_t i = 0; i < N; i++)
        measured[i] = -3.0;
    q.stem = "constant";
    assert_int_equal(plot_panels(&q, &err), BF_OK);
    check_picture("constant");
    q.n = 3;
    assert_int_equal(plot_panels(&q, &err), BF_NUMERIC);
}

static void names_and_text_stay_what_they_are(void **state)
{
    (void)state;
    struct bf_error err;
    struct plot_panels q = some_panels("../a b;$(touch hacked)'\n.x");
    q.title = "it's 'quoted'; system('touch hacked') # \" `touch hacked` {/Bold x} \n @y \\";
    q.quantity = "x'; system('touch hacked'); y='_V";
    assert_int_equal(plot_panels(&q, &err), BF_OK);
    check_picture("_._a_b___touch_hacked___.x");
    char bytes[8];
    assert_int_equal(start_of("hacked", bytes, sizeof bytes), -1);
    assert_int_equal(access("hacked", F_OK), -1);
}

static void long_records_keep_their_extremes(void **state)
{
    (void)state;
    enum { LONG = 200000 };
    double *z = calloc(LONG, sizeof *z), *y = calloc(LONG, sizeof *y);
    struct bf_error err;
    struct plot_panels q = some_panels("long");
    for (size_t i = 0; i < LONG; i++)
        z[i] = y[i] = sin(0.1 * (double)i);
    z[123457] = 17.25;
    y[54321] = -9.5;
    q.n = LONG;
    q.measured = z;
    q.model = y;
    assert_int_equal(plot_panels(&q, &err), BF_OK);
    check_picture("long");
    char path[400], line[200];
    (void)snprintf(path, sizeof path, "%s/long-time.dat", directory);
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    int rows = 0, high = 0, low = 0;
    while (fgets(line, sizeof line, f) != NULL) {
        rows++;
        high += strstr(line, " 17.25 ") != NULL;
        low += strstr(line, " -9.5\n") != NULL;
    }
    (void)fclose(f);
    assert_true(rows < 10000);
    assert_int_equal(high, 1);
    assert_int_equal(low, 1);
    free(z);
    free(y);
}

static struct plot_residual some_residual(const char *stem)
{
    static double residual[N], autocorrelation[101], correlation[41];
    static const double noise[2] = {1e-6, 1e-6}, edge_Hz[4] = {0.0, 50.0, 120.0, 500.0}, share[3] = {0.1, 0.7, 0.2};
    uint64_t seed = signal_seed(2);
    for (size_t i = 0; i < N; i++)
        residual[i] = 0.01 * signal_normal(&seed);
    for (size_t i = 0; i < 101; i++)
        autocorrelation[i] = i == 0 ? 1.0 : 0.02 * signal_normal(&seed);
    for (size_t i = 0; i < 41; i++)
        correlation[i] = 0.02 * signal_normal(&seed);
    return (struct plot_residual){.directory = directory,
                                  .stem = stem,
                                  .quantity = "piezo_V",
                                  .n = N,
                                  .dt_s = 0.001,
                                  .residual = residual,
                                  .noise_rms = 0.01,
                                  .noise_psd = noise,
                                  .n_noise = 2,
                                  .autocorrelation = autocorrelation,
                                  .n_autocorrelation = 101,
                                  .autocorrelation_bound = 0.044,
                                  .input_correlation = correlation,
                                  .n_lags = 20,
                                  .input_bound = 0.08,
                                  .input_name = "hammer_N",
                                  .edge_Hz = edge_Hz,
                                  .share = share,
                                  .n_bands = 3};
}

static void residual_page(void **state)
{
    (void)state;
    struct bf_error err;
    struct plot_residual q = some_residual("residual");
    assert_int_equal(plot_residual(&q, &err), BF_OK);
    check_picture("residual");
    q.stem = "bare"; /* nothing known but the residual */
    q.noise_rms = 0.0;
    q.noise_psd = NULL;
    q.n_noise = 0;
    q.autocorrelation = q.input_correlation = q.share = NULL;
    assert_int_equal(plot_residual(&q, &err), BF_OK);
    check_picture("bare");
    static const double zero[N];
    q = some_residual("nothing");
    q.residual = zero;
    assert_int_equal(plot_residual(&q, &err), BF_OK);
    check_picture("nothing");
}

static void history_of_models(void **state)
{
    (void)state;
    struct bf_error err;
    const char *const label[4] = {"handbook.yaml", "fitted_1.yaml", "with 'drag'",
                                  "a rather long name of a model.yaml"};
    const double fitted[4] = {0.8, 0.1, NAN, 0.0041}, held_out[4] = {NAN, 0.2, NAN, 0.0045},
                 none[4] = {NAN, NAN, NAN, NAN};
    struct plot_history q = {.directory = directory,
                             .stem = "history",
                             .title = "errors",
                             .n = 4,
                             .label = label,
                             .fitted = fitted,
                             .held_out = held_out,
                             .noise_floor = 0.004};
    assert_int_equal(plot_history(&q, &err), BF_OK);
    check_picture("history");
    q.held_out_floor = 0.006;
    q.stem = "floors";
    assert_int_equal(plot_history(&q, &err), BF_OK);
    check_picture("floors");
    q.held_out_floor = 0.0;
    q.n = 1;
    q.stem = "one";
    q.noise_floor = NAN;
    q.held_out = none;
    assert_int_equal(plot_history(&q, &err), BF_OK);
    check_picture("one");
    q.n = 0;
    assert_int_equal(plot_history(&q, &err), BF_USAGE);
}

static void convergence_lines(void **state)
{
    (void)state;
    struct bf_error err;
    const double x[5] = {10, 20, 40, 80, 160}, a[5] = {1e-2, 1e-3, 1e-4, 1e-5, 0.0},
                 b[5] = {-1.0, NAN, 1e-3, INFINITY, 1e-5};
    const double nothing[5] = {0.0, -1.0, NAN, 0.0, 0.0};
    const struct plot_line lines[3] = {{"mode 1", 5, x, a}, {"it's mode 2", 5, x, b}, {"empty", 5, x, nothing}};
    struct plot_convergence q = {.directory = directory,
                                 .stem = "convergence",
                                 .title = "Convergence",
                                 .x_label = "dimension N",
                                 .y_label = "relative error",
                                 .n_lines = 2,
                                 .lines = lines};
    assert_int_equal(plot_convergence(&q, &err), BF_OK);
    check_picture("convergence");
    q.stem = "linear";
    q.linear_x = q.linear_y = true;
    assert_int_equal(plot_convergence(&q, &err), BF_OK);
    check_picture("linear");
    q.lines = lines + 2;
    q.n_lines = 1;
    q.linear_y = false;
    assert_int_equal(plot_convergence(&q, &err), BF_NUMERIC);
    assert_contains(err.text, "no point");
}

static void missing_gnuplot_leaves_script_and_data(void **state)
{
    (void)state;
    struct bf_error err;
    const char *was = getenv("PATH");
    char *path = strdup(was != NULL ? was : ""), bytes[8];
    struct plot_panels q = some_panels("unseen");
    assert_true(plot_can_draw(NULL));
    assert_int_equal(setenv("PATH", "/nonexistent", 1), 0);
    assert_false(plot_can_draw(NULL));
    const enum bf_status status = plot_panels(&q, &err);
    assert_int_equal(setenv("PATH", path, 1), 0);
    free(path);
    assert_int_equal(status, BF_OK);
    assert_true(start_of("unseen.gp", bytes, sizeof bytes) > 0);
    assert_true(start_of("unseen-time.dat", bytes, sizeof bytes) > 0);
    assert_int_equal(start_of("unseen.png", bytes, sizeof bytes), -1);
}

static void a_directory_that_cannot_be(void **state)
{
    (void)state;
    struct bf_error err;
    char *file = temporary_file("file", "x", 1), below[600];
    struct plot_panels q = some_panels("x");
    (void)snprintf(below, sizeof below, "%s/sub", file);
    q.directory = below;
    assert_int_equal(plot_panels(&q, &err), BF_BAD_FILE);
    assert_contains(err.text, below);
    q.directory = file;
    assert_int_equal(plot_panels(&q, &err), BF_BAD_FILE);
    (void)unlink(file);
    free(file);
}

static void units_of_names(void **state)
{
    (void)state;
    char text[64];
    static const char *const pairs[][2] = {{"piezo_V", "piezo (V)"},
                                           {"accel_mps2", "accel (m/s²)"},
                                           {"tip_left_m", "tip_left (m)"},
                                           {"drive", "drive"},
                                           {"_V", "_V"},
                                           {"a_unit", "a_unit"}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        plot_quantity(pairs[i][0], "", text, sizeof text);
        assert_string_equal(text, pairs[i][1]);
    }
    plot_quantity("accel_mps2", "²/Hz", text, sizeof text);
    assert_string_equal(text, "accel ((m/s²)²/Hz)");
    plot_quantity("piezo_V", "²/Hz", text, sizeof text);
    assert_string_equal(text, "piezo (V²/Hz)");
    assert_true(fabs(plot_tick_step(1.0) - 0.2) < 1e-12 && fabs(plot_tick_step(0.04) - 0.01) < 1e-12);
}

static void scaled_is(const char *name, double largest, const char *label, double factor)
{
    char text[64];
    const double k = plot_scaled(name, largest, text, sizeof text);
    assert_string_equal(text, label);
    assert_true(fabs(k / factor - 1.0) < 1e-12);
}

static void axes_take_prefixes(void **state)
{
    (void)state;
    scaled_is("piezo_V", 0.02, "piezo (mV)", 1e3);
    scaled_is("accel_mps2", 2500.0, "accel (km/s²)", 1e-3);
    scaled_is("tip_m", 3e-6, "tip (µm)", 1e6);
    scaled_is("tip_mm", 3e-6, "tip (mm)", 1.0); /* it has one */
    scaled_is("drive", 1e-3, "drive", 1.0);
    scaled_is("piezo_V", 0.0, "piezo (V)", 1.0);
}

static void decades_have_prefixes(void **state)
{
    (void)state;
    char *text = NULL;
    size_t n = 0;
    FILE *f = open_memstream(&text, &n);
    assert_non_null(f);
    plot_si_logarithmic(f, 'y', 3e-5, 2e1);
    plot_linear(f, 'y');
    assert_int_equal(fclose(f), 0);
    assert_contains(text, "set yrange [3e-05:20]");
    assert_contains(text, "('100 µ' 1e-4, '1 m' 1e-3, '10 m' 1e-2, '100 m' 1e-1, '1' 1e0, '10' 1e1)");
    assert_contains(text, "unset logscale y");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(four_panels),
        cmocka_unit_test(silence_and_constants_are_drawn),
        cmocka_unit_test(names_and_text_stay_what_they_are),
        cmocka_unit_test(long_records_keep_their_extremes),
        cmocka_unit_test(residual_page),
        cmocka_unit_test(history_of_models),
        cmocka_unit_test(convergence_lines),
        cmocka_unit_test(missing_gnuplot_leaves_script_and_data),
        cmocka_unit_test(a_directory_that_cannot_be),
        cmocka_unit_test(units_of_names),
        cmocka_unit_test(axes_take_prefixes),
        cmocka_unit_test(decades_have_prefixes),
    };
    return cmocka_run_group_tests_name("plot", tests, make_place, clear_place);
}
