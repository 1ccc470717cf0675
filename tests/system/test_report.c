/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `beamfit report` on simulated records: the page as a browser reads it, beside what the other commands say. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"
#include "hidden_mass.h"

static int shell(struct rig *rig, const char *script)
{
    run_program(rig->dir, (const char *[]){"sh", "-c", script, NULL}, &rig->outcome);
    return rig->outcome.status;
}

/* One directory for all tests: heavy_fitted.yaml has the mass, and the damping back. */
static int make_all(void **state)
{
    return hidden_mass_setup(state) != 0
               ? -1
               : shell(*state,
                       "set -e\n\"$BEAMFIT\" add fitted.yaml tip_mass -o heavy.yaml\n\"$BEAMFIT\" fit heavy.yaml "
                       "soft.csv hard.csv --check check.csv -o heavy_fitted.yaml --json >fit.json");
}

/* ---- The page ---- */

static void a_good_model_with_its_chain(void **state)
{
    struct rig *rig = *state;
    const char *said = RAN(rig, 0, "report", "heavy_fitted.yaml", "soft.csv", "hard.csv", "--check", "check.csv", "-o",
                           "good.html", "--title", "Beam <B1> & its mass");
    says(said, "good.html: ");
    says(said, " MB, curves of 6 channels\n"); /* 3 records, 2 channels */
    says(said, "that could be told from the noise is left");
    assert_string_equal(rig->outcome.err, "");
    must(rig, "set -e\n"
              "\"$BEAMFIT\" compare heavy_fitted.yaml soft.csv hard.csv --check check.csv --json >compare.json\n"
              "\"$BEAMFIT\" modes heavy_fitted.yaml -n 4 --json >modes.json\n"
              "python3 -B \"$TOP/tests/system/report_page.py\" good.html --compare compare.json --modes modes.json "
              "--fit fit.json --figures 6 --title 'Beam <B1> & its mass'\n");
    must(rig, "grep -q 'a point mass at the free end' good.html && grep -q '+tip_mass' good.html && "
              "grep -q '@media print' good.html && ! grep -q 'class=\"warning\"' good.html");
}

static void a_bad_model_in_json(void **state)
{
    struct rig *rig = *state;
    json_t *root = json_loads(RAN(rig, 0, "report", "fitted.yaml", "soft.csv", "hard.csv", "--check", "check.csv", "-o",
                                  "bad.html", "--pictures", "1", "--json"),
                              0, NULL);
    assert_non_null(root);
    assert_string_equal(json_string_value(json_object_get(root, "file")), "bad.html");
    assert_int_equal(json_integer_value(json_object_get(root, "pictures")), 1);
    assert_int_equal(json_array_size(json_object_get(root, "left_out")), 5);
    assert_int_equal(json_integer_value(json_object_get(root, "models")), 2);
    assert_int_equal(json_integer_value(json_object_get(root, "explanations")), 2); /* the model and its ancestor */
    assert_true(json_number_value(json_object_get(root, "noise_ratio")) > 3.0);
    assert_true(json_number_value(json_object_get(root, "check_noise_ratio")) > 3.0);
    says(json_string_value(json_object_get(root, "text")), "beamfit diagnose");
    char script[400];
    (void)snprintf(script, sizeof script, "test $(wc -c <bad.html) -eq %lld",
                   (long long)json_integer_value(json_object_get(root, "bytes")));
    json_decref(root);
    must(rig, script);
    must(rig, "set -e\n"
              "\"$BEAMFIT\" compare fitted.yaml soft.csv hard.csv --check check.csv --json >compare.json\n"
              "python3 -B \"$TOP/tests/system/report_page.py\" bad.html --compare compare.json --figures 1 "
              "--title 'Model of a beam: fitted.yaml'\n"
              "grep -q 'those of at most 1 channel (--pictures N' bad.html\n");
}

/* The checker itself must see what it is there to see. */
static void the_checker_sees_faults(void **state)
{
    struct rig *rig = *state;
    RAN(rig, 0, "report", "fitted.yaml", "soft.csv", "--pictures", "1", "-o", "page.html");
    static const char *const edits[] = {
        "s/<h1>/<script src=x><h1>/",
        "s/<h1>/<h1 onclick=x>/",
        "s/<h1>/<h1>http:\\/\\/x.org/",
        "s/<\\/h1>//",
        "s/^'use strict';/'use strict' ;/", /* a script that was not the page's */
        "s/default-src .none./default-src */",
        "s/\\(\"data\": *\".\\{800\\}\\)..../\\1AAAA/",               /* in a curve */
        "/<td>soft/s/<data value=\"0\\.0/<data value=\"0.1/",         /* an error */
        "/<td class=\"n\">2</s/<data value=\"[0-9]/<data value=\"9/", /* a frequency */
        "s/ Hz (mode/9 Hz (mode/",                                    /* a band */
    };
    must(rig,
         "\"$BEAMFIT\" compare fitted.yaml soft.csv --json >compare.json && \"$BEAMFIT\" modes fitted.yaml -n 4 --json "
         ">modes.json && python3 -B \"$TOP/tests/system/report_page.py\" page.html --compare compare.json --modes "
         "modes.json");
    for (size_t i = 0; i < sizeof edits / sizeof *edits; i++) {
        char script[500];
        (void)snprintf(
            script, sizeof script,
            "sed '%s' page.html >edited.html; cmp -s page.html edited.html && exit 3\n"
            "exec python3 -B \"$TOP/tests/system/report_page.py\" edited.html --compare compare.json --modes "
            "modes.json",
            edits[i]);
        if (shell(rig, script) != 1)
            fail_msg("%s: status %d, %s%s", edits[i], rig->outcome.status, rig->outcome.out, rig->outcome.err);
    }
}

static void hostile_names_stay_text(void **state)
{
    struct rig *rig = *state;
    static const char name[] = "a\"><script>alert('1')<img src=x onerror=y>&amp;.csv";
    must(rig, "cp soft.csv 'a\"><script>alert('\"'1'\"')<img src=x onerror=y>&amp;.csv' && "
              "sed 's/tip_mps/tip<b>_mps/' check.csv >odd.csv && "
              "sed 's/tip_mps/\"tip<b>_mps\"/' fitted.yaml >'<i>.yaml'");
    RAN(rig, 0, "report", "<i>.yaml", name, "--check", "odd.csv", "-o", "hostile.html", "--pictures", "2", "--title",
        "</title><script>x()</script>http://example.org/");
    must(rig, "python3 -B \"$TOP/tests/system/report_page.py\" hostile.html --hostile --figures 2 --title "
              "'</title><script>x()</script>http://example.org/'");
}

static void to_standard_output(void **state)
{
    struct rig *rig = *state;
    RAN(rig, 0, "report", "fitted.yaml", "soft.csv", "--pictures", "0", "-o", "-");
    assert_memory_equal(rig->outcome.out, "<!doctype html>", 15);
    says(rig->outcome.out, "</html>\n");
    says(RAN(rig, 2, "report", "fitted.yaml", "soft.csv", "-o", "-", "--json"), "--json and -o -");
}

/* ---- What is refused, and what is left behind ---- */

static void what_is_refused(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "old.html", rig_old_output);
    write_text(rig->dir, "broken.csv", "time_s,hammer_N,piezo_V\n0,0,0\n0.004,0,zero\n");
    const int files = count_files(rig->dir);
    says(RAN(rig, 2, "report", "fitted.yaml", "soft.csv"), "-o FILE.html");
    says(RAN(rig, 2, "report", "fitted.yaml", "-o", "old.html"), "at least one record");
    says(RAN(rig, 2, "report", "fitted.yaml", "soft.csv", "-o", "fitted.yaml"), "is read by this command");
    says(RAN(rig, 2, "report", "fitted.yaml", "soft.csv", "-o", "./soft.csv"), "is read by this command");
    says(RAN(rig, 2, "report", "fitted.yaml", "soft.csv", "-o", "old.html", "--pictures", "-1"), "--pictures");
    says(RAN(rig, 2, "report", "fitted.yaml", "soft.csv", "-o", "old.html", "--intersample", "x"), "x");
    says(RAN(rig, 2, "report", "fitted.yaml", "soft.csv", "-o", "old.html", "--ancestor", "heavy.yaml", "--force"),
         "no ancestor");
    says(RAN(rig, 3, "report", "fitted.yaml", "soft.csv", "-o", "nowhere/x.html"), "nowhere/x.html: cannot be written");
    says(RAN(rig, 3, "report", "fitted.yaml", "soft.csv", "broken.csv", "-o", "old.html"), "broken.csv:3: ");
    says(RAN(rig, 3, "report", "nowhere.yaml", "soft.csv", "-o", "old.html"), "nowhere.yaml");
    says(RAN(rig, 3, "report", "fitted.yaml", "nowhere.csv", "-o", "old.html"), "nowhere.csv");
    run_beamfit_on_small_disk(
        rig->dir, 4096,
        (const char *[]){"report", "fitted.yaml", "soft.csv", "--pictures", "0", "-o", "old.html", "--force", NULL},
        &rig->outcome);
    assert_refused(&rig->outcome, "old.html", "cannot be written");
    assert_true(file_is(rig->dir, "old.html", rig_old_output));
    assert_int_equal(count_files(rig->dir), files);
}

/* Nothing beside the program is needed. */
static void without_gnuplot(void **state)
{
    struct rig *rig = *state;
    must(rig, "mkdir none && PATH=\"$PWD/none\" && \"$BEAMFIT\" report fitted.yaml soft.csv -o bare.html");
    assert_string_equal(rig->outcome.err, "");
    says(rig->outcome.out, "curves of 2 channels");
    must(rig, "grep -q 'Largest share of the misfit' bare.html && rm -r none bare.html");
}

static void with_a_diagnosis(void **state)
{
    struct rig *rig = *state;
    says(RAN(rig, 0, "report", "fitted.yaml", "soft.csv", "hard.csv", "--check", "check.csv", "-o", "diagnosed.html",
             "--diagnose"),
         "Missing: tip_mass");
    assert_null(strstr(rig->outcome.out, "is the next step"));
    must(rig, "python3 -B \"$TOP/tests/system/report_page.py\" diagnosed.html --figures 6 && test $(wc -c "
              "<diagnosed.html) -lt 3000000");
}

/* Every control of the page, operated in a browser: docs/report.md. */
static void in_a_browser(void **state)
{
    struct rig *rig = *state;
    if (shell(rig, "command -v chromium >/dev/null") != 0) {
        print_message("the page is not opened: chromium is not installed\n");
        skip();
    }
    must(rig, "PYTHONPATH=\"$TOP/tests\" python3 -B \"$TOP/tests/system/report_browser.py\" diagnosed.html");
    must(rig,
         "\"$BEAMFIT\" compare fitted.yaml soft.csv --format html >answer.html && PYTHONPATH=\"$TOP/tests\" python3 -B "
         "\"$TOP/tests/system/answer_browser.py\" answer.html");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_model_with_its_chain),
        cmocka_unit_test(a_bad_model_in_json),
        cmocka_unit_test(the_checker_sees_faults),
        cmocka_unit_test(hostile_names_stay_text),
        cmocka_unit_test(to_standard_output),
        cmocka_unit_test(what_is_refused),
        cmocka_unit_test(without_gnuplot),
        cmocka_unit_test(with_a_diagnosis),
        cmocka_unit_test(in_a_browser),
    };
    return cmocka_run_group_tests_name("report", tests, make_all, rig_teardown);
}
