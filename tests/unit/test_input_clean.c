/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A measured input loses its sensor's noise where its drive is not; the drive stays, and so does an input whose noise cannot be told. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "maths/maths.h"
#include "model_fixture.h"
#include "noise/noise.h"
#include "signals.h"

enum { SAMPLES = 4096, BLOW = 300, LINES = 20 };
enum drive { HAMMER, CHIRP, MULTISINE, RANDOM };
static const double dt_s = 1.0 / 1024.0, pi = 3.14159265358979323846;
static const double mode_Hz[4] = {6.6, 38.4, 95.5, 178.7}, damping = 0.003;

static void fill_drive(enum drive kind, double u[])
{
    uint64_t dice = signal_seed(7);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t_s = (double)k * dt_s, taper = sin(pi * ((double)k + 0.5) / SAMPLES);
        u[k] = 0.0;
        if (kind == HAMMER && k >= BLOW && k < BLOW + 4)
            u[k] = sin(pi * ((double)(k - BLOW) + 0.5) / 4.0);
        else if (kind == CHIRP)
            u[k] = taper * sin(2.0 * pi * (2.0 + 0.5 * 50.0 * t_s) * t_s);
        else if (kind == RANDOM)
            u[k] = signal_normal(&dice);
        for (size_t i = 1; kind == MULTISINE && i <= LINES; i++)
            u[k] += taper / LINES * sin(2.0 * pi * 10.0 * (double)i * t_s + (double)(i * i));
    }
}

static void respond(const double u[], double z[])
{
    memset(z, 0, SAMPLES * sizeof *z);
    for (int m = 0; m < 4; m++)
        signal_add_mode(mode_Hz[m], damping, (m % 2 ? -1.0 : 1.0) / (1.0 + m), dt_s, u, SAMPLES, 0.0, z);
}

/* Of the drive with white noise of that rms, beside a channel that is quiet. */
static struct record record_with(enum drive kind, double noise, unsigned seed)
{
    static double u[SAMPLES], z[SAMPLES];
    struct record record = {.n = SAMPLES, .dt_s = dt_s, .path = strdup("case.csv")};
    uint64_t dice = signal_seed(seed);
    fill_drive(kind, u);
    respond(u, z);
    const double quiet = 1e-4 * signal_rms(z, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        z[k] += quiet * signal_normal(&dice);
        u[k] += noise * signal_normal(&dice);
    }
    record_add_column(&record, "hammer_N", u);
    record_add_column(&record, "piezo_V", z);
    return record;
}

static size_t cleaned(struct record *record, struct clean_input *first)
{
    struct model model;
    struct record *const records[1] = {record};
    struct clean_input_list list;
    struct bf_error err;
    fixture_model(&model, "");
    assert_int_equal(inputs_clean(&model, records, 1, &list, &err), BF_OK);
    const size_t n = list.n;
    if (n > 0)
        *first = list.all[0];
    inputs_clean_free(&list);
    model_free(&model);
    return n;
}

/* Rms of what x has beside the drive, and of the answer to that. */
static void beside(enum drive kind, const double x[], double *own, double *answered)
{
    static double u[SAMPLES], d[SAMPLES], e[SAMPLES];
    fill_drive(kind, u);
    for (size_t k = 0; k < SAMPLES; k++)
        d[k] = x[k] - u[k];
    respond(d, e);
    *own = signal_rms(d, SAMPLES), *answered = signal_rms(e, SAMPLES);
}

static double judged(const struct record *record)
{
    struct model model;
    struct noise_estimate noise;
    struct bf_error err;
    fixture_model(&model, "");
    assert_int_equal(noise_of_channel(&model, record, "piezo_V", &noise, &err), BF_OK);
    const double rms = noise.rms;
    noise_free(&noise);
    model_free(&model);
    return rms;
}

/*
 * least: times that the noise of the answer falls at least, rms over draws; within: of the factor to which what is left of it is known. Of a few resonances
 * it is a few amplitudes: the draws' own scatter is a fifth.
 */
static void check_gain(enum drive kind, double least, double within)
{
    enum { DRAWS = 24 };
    double before = 0.0, after = 0.0, known = 0.0;
    for (unsigned draw = 1; draw <= DRAWS; draw++) {
        struct record record = record_with(kind, 0.005, draw);
        struct clean_input found = {0};
        double raw, raw_answer, own, answer, peak = 0.0;
        for (size_t k = 0; k < SAMPLES; k++)
            peak = fmax(peak, fabs(record_column(&record, "hammer_N")[k]));
        beside(kind, record_column(&record, "hammer_N"), &raw, &raw_answer);
        assert_int_equal(cleaned(&record, &found), 1);
        beside(kind, record_column(&record, "hammer_N"), &own, &answer);
        assert_true(fabs(found.noise * peak / raw - 1.0) < 0.1);
        assert_true(fabs(own / raw - sqrt(found.kept)) <
                    0.15); /* what is kept of its power, and what is lost of the drive */
        before += raw_answer * raw_answer, after += answer * answer;
        known += pow(judged(&record), 2.0);
        assert_int_equal(cleaned(&record, &found), 0); /* once is enough */
        record_free(&record);
    }
    print_message("the answer to the noise falls %.1f times; it is judged %.2f times what it is\n",
                  sqrt(before / after), sqrt(known / after));
    assert_true(sqrt(before / after) > least);
    assert_true(fabs(log(known / after)) < 2.0 * log(within));
}

static void a_hammer_rests_between_blows(void **state)
{
    (void)state;
    check_gain(HAMMER, 3.0, 1.5);
}

static void a_sweep_is_at_one_frequency_at_a_time(void **state)
{
    (void)state;
    check_gain(CHIRP, 1.5, 1.5);
}

static void a_multisine_has_lines(void **state)
{
    (void)state;
    check_gain(MULTISINE, 3.0, 2.0);
}

/* Bit by bit: a random drive, a drive without noise, what the record forbids, a steady state. */
static void the_others_stay(void **state)
{
    (void)state;
    static const struct {
        enum drive kind;
        double noise;
        const char *key, *value;
    } cases[] = {{RANDOM, 0.005, NULL, NULL},
                 {HAMMER, 0.0, NULL, NULL},
                 {HAMMER, 0.005, "input_noise", "keep"},
                 {MULTISINE, 0.005, "excitation", "periodic"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        static double before[SAMPLES];
        struct record record = record_with(cases[i].kind, cases[i].noise, 3);
        struct clean_input ignored;
        if (cases[i].key != NULL)
            record_add_meta(&record, cases[i].key, cases[i].value);
        memcpy(before, record_column(&record, "hammer_N"), sizeof before);
        assert_int_equal(cleaned(&record, &ignored), 0);
        assert_memory_equal(before, record_column(&record, "hammer_N"), sizeof before);
        assert_null(record_column_noise(&record, "hammer_N"));
        record_free(&record);
    }
}

/* x·(M y) = y·(M x); nothing grows; what is kept whole comes back. */
static void the_map_is_its_own_transpose(void **state)
{
    (void)state;
    static double x[SAMPLES], y[SAMPLES], a[SAMPLES], b[SAMPLES];
    struct record record = record_with(CHIRP, 0.005, 5);
    struct clean_input found;
    struct bf_error err;
    uint64_t dice = signal_seed(11);
    assert_int_equal(cleaned(&record, &found), 1);
    const struct column_noise *noise = record_column_noise(&record, "hammer_N");
    for (size_t k = 0; k < SAMPLES; k++)
        x[k] = signal_normal(&dice), y[k] = signal_normal(&dice);
    assert_int_equal(input_noise_keep(noise, x, SAMPLES, a, &err), BF_OK);
    assert_int_equal(input_noise_keep(noise, y, SAMPLES, b, &err), BF_OK);
    assert_true(fabs(dense_dot(SAMPLES, a, y) - dense_dot(SAMPLES, b, x)) < 1e-9);
    assert_true(dense_norm(SAMPLES, a) < dense_norm(SAMPLES, x));
    memset(noise->kept, 1, noise->n_segments * (noise->segment / 2 + 1));
    assert_int_equal(input_noise_keep(noise, x, SAMPLES, a, &err), BF_OK);
    for (size_t k = 0; k < SAMPLES; k++)
        assert_true(fabs(a[k] - x[k]) < 1e-12);
    record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hammer_rests_between_blows), cmocka_unit_test(a_sweep_is_at_one_frequency_at_a_time),
        cmocka_unit_test(a_multisine_has_lines),        cmocka_unit_test(the_others_stay),
        cmocka_unit_test(the_map_is_its_own_transpose),
    };
    return cmocka_run_group_tests_name("input_clean", tests, NULL, NULL);
}
