/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Do 95 % intervals contain the truth 95 times of 100? Recordings of the independent simulator (tests/truth), each with
 * its own noise, fitted as a user would, noise levels estimated from the recordings themselves.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include "maths/maths.h"
#include "estimate/estimate.h"
#include "test_files.h"
#include "truth/truth.h"

enum { SETS = 200, FREE = 5 };

static const char *const true_beam[] = {
    "length_m = 0.4573",
    "patch_m = 0.02535 0.08905",
    "EI_beam_Nm2 = 0.491",
    "EI_patch_Nm2 = 0.793",
    "rho_beam_kgpm = 0.093",
    "rho_patch_kgpm = 0.433",
    "cDI_beam_sNm2 = 0.649e-5",
    "cDI_patch_sNm2 = 1.255e-5",
    "gamma_sNpm2 = 0.013",
    "Ks_V = 4682.342",
    "input hammer_N point_force at_m=0.0254",
    "signal hammer_N raised_cosine start_s=0.1 width_s=0.016 level=5",
    "output piezo_V patch_strain",
    "sample_rate_Hz = 256",
    "duration_s = 4",
    "noise = 0.01",
};

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.495}\n"
                                 "  EI_patch_Nm2: {value: 0.78}\n"
                                 "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                                 "  rho_patch_kgpm: {value: 0.43}\n"
                                 "  cDI_beam_sNm2: {value: 0.649e-5, fixed: true}\n"
                                 "  cDI_patch_sNm2: {value: 1.255e-5, fixed: true}\n"
                                 "  gamma_sNpm2: {value: 0.012}\n"
                                 "  Ks_V: {value: 4600}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
                                 "outputs: {piezo_V: {kind: patch_strain}}\n"
                                 "effects: []\n";
static const struct {
    const char *label;
    double truth;
} expected[FREE] = {{"EI_beam_Nm2", 0.491},
                    {"EI_patch_Nm2", 0.793},
                    {"rho_patch_kgpm", 0.433},
                    {"gamma_sNpm2", 0.013},
                    {"Ks_V", 4682.342}};

static void load_model(struct model *model)
{
    struct bf_error err;
    char *path = temporary_file("coverage.yaml", model_text, strlen(model_text));
    assert_int_equal(model_read(path, model, &err), BF_OK);
    unlink(path);
    free(path);
}

static void load_record(const struct truth_record *from, struct record *out)
{
    *out = (struct record){.n = from->n, .dt_s = 1.0 / from->rate_Hz, .path = strdup("simulated.csv")};
    for (size_t c = 0; c < from->n_channels; c++)
        record_add_column(out, from->channel[c].name, from->channel[c].x);
}

/* Adds 1 to inside[i] where the interval of parameter i contains the truth. */
static void count_one(const struct model *model, const struct record *record, size_t inside[FREE])
{
    struct bf_error err = {0};
    struct fit_result result;
    const struct fit_options options = {.start = FIT_NEAR, .quiet = true, .never_search = true};
    if (fit_run(model, record, 1, &options, &result, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_true(result.converged);
    for (size_t i = 0; i < FREE; i++)
        for (size_t j = 0; j < result.n_parameters; j++) {
            const struct fit_parameter *p = &result.parameters[j];
            if (strcmp(p->label, expected[i].label) == 0)
                inside[i] += p->identifiable && p->ci95[0] <= expected[i].truth && expected[i].truth <= p->ci95[1];
        }
    fit_free(&result);
}

static void cover(const char *noise_line)
{
    char message[TRUTH_MESSAGE];
    struct truth_spec spec;
    struct truth_record clean, noisy;
    struct model model;
    size_t inside[FREE] = {0}, all = 0;
    truth_spec_default(&spec);
    for (size_t i = 0; i < sizeof true_beam / sizeof *true_beam; i++)
        if (truth_spec_line(&spec, true_beam[i], message))
            fail_msg("%s", message);
    if (truth_spec_line(&spec, noise_line, message))
        fail_msg("%s", message);
    assert_int_equal(truth_simulate(&spec, &clean, message), 0);
    load_model(&model);
    for (uint64_t set = 0; set < SETS; set++) {
        struct record record;
        truth_measure(&spec, &clean, 1000 + set, &noisy);
        load_record(&noisy, &record);
        count_one(&model, &record, inside);
        record_free(&record);
        truth_record_free(&noisy);
    }
    for (size_t i = 0; i < FREE; i++) {
        print_message("%s: %zu of %d intervals contain the truth\n", expected[i].label, inside[i], SETS);
        all += inside[i];
        assert_in_range(inside[i], 0.90 * SETS, 0.99 * SETS); /* one parameter: ± 3 standard errors of the count */
    }
    print_message("together %.1f %%\n", 100.0 * (double)all / (FREE * SETS));
    assert_in_range(all, 0.92 * FREE * SETS, 0.98 * FREE * SETS);
    truth_record_free(&clean);
    model_free(&model);
}

static void intervals_cover_with_white_noise(void **state)
{
    (void)state;
    cover("noise_ar = 0 0");
}

/* First-order noise: its spectrum is 81 times higher at 0 Hz than at the Nyquist frequency. */
static void intervals_cover_with_coloured_noise(void **state)
{
    (void)state;
    cover("noise_ar = 0.8 0");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(intervals_cover_with_white_noise),
        cmocka_unit_test(intervals_cover_with_coloured_noise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
