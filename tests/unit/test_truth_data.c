/* SPDX-License-Identifier: GPL-3.0-or-later */
/* data/: what is committed is what SHA256SUMS says, what its spec files make, and what the program reads. */
#include "ground/ground.h"
#include "model/model.h"
#include "record/record.h"
#include "truth/truth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const experiments[] = {"b1tapih", "b1taoiv"};

static const char *top(void)
{
    const char *path = getenv("TOP");
    return path ? path : ".";
}

static void path_of(char path[512], const char *name, const char *suffix)
{
    snprintf(path, 512, "%s/data/%s%s", top(), name, suffix);
}

static void test_checksums(void **state)
{
    (void)state;
    char path[512], line[256], wanted[65], name[128], found[65];
    struct bf_error err;
    size_t n = 0;
    path_of(path, "SHA256SUMS", "");
    FILE *sums = fopen(path, "r");
    assert_non_null(sums);
    for (; fgets(line, sizeof line, sums); n++) {
        assert_int_equal(sscanf(line, "%64s %127s", wanted, name), 2);
        path_of(path, name, "");
        assert_int_equal(hash_file(path, found, &err), BF_OK);
        assert_string_equal(found, wanted);
    }
    fclose(sums);
    assert_int_equal(n, 2);
}

/* Other processors round differently: two steps of the ADC are allowed, and no more than a few samples use them. */
static void test_specs_make_the_records(void **state)
{
    (void)state;
    for (size_t e = 0; e < 2; e++) {
        char path[512], name[64], message[TRUTH_MESSAGE] = "";
        struct truth_spec spec;
        struct truth_record clean, made;
        struct record committed;
        struct bf_error err;
        snprintf(name, sizeof name, "paper/%s", experiments[e]);
        path_of(path, name, ".txt");
        truth_spec_default(&spec);
        if (truth_spec_read(&spec, path, message) != 0 || truth_simulate(&spec, &clean, message) != 0)
            fail_msg("%s", message);
        truth_measure(&spec, &clean, spec.seed, &made);
        path_of(path, name, ".csv");
        assert_int_equal(record_read(path, &committed, &err), BF_OK);
        assert_int_equal(committed.n, made.n);
        assert_int_equal(committed.n_columns, made.n_channels);
        for (size_t c = 0; c < made.n_channels; c++) {
            const double *x = record_column(&committed, made.channel[c].name);
            double largest = 0;
            size_t different = 0;
            assert_non_null(x);
            for (size_t i = 0; i < made.n; i++)
                largest = fmax(largest, fabs(x[i]));
            for (size_t i = 0; i < made.n; i++) {
                double off = fabs(x[i] - made.channel[c].x[i]) / (1.1 * largest / 32768);
                assert_true(off < 2.01);
                different += off > 0.01 ? 1 : 0;
            }
            assert_true(different < made.n / 50);
        }
        truth_record_free(&clean);
        truth_record_free(&made);
        record_free(&committed);
    }
}

/* No aliasing and no grid of the simulator in the records: the sampled input explains the sampled output. */
static void test_recorded_inputs_explain_the_outputs(void **state)
{
    (void)state;
    for (size_t e = 0; e < 2; e++) {
        char path[512], name[64], message[TRUTH_MESSAGE] = "";
        struct truth_spec spec;
        struct truth_record direct, again;
        snprintf(name, sizeof name, "paper/%s", experiments[e]);
        path_of(path, name, ".txt");
        truth_spec_default(&spec);
        if (truth_spec_read(&spec, path, message) != 0 || truth_simulate(&spec, &direct, message) != 0)
            fail_msg("%s", message);
        spec.filter_order = 0; /* the recorded input has been through it */
        spec.n_signals = 1;
        spec.signal[0] = (struct truth_signal){
            .kind = TRUTH_RECORDED, .level = 1, .samples = direct.channel[0].x, .n_samples = direct.n};
        if (truth_simulate(&spec, &again, message) != 0)
            fail_msg("%s", message);
        double difference = 0, size = 0;
        for (size_t i = 0; i < direct.n; i++) {
            double x = direct.channel[1].x[i], y = again.channel[1].x[i];
            difference += (x - y) * (x - y);
            size += x * x;
        }
        if (!(sqrt(difference / size) < 5e-4))
            fail_msg("%s: %g of the output is not explained", name, sqrt(difference / size));
        truth_record_free(&direct);
        truth_record_free(&again);
    }
}

static void test_start_models_fit_the_records(void **state)
{
    (void)state;
    for (size_t e = 0; e < 2; e++) {
        char path[512], name[64];
        struct model model;
        struct record record;
        struct bf_error err;
        snprintf(name, sizeof name, "paper/%s", experiments[e]);
        path_of(path, name, ".yaml");
        if (model_read(path, &model, &err) != BF_OK)
            fail_msg("%s: %s", path, err.text);
        path_of(path, name, ".csv");
        assert_int_equal(record_read(path, &record, &err), BF_OK);
        assert_non_null(record_meta(&record, "provenance"));
        assert_non_null(record_meta(&record, "units"));
        for (size_t c = 0; c < model.n_inputs; c++)
            assert_non_null(record_column(&record, model.inputs[c].name));
        for (size_t c = 0; c < model.n_outputs; c++)
            assert_non_null(record_column(&record, model.outputs[c].name));
        record_free(&record);
        model_free(&model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_checksums),
        cmocka_unit_test(test_specs_make_the_records),
        cmocka_unit_test(test_recorded_inputs_explain_the_outputs),
        cmocka_unit_test(test_start_models_fit_the_records),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
