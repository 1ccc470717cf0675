/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Answers of every command, a board's included, held against the schema that the command prints; and their other forms. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "board_rig.h"

/* As a person would go through it; `j FILE COMMAND ...` keeps an answer. Status 1 is an answer, too. */
static const char journey[] =
    "set -eu\n"
    "b=$BEAMFIT; top=$(cd \"$(dirname \"$b\")/..\" && pwd)\n"
    "j() { file=$1; shift; status=0; \"$b\" \"$@\" --json >$1.$file.answer 2>$1.$file.err || status=$?; "
    "[ $status -le 1 ] || { echo \"$*: status $status\"; cat $1.$file.err; exit 1; }; }\n"
    "j a record --port \"$1\" --key key --model model.yaml -o run.csv --seconds 1 --settle 0.1 --chirp 5:200:1:2\n"
    "j b record --port \"$1\" -o still.csv --samples 200 --drive keep\n"
    "j a monitor --port \"$1\" --seconds 1 --every 0.3\n"
    "j a info --port \"$1\"\n"
    "j a download a.img --port \"$1\" --key key\n"
    "j b info --port \"$1\"\n"
    "j a upload --port \"$1\" -o now.img\n"
    "j a record --port \"$1\" --key key --model model.yaml -o run2.csv --seconds 1 --settle 0.1 --chirp 5:200:1:2\n"
    "j a replay run2.csv --image now.img\n"
    "awk -F, -v OFS=, 'NR == 200 {$4 += 1} {print}' run2.csv >odd.csv\n"
    "j b replay odd.csv --image now.img\n"
    "j a verify now.img\n"
    "j b verify a.img --key key --device 0123456789abcdef01234567 --stored 5\n"
    "j a export model.yaml -o c.img --a2l c.a2l\n"
    "j a sign a.img --key key --device 0123456789abcdef01234567 --counter 9 -o signed.img\n"
    "j a doctor\n"
    "j a init -o start.yaml --input drive_V=patch_moment --output piezo_V=patch_strain --patch 0.02 0.08\n"
    "j a modes start.yaml\n"
    "j b modes start.yaml --convergence\n"
    "printf '# frequency_Hz, sd_Hz\\n3, 0.1\\n19\\n7000\\n' >list.csv\n"
    "j c modes start.yaml --measured list.csv\n"
    "printf 'freq_Hz,sd_Hz,damping_ratio\\n3,0.1,0.01\\n19,0.4,\\n' >fits.csv\n"
    "j c fit start.yaml fits.csv -o byfreq.yaml\n"
    "j c compare start.yaml fits.csv\n"
    "awk 'BEGIN {print \"freq_Hz,piezo_V/drive_V_dB\"; for (i = 1; i < 200; i++) print i / 2 \",\" 20 * sin(i)}' "
    ">dB.csv\n"
    "j d compare start.yaml dB.csv --check fits.csv\n"
    "j a frf start.yaml -o start.uff\n"
    "j a add start.yaml tip_mass -o heavy.yaml\n"
    "j a drop heavy.yaml tip_mass -o light.yaml\n"
    "j a effects\n"
    "j b effects cubic_stiffness\n"
    "j a simulate start.yaml --input run.csv -o sim.csv\n"
    "j b simulate heavy.yaml --input run.csv -o simh.csv\n"
    "j a import sim.csv --list\n"
    "j b import sim.csv -o again.csv\n"
    "j a average sim.csv again.csv --input drive_V -o average.csv\n"
    "sed 's/0.0018/0.002/' start.yaml >near.yaml\n"
    "j a fit near.yaml sim.csv -o fitted.yaml --check simh.csv\n"
    "j b fit near.yaml sim.csv -o fitted2.yaml --intersample zoh\n"
    "j a compare fitted.yaml sim.csv --check simh.csv\n"
    "j b compare start.yaml simh.csv --max-nrmse 1e-9\n"
    "j a diagnose fitted.yaml simh.csv --effects 1 --splines 40\n"
    "j a history start.yaml heavy.yaml fitted.yaml\n"
    "j a report fitted.yaml sim.csv -o page.html --pictures 0\n"
    "j a discriminate fitted.yaml tip_mass root_compliance sim.csv --only chirp --rows 2 --no-sensors -o next.csv\n"
    "printf 'unit,model,records\\nu1,near.yaml,sim.csv\\nu2,lost.yaml,sim.csv\\n' >units.csv\n"
    "j a fleet units.csv -o fleet.sqlite\n"
    "j b fleet report fleet.sqlite -o fleet.html\n"
    "j c fleet export fleet.sqlite -o images\n"
    "\"$b\" watch fitted.yaml sim.csv --json >watch.a.answer 2>watch.a.err & served=$!\n"
    "for _ in $(seq 600); do [ -s watch.a.answer ] || ! kill -0 $served || sleep 0.1; done\n"
    "kill $served; wait $served || :\n";

static void every_answer_is_what_its_schema_says(void **state)
{
    struct board_rig *rig = *state;
    run_program(rig->dir, (const char *[]){"bash", "-c", journey, "journey", rig->board.port, NULL}, &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("%s%s", rig->outcome.out, rig->outcome.err);
    run_program(rig->dir,
                (const char *[]){"sh", "-c", "exec python3 -B \"$TOP/tests/system/schema.py\" \"$BEAMFIT\"", NULL},
                &rig->outcome);
    if (rig->outcome.status == 77) {
        print_message("SKIPPED: python3-jsonschema is not installed\n");
        skip();
    }
    if (rig->outcome.status != 0)
        fail_msg("%s%s", rig->outcome.out, rig->outcome.err);
}

/* The same names in every form; --format text is what no option prints. */
static void forms_have_the_same_names(void **state)
{
    struct board_rig *rig = *state;
    static char text[sizeof rig->outcome.out];
    static const char *const names[] = {"frequency_Hz", "damping_ratio", "deployed", "relative_error",
                                        "spline_doubling_relative_change"};
    static const char *const forms[][2] = {{"markdown", "| frequency_Hz | "}, {"html", "<th>frequency_Hz</th>"}};
    for (size_t i = 0; i < 2; i++) {
        run_beamfit(rig->dir, (const char *[]){"modes", "model.yaml", "--format", forms[i][0], NULL}, &rig->outcome);
        assert_int_equal(rig->outcome.status, 0);
        assert_non_null(strstr(rig->outcome.out, forms[i][1]));
        for (size_t k = 0; k < sizeof names / sizeof *names; k++)
            if (strstr(rig->outcome.out, names[k]) == NULL)
                fail_msg("%s has no %s", forms[i][0], names[k]);
    }
    assert_non_null(strstr(rig->outcome.out, "</html>"));
    run_beamfit(rig->dir, (const char *[]){"modes", "model.yaml", NULL}, &rig->outcome);
    memcpy(text, rig->outcome.out, sizeof text);
    run_beamfit(rig->dir, (const char *[]){"modes", "model.yaml", "--format", "text", NULL}, &rig->outcome);
    assert_string_equal(rig->outcome.out, text);
    run_beamfit(rig->dir, (const char *[]){"modes", "model.yaml", "--format", "jsn", NULL}, &rig->outcome);
    assert_int_equal(rig->outcome.status, 2);
    assert_non_null(strstr(rig->outcome.err, "did you mean 'json'?"));
}

/* Every line of every answer for a person is at most as wide as the terminal; --all may be wider. */
static void text_fits_the_width(void **state)
{
    struct board_rig *rig = *state;
    static const char script[] =
        "set -eu\n"
        "export COLUMNS=80\n"
        "t() { status=0; \"$BEAMFIT\" \"$@\" >said 2>/dev/null || status=$?\n"
        "[ $status -le 1 ] || { echo \"$*: status $status\"; exit 1; }\n"
        "LC_ALL=C sed 's/[\x80-\xbf]//g' said | LC_ALL=C awk -v what=\"$*\" 'length > 80 {print what \": \" $0}'; }\n"
        "t init -o start.yaml --input drive_V=patch_moment --output piezo_V=patch_strain --patch 0.02 0.08\n"
        "awk 'BEGIN {print \"time_s,drive_V\"; for (i = 0; i < 2000; i++) printf \"%.4f,%.5f\\n\", i / 2000, "
        "i < 1500 ? 5 * sin(40 * i / 2000 + 900 * (i / 2000) ^ 2) : 0}' >drive.csv\n"
        "t simulate start.yaml --input drive.csv -o sim.csv\n"
        "t add start.yaml tip_mass -o heavy.yaml\n"
        "t simulate heavy.yaml --input drive.csv -o simh.csv\n"
        "t fit start.yaml simh.csv -o fitted.yaml --check sim.csv\n"
        "t compare start.yaml simh.csv --check sim.csv\n"
        "t diagnose fitted.yaml simh.csv --effects 1 --splines 40\n"
        "t modes start.yaml\n"
        "t history start.yaml heavy.yaml fitted.yaml\n"
        "t discriminate fitted.yaml tip_mass root_compliance sim.csv --only chirp --rows 2\n"
        "t report fitted.yaml sim.csv -o page.html --pictures 0\n"
        "t export model.yaml -o c.img\n"
        "t verify c.img\n"
        "t effects\n"
        "t effects cubic_stiffness\n"
        "t drop heavy.yaml tip_mass -o light.yaml\n"
        "t import sim.csv --list\n"
        "t doctor\n";
    run_program(rig->dir, (const char *[]){"bash", "-c", script, NULL}, &rig->outcome);
    assert_string_equal(rig->outcome.out, "");
    assert_int_equal(rig->outcome.status, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(every_answer_is_what_its_schema_says, board_rig_setup, board_rig_teardown),
        cmocka_unit_test_setup_teardown(forms_have_the_same_names, board_rig_setup, board_rig_teardown),
        cmocka_unit_test_setup_teardown(text_fits_the_width, board_rig_setup, board_rig_teardown),
    };
    return cmocka_run_group_tests_name("schema", tests, NULL, NULL);
}
