/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The page without curves: its verdict, its numbers, names that would like to be markup. The whole: tests/system. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "compare_rig.h"
#include "show/report_page.h"
#include "show/report_verdict.h"

/* A comparison of records with `noise` in their data, at a model that is `stiffer` than the truth. */
struct rig {
    struct model model;
    struct record records[2];
    struct comparison comparison;
    struct modes modes;
    struct history history;
    struct report report;
};

static void rig_begin(struct rig *rig, const char *first, const char *second, double noise, double stiffer)
{
    struct bf_error err;
    *rig = (struct rig){.model = read_model()};
    for (int i = 0; i < 2; i++) {
        rig->records[i] = hit_record(i == 0 ? first : second);
        make_truth(&rig->model, &rig->records[i], noise, 60 + (unsigned)i);
    }
    rig->model.materials[0].EI.value *= stiffer;
    rig->comparison = run(&rig->model, rig->records, 2, 1);
    if (modes_compute(&rig->model, 3, 0.0, 2, &rig->modes, &err) != BF_OK)
        fail_msg("%s", err.text);
    rig->report = (struct report){
        .model = &rig->model, .comparison = &rig->comparison, .modes = &rig->modes, .history = &rig->history};
}

static void rig_end(struct rig *rig)
{
    modes_free(&rig->modes);
    compare_free(&rig->comparison);
    for (int i = 0; i < 2; i++)
        record_free(&rig->records[i]);
    model_free(&rig->model);
}

static char *page_of(const struct rig *rig)
{
    char *text = NULL;
    size_t n = 0;
    FILE *f = open_memstream(&text, &n);
    assert_non_null(f);
    report_write(&rig->report, f);
    assert_int_equal(fclose(f), 0);
    return text;
}

static size_t count(const char *text, const char *part)
{
    size_t n = 0;
    for (const char *at = strstr(text, part); at != NULL; at = strstr(at + 1, part))
        n++;
    return n;
}

static void a_good_model_needs_nothing(void **state)
{
    (void)state;
    struct rig rig;
    char verdict[REPORT_TEXT];
    rig_begin(&rig, "tap1.csv", "tap2.csv", 0.01, 1.0);
    report_verdict(&rig.report, verdict);
    assert_contains(verdict, "times the noise");
    assert_contains(verdict, "1 compared record, and"); /* the model was not fitted to it */
    assert_contains(verdict, "1 held-out record: nothing");
    assert_null(strstr(verdict, "diagnose"));
    assert_false(report_leaves_more(&rig.report));
    rig_end(&rig);
}

static void a_bad_model_is_sent_to_diagnose(void **state)
{
    (void)state;
    struct rig rig;
    char verdict[REPORT_TEXT], number[40];
    rig_begin(&rig, "tap1.csv", "tap2.csv", 0.01, 1.05);
    report_verdict(&rig.report, verdict);
    (void)snprintf(number, sizeof number, "leaves %.3g times the noise", rig.comparison.noise_ratio);
    assert_contains(verdict, number);
    (void)snprintf(number, sizeof number, "and %.3g times the noise", rig.comparison.check_noise_ratio);
    assert_contains(verdict, number);
    assert_contains(verdict, "`beamfit diagnose`");
    assert_true(report_leaves_more(&rig.report));
    char *page = page_of(&rig);
    assert_contains(page, "<code>beamfit diagnose</code>");
    assert_contains(page, "say nothing of what it lacks");
    free(page);
    rig_end(&rig);
}

/* One bad channel among good ones is not averaged away. */
static void the_worst_channel_decides(void **state)
{
    (void)state;
    struct rig rig;
    char verdict[REPORT_TEXT];
    rig_begin(&rig, "tap1.csv", "tap2.csv", 0.01, 1.0);
    rig.comparison.noise_ratio = rig.comparison.check_noise_ratio = 1.0;
    for (size_t i = 0; i < rig.comparison.n_channels; i++)
        rig.comparison.channels[i].noise_ratio = i == 1 ? 1.4 : 0.99;
    report_verdict(&rig.report, verdict);
    assert_contains(verdict, "at most 1.4 times, in tip_mps of tap1.csv");
    assert_contains(verdict, "`beamfit diagnose`");
    for (size_t i = 0; i < rig.comparison.n_channels; i++)
        rig.comparison.channels[i].noise_ratio = (double)NAN;
    rig.comparison.noise_ratio = (double)NAN;
    report_verdict(&rig.report, verdict);
    assert_contains(verdict, "whose noise could not be told");
    assert_contains(verdict, "open whether more than noise is left");
    rig_end(&rig);
}

static const char hostile[] = "<script>alert('x')</script>&\"<img src=x onerror=y>.csv";

static void hostile_names_stay_text(void **state)
{
    (void)state;
    struct rig rig;
    rig_begin(&rig, hostile, "b.csv", 0.01, 1.05);
    rig.report.title = "</title><script>steal()</script>";
    (void)snprintf(rig.model.outputs[0].name, MODEL_NAME, "<b>&amp;_V"); /* what a column may be called */
    (void)snprintf(rig.model.regions[0].name, MODEL_NAME, "<i>'\"");
    (void)snprintf(rig.model.materials[0].EI.name, MODEL_NAME, "EI_<u>_Nm2");
    free(rig.model.path);
    rig.model.path = strdup("<s>model</s>.yaml");
    (void)snprintf(rig.comparison.channels[0].warning, sizeof rig.comparison.channels[0].warning, "<em>'units'</em>");
    char *page = page_of(&rig);
    static const char *const never[] = {"<script", "<img", "<b>&amp;_V", "<i>", "<u>", "<s>", "<em>", "onerror=y>"};
    for (size_t i = 0; i < sizeof never / sizeof *never; i++)
        if (strstr(page, never[i]) != NULL)
            fail_msg("'%s' is in the page as markup", never[i]);
    assert_contains(page, "&lt;/title&gt;&lt;script&gt;steal()");
    assert_contains(page, "&lt;img src=x onerror=y&gt;");
    assert_contains(page, "&lt;em&gt;&#39;units&#39;&lt;/em&gt;");
    assert_contains(page, "EI_&lt;u&gt;_Nm2");
    assert_int_equal(count(page, "<h1>"), 1);
    assert_int_equal(count(page, "<table"), count(page, "</table>"));
    free(page);
    rig_end(&rig);
}

/* What the command line calls held out is held against what the file says of its fit. */
static void a_check_record_that_was_fitted_is_said(void **state)
{
    (void)state;
    struct rig rig;
    rig_begin(&rig, "tap1.csv", "tap2.csv", 0.01, 1.0);
    for (int i = 0; i < 2; i++)
        (void)snprintf(rig.records[i].sha256, 65, "%064d", i + 1);
    struct fit_record records[2] = {{.file = "tap1.csv"}, {.file = "tap2.csv", .held_out = true}};
    memcpy(records[0].sha256, rig.records[0].sha256, 65);
    memcpy(records[1].sha256, rig.records[1].sha256, 65);
    rig.model.fit = (struct fit_info){.present = true, .converged = true, .n_records = 2, .records = records};
    assert_string_equal(report_group(&rig.report), "fitted");
    char *page = page_of(&rig);
    assert_int_equal(count(page, "class=\"warning\""), 0);
    assert_contains(page, "all fitted records");
    free(page);
    records[1].held_out = false;
    page = page_of(&rig);
    assert_contains(page, "tap2.csv is called held out here, but the model was fitted to it");
    free(page);
    records[1].held_out = records[0].held_out = true;
    page = page_of(&rig);
    assert_contains(page, "tap1.csv is not among the records that this model was fitted to");
    assert_contains(page, "all compared records");
    free(page);
    rig.model.fit.converged = false;
    page = page_of(&rig);
    assert_contains(page, "did not converge");
    free(page);
    rig.model.fit = (struct fit_info){0};
    rig_end(&rig);
}

static void parameters_say_how_they_are_known(void **state)
{
    (void)state;
    struct rig rig;
    rig_begin(&rig, "tap1.csv", "tap2.csv", 0.01, 1.0);
    rig.model.fit.present = rig.model.fit.converged = true;
    rig.model.materials[0].EI.value = 0.4908;
    rig.model.materials[0].EI.sd = 0.0213;
    rig.model.materials[0].EI.prior = 0.03;
    rig.model.materials[0].EI.prior_value = 0.485;
    rig.model.materials[0].rho.fixed = true;
    rig.model.materials[0].cDI.sd = 2.5e-7;
    char *page = page_of(&rig);
    assert_contains(page, "0.491</data></td><td class=\"n\"><data value=\"0.021299999999999999\">± 0.021</data>");
    assert_contains(page, "fitted; prior 0.485 N·m² ± 3 %");
    assert_contains(page, "<td>kg/m</td><td>held</td>");
    assert_contains(page, "6.49 × 10<sup>−6</sup></data></td><td class=\"n\"><data");
    assert_contains(page, "± 2.5 × 10<sup>−7</sup>");
    assert_contains(page, "not determined by the fitted records");
    assert_contains(page, "At 0: KB_NmpV, residual_piezo_V_hammer_N.");
    free(page);
    rig_end(&rig);
}

static void prefix_is(double x, const char *unit, const char *wanted)
{
    char format[40], text[64];
    const double factor = report_prefix(x, unit, format);
    (void)snprintf(text, sizeof text, format, factor * x);
    assert_string_equal(text, wanted);
}

static void quantities_take_prefixes(void **state)
{
    (void)state;
    prefix_is(1.744e-5, "V", "17.4 µV");
    prefix_is(0.99994, "V", "1 V"); /* not 1e+03 mV */
    prefix_is(0.0312, "m/s²", "31.2 mm/s²");
    prefix_is(2.5e4, "N", "25 kN");
    prefix_is(2.5e-4, "g", "0.00025 g");
    prefix_is(0.0, "V", "0 V");
    prefix_is(1e-12, "V", "1e-12 V");
    prefix_is(0.25, "", "0.25");
    char unit[24];
    report_unit("accel_mps2", unit);
    assert_string_equal(unit, "m/s²");
    report_unit("odd(name)", unit);
    assert_string_equal(unit, "");
}

/* A record of too few samples and a silent one. */
static void what_cannot_be_judged(void **state)
{
    (void)state;
    struct rig rig;
    rig_begin(&rig, "tap1.csv", "tap2.csv", 0.01, 1.0);
    compare_free(&rig.comparison);
    rig.records[0].n = 12;
    memset(column(&rig.records[1], "piezo_V"), 0, N * sizeof(double));
    rig.comparison = run(&rig.model, rig.records, 2, 1);
    char *page = page_of(&rig);
    assert_contains(page, "too little motion to judge");
    assert_null(strstr(page, "nan"));
    assert_null(strstr(page, ">inf"));
    free(page);
    rig_end(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_model_needs_nothing),
        cmocka_unit_test(a_bad_model_is_sent_to_diagnose),
        cmocka_unit_test(the_worst_channel_decides),
        cmocka_unit_test(hostile_names_stay_text),
        cmocka_unit_test(a_check_record_that_was_fitted_is_said),
        cmocka_unit_test(parameters_say_how_they_are_known),
        cmocka_unit_test(quantities_take_prefixes),
        cmocka_unit_test(what_cannot_be_judged),
    };
    return cmocka_run_group_tests_name("report", tests, NULL, NULL);
}
