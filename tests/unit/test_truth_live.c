/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The truth simulator in lock step: against its batch mode with a held drive, its converters, its socket. */
#include "truth_rig.h"

#include <pthread.h>
#include <stdatomic.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { TICKS = 400 };

static void patch_rig(struct truth_spec *spec)
{
    truth_spec_default(spec);
    spec->modes = 16;
    say(spec, "sample_rate_Hz = 1000");
    say(spec, "filter_order = 0");
    say(spec, "input drive_V patch_moment");
    say(spec, "output piezo_V patch_strain");
    say(spec, "live drive_per_code=0.01 sensor_per_code=0.005");
}

/* A drive that jumps, rests and swings. */
static uint16_t code_at(int k)
{
    if (k < 20)
        return 2048;
    return (uint16_t)(2048 + (k < 40 ? 1000 : 0) + (int)lround(800 * sin(0.001 * k * k)));
}

static struct truth_plant *plant(const struct truth_spec *spec)
{
    char message[TRUTH_MESSAGE] = "";
    struct truth_plant *p = truth_plant_new(spec, message);
    if (!p)
        fail_msg("%s", message);
    return p;
}

static uint16_t tick(struct truth_plant *p, uint16_t drive_code)
{
    char message[TRUTH_MESSAGE] = "";
    uint16_t sensor_code = 0;
    if (truth_plant_tick(p, drive_code, &sensor_code, message) != 0)
        fail_msg("%s", message);
    return sensor_code;
}

/* rms(live − batch) / rms(batch) for the same held drive. */
static double difference_from_batch(struct truth_spec *spec)
{
    double u[TICKS], live[TICKS] = {0}, difference = 0, size = 0;
    struct truth_plant *p = plant(spec);
    for (int k = 0; k < TICKS; k++)
        u[k] = (code_at(k) - 2048) * spec->live.drive_per_code;
    for (int k = 0; k + 1 < TICKS; k++) {
        tick(p, code_at(k));
        live[k + 1] = truth_plant_sensor(p);
    }
    truth_plant_free(p);
    spec->duration_s = TICKS / spec->sample_rate_Hz;
    spec->n_signals = 1;
    spec->signal[0] = (struct truth_signal){.kind = TRUTH_HELD, .level = 1, .samples = u, .n_samples = TICKS};
    struct truth_record batch = run(spec);
    const double *y = truth_record_channel(&batch, spec->output[0].name);
    assert_int_equal(batch.n, TICKS);
    for (int k = 0; k < TICKS; k++) {
        difference += (live[k] - y[k]) * (live[k] - y[k]);
        size += y[k] * y[k];
    }
    truth_record_free(&batch);
    assert_true(size > 0);
    return sqrt(difference / size);
}

static void test_linear_beam_agrees_with_batch(void **state)
{
    (void)state;
    struct truth_spec spec;
    patch_rig(&spec);
    assert_true(difference_from_batch(&spec) < 1e-11);
}

static void test_whole_chain_agrees_with_batch(void **state)
{
    (void)state;
    struct truth_spec spec;
    patch_rig(&spec);
    say(&spec, "filter_order = 8");
    say(&spec, "filter_causal = 1");
    say(&spec, "effect drive_hysteresis share=0.2");
    say(&spec, "effect drive_saturation level_V=15");
    say(&spec, "effect base_motion amplitude_mps2=0.3");
    say(&spec, "effect feedthrough gain=0.01");
    say(&spec, "effect sensor_highpass tau_s=0.05");
    say(&spec, "effect sensor_lag tau_s=0.0005");
    say(&spec, "effect sensor_saturation level=4");
    assert_true(difference_from_batch(&spec) < 1e-10);
}

static void test_accelerometer_is_read_before_the_drive_jumps(void **state)
{
    (void)state;
    struct truth_spec spec;
    patch_rig(&spec);
    spec.n_outputs = 0;
    say(&spec, "output accel_mps2 acceleration at_m=0.06");
    say(&spec, "effect mains_hum amplitude=0.1");
    assert_true(difference_from_batch(&spec) < 1e-10);
}

/* Both run CVODE at 1e-6; exact modes are the reference. */
static void test_cvode_agrees_with_exact_modes(void **state)
{
    (void)state;
    struct truth_spec spec;
    double exact[TICKS], difference = 0, size = 0;
    patch_rig(&spec);
    spec.modes = 8;
    struct truth_plant *p = plant(&spec);
    for (int k = 0; k < TICKS / 4; k++) {
        tick(p, code_at(k));
        exact[k] = truth_plant_sensor(p);
    }
    truth_plant_free(p);
    say(&spec, "force_ode = 1");
    say(&spec, "tolerance = 1e-7");
    p = plant(&spec);
    for (int k = 0; k < TICKS / 4; k++) {
        tick(p, code_at(k));
        difference += (truth_plant_sensor(p) - exact[k]) * (truth_plant_sensor(p) - exact[k]);
        size += exact[k] * exact[k];
    }
    truth_plant_free(p);
    assert_true(size > 0 && sqrt(difference / size) < 1e-4);
}

static void test_nonlinear_beam_agrees_with_batch(void **state)
{
    (void)state;
    struct truth_spec spec;
    patch_rig(&spec);
    spec.modes = 6;
    say(&spec, "sample_rate_Hz = 500");
    say(&spec, "tolerance = 1e-6");
    say(&spec, "effect cubic_stiffness coefficient_Npm3=1e5");
    say(&spec, "effect microslip stiffness_Nmprad=5 slip_Nm=1e-3");
    assert_true(difference_from_batch(&spec) < 1e-5);
}

static void test_converters(void **state)
{
    (void)state;
    struct truth_spec spec;
    patch_rig(&spec);
    say(&spec, "live sensor_per_code=0.001 sensor_zero_code=1000 code_max=1200");
    struct truth_plant *p = plant(&spec);
    assert_int_equal(tick(p, 2048), 1000);
    bool top = false, bottom = false;
    for (int k = 0; k < TICKS; k++) {
        uint16_t code = tick(p, k % 100 < 50 ? 0 : 4095);
        double wanted = 1000 + truth_plant_sensor(p) / 0.001;
        top = top || code == 1200;
        bottom = bottom || code == 0;
        assert_true(code <= 1200 && (wanted < 0 || wanted > 1200 || fabs(code - wanted) <= 0.5 + 1e-9));
    }
    assert_true(top && bottom);
    truth_plant_free(p);
}

static void test_noise_repeats_with_its_seed(void **state)
{
    (void)state;
    struct truth_spec spec;
    patch_rig(&spec);
    say(&spec, "live noise_rms=0.05");
    struct truth_plant *a = plant(&spec), *b = plant(&spec);
    spec.seed = 2;
    struct truth_plant *c = plant(&spec);
    double square = 0;
    int differs = 0;
    for (int k = 0; k < 2000; k++) {
        int code = tick(a, 2048);
        assert_int_equal(tick(b, 2048), code);
        differs += tick(c, 2048) != code;
        square += (code - 2048) * (code - 2048);
    }
    near(sqrt(square / 2000), 10, 0.08); /* 0.05 V are 10 codes */
    assert_true(differs > 1000);
    truth_plant_free(a);
    truth_plant_free(b);
    truth_plant_free(c);
}

static void test_what_lock_step_cannot_do_is_refused(void **state)
{
    (void)state;
    static const char *const bad[] = {"filter_order = 8", "effect sensor_delay delay_s=1e-3",
                                      "effect delayed_feedback gain_Nspm=0.1"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char message[TRUTH_MESSAGE] = "";
        struct truth_spec spec;
        patch_rig(&spec);
        say(&spec, bad[i]);
        assert_null(truth_plant_new(&spec, message));
        assert_non_null(strstr(message, "lock step"));
    }
    char message[TRUTH_MESSAGE];
    struct truth_spec spec;
    truth_spec_default(&spec);
    assert_null(truth_plant_new(&spec, message));
    assert_int_equal(truth_spec_line(&spec, "live code_max=70000", message), -1);
    assert_int_equal(truth_spec_line(&spec, "live colour=3", message), -1);
}

/* ---- the socket ---- */

static atomic_bool ended;

static bool has_ended(void)
{
    return ended;
}

struct server {
    struct truth_plant *plant;
    char path[64];
    int status;
};

static void *serve(void *argument)
{
    struct server *server = argument;
    char message[TRUTH_MESSAGE];
    server->status = truth_plant_serve(&server->plant, server->path, has_ended, message);
    return NULL;
}

static int connect_to(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    memcpy(address.sun_path, path, strlen(path));
    for (int tries = 0; tries < 1000; tries++) {
        int fd = socket(AF_UNIX, SOCK_STREAM, 0);
        if (connect(fd, (const struct sockaddr *)&address, sizeof address) == 0)
            return fd;
        close(fd);
        usleep(5000);
    }
    fail_msg("nobody listens at %s", path);
    return -1;
}

static int exchange(int fd, uint16_t code)
{
    const uint8_t request[4] = {0x42, 0x50, (uint8_t)(code & 0xFF), (uint8_t)(code >> 8)};
    uint8_t answer[2];
    for (size_t i = 0; i < sizeof request; i++) /* byte by byte: a request may come in pieces */
        assert_int_equal(send(fd, request + i, 1, MSG_NOSIGNAL), 1);
    if (recv(fd, answer, sizeof answer, MSG_WAITALL) != sizeof answer)
        return -1;
    return answer[0] | answer[1] << 8;
}

static void test_socket_goes_on_for_the_next_controller(void **state)
{
    (void)state;
    struct truth_spec spec;
    struct server server = {.path = "/tmp/beam_truth_XXXXXX"};
    pthread_t thread;
    patch_rig(&spec);
    struct truth_plant *twin = plant(&spec);
    server.plant = plant(&spec);
    assert_non_null(mkdtemp(server.path));
    char directory[64];
    memcpy(directory, server.path, sizeof directory);
    strcat(server.path, "/plant");
    ended = false;
    assert_int_equal(pthread_create(&thread, NULL, serve, &server), 0);
    int fd = connect_to(server.path);
    for (int k = 0; k < 50; k++)
        assert_int_equal(exchange(fd, code_at(k)), tick(twin, code_at(k)));
    close(fd);
    fd = connect_to(server.path); /* the beam swings on from where it was */
    for (int k = 50; k < 100; k++)
        assert_int_equal(exchange(fd, code_at(k)), tick(twin, code_at(k)));
    const uint8_t nonsense[4] = {1, 2, 3, 4};
    uint8_t byte;
    assert_int_equal(send(fd, nonsense, 4, MSG_NOSIGNAL), 4);
    assert_int_equal(recv(fd, &byte, 1, 0), 0);
    close(fd);
    ended = true;
    pthread_join(thread, NULL);
    assert_int_equal(server.status, 0);
    assert_int_equal(access(server.path, F_OK), -1);
    rmdir(directory);
    truth_plant_free(server.plant);
    truth_plant_free(twin);
}

static void test_a_file_at_the_path_is_left_alone(void **state)
{
    (void)state;
    struct truth_spec spec;
    char message[TRUTH_MESSAGE] = "", path[] = "/tmp/beam_truth_XXXXXX";
    patch_rig(&spec);
    struct truth_plant *p = plant(&spec);
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    assert_int_equal(truth_plant_serve(&p, path, has_ended, message), -1);
    assert_non_null(strstr(message, "another file"));
    assert_int_equal(access(path, F_OK), 0);
    unlink(path);
    truth_plant_free(p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_linear_beam_agrees_with_batch),
        cmocka_unit_test(test_whole_chain_agrees_with_batch),
        cmocka_unit_test(test_accelerometer_is_read_before_the_drive_jumps),
        cmocka_unit_test(test_cvode_agrees_with_exact_modes),
        cmocka_unit_test(test_nonlinear_beam_agrees_with_batch),
        cmocka_unit_test(test_converters),
        cmocka_unit_test(test_noise_repeats_with_its_seed),
        cmocka_unit_test(test_what_lock_step_cannot_do_is_refused),
        cmocka_unit_test(test_socket_goes_on_for_the_next_controller),
        cmocka_unit_test(test_a_file_at_the_path_is_left_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
