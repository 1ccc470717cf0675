/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The memory of simulate, fit and compare over records of different length, a strongly damped beam that forgets within a tenth of the shorter one: what a sample more takes. What
 * does not grow (the program, one piece) is in both.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"

enum { CHANNELS = 3 };                                    /* one input, two outputs */
enum { MORE = 160000 };                                   /* samples of one than of the other */
static const double most_fit = 64.0, most_compare = 64.0; /* bytes a sample and channel */
static const double most_streamed = 1.0;                  /* that is none */
/* Half a double: what is computed of the head, the same samples in both, differs by a few MB with the noise's level and the threads. */
static const double most_pieces = 4.0;

static const char model[] = "format: beamfit-model/1\n"
                            "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                            "parameters:\n"
                            "  EI_beam_Nm2: {value: 0.5}\n"
                            "  EI_patch_Nm2: {value: 0.8}\n"
                            "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                            "  rho_patch_kgpm: {value: 0.433}\n"
                            "  cDI_beam_sNm2: {value: 2e-5}\n"
                            "  cDI_patch_sNm2: {value: 2e-5}\n"
                            "  gamma_sNpm2: {value: 0.5}\n"
                            "  Ks_V: {value: 40}\n"
                            "inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
                            "outputs:\n"
                            "  piezo_V: {kind: patch_strain}\n"
                            "  tip_mps: {kind: velocity, at_m: 0.44}\n"
                            "effects: []\n";

/* r160.csv and r320.csv: noise drives the beam, and each output has 1 % of its size of noise. */
static const char make_records[] =
    "for n in 160 320; do"
    "  awk -v n=$n 'BEGIN {srand(5); print \"time_s,hammer_N\";"
    "    for (k = 0; k < 1000 * n; k++) {u = 0.6 * u + rand() - 0.5; printf \"%.9g,%.6g\\n\", k / 512, u}}' >u$n.csv;"
    "  \"$BEAMFIT\" simulate model.yaml --input u$n.csv -o s$n.csv >/dev/null || exit 1;"
    "  awk -F, -v OFS=, 'BEGIN {srand(6)} /^[0-9]/ {for (c = 3; c <= NF; c++) {v[c] += $c * $c; m[c]++;"
    "    $c = sprintf(\"%.9g\", $c + 0.03 * sqrt(v[c] / m[c]) * (rand() - 0.5))}} {print}' s$n.csv >r$n.csv;"
    "done";

/* Under the sanitizer memory is not what the program takes. */
#ifdef __SANITIZE_ADDRESS__
enum { MEASURES = 0 };
#else
enum { MEASURES = 1 };
#endif

static int setup(void **state)
{
    if (rig_setup(state) != 0)
        return -1;
    struct rig *rig = *state;
    write_text(rig->dir, "model.yaml", model);
    if (MEASURES)
        must(rig, make_records);
    return 0;
}

/* The same for records that compare reads piece by piece. */
static const char make_longer_records[] =
    "for n in 600 2700; do"
    "  awk -v n=$n 'BEGIN {srand(7); print \"time_s,hammer_N,piezo_V\";"
    "    for (k = 0; k < 1000 * n; k++) printf \"%.9g,%.6g,%.6g\\n\", k / 512, rand() - 0.5, rand() - 0.5}' >l$n.csv;"
    "done";

/* Bytes a sample and channel more. */
static double growth(struct rig *rig, double samples, double channels, const char *const of_short[],
                     const char *const of_long[])
{
    ran(rig, 0, of_short);
    const double before = (double)rig->outcome.memory_kB;
    ran(rig, 0, of_long);
    return ((double)rig->outcome.memory_kB - before) * 1024.0 / (samples * channels);
}

static void check(const char *command, double bytes, double most)
{
    print_message("%s: %.1f bytes a sample and channel\n", command, bytes);
    if (!(bytes <= most))
        fail_msg("%s takes %.1f bytes a sample and channel, where %.0f are allowed", command, bytes, most);
}

static void fit_grows_by_little_more_than_the_record(void **state)
{
    struct rig *rig = *state;
    if (!MEASURES)
        skip();
    static const char *const near[2][9] = {
        {"fit", "model.yaml", "r160.csv", "-o", "f160.yaml", "--start", "near", "--no-search", NULL},
        {"fit", "model.yaml", "r320.csv", "-o", "f320.yaml", "--start", "near", "--no-search", NULL}};
    check("fit", growth(rig, MORE, CHANNELS, near[0], near[1]), most_fit);
}

static void compare_grows_by_little_more_than_the_record(void **state)
{
    struct rig *rig = *state;
    if (!MEASURES)
        skip();
    static const char *const runs[2][4] = {{"compare", "model.yaml", "r160.csv", NULL},
                                           {"compare", "model.yaml", "r320.csv", NULL}};
    check("compare", growth(rig, MORE, CHANNELS, runs[0], runs[1]), most_compare);
}

static void compare_does_not_grow_with_what_it_reads_in_pieces(void **state)
{
    struct rig *rig = *state;
    if (!MEASURES)
        skip();
    static const char *const runs[2][4] = {{"compare", "model.yaml", "l600.csv", NULL},
                                           {"compare", "model.yaml", "l2700.csv", NULL}};
    must(rig, make_longer_records);
    check("compare of long records", growth(rig, 2.1e6, 2.0, runs[0], runs[1]), most_pieces);
    assert_non_null(strstr(rig->outcome.out, "l2700.csv is long"));
}

static void simulate_does_not_grow(void **state)
{
    struct rig *rig = *state;
    if (!MEASURES)
        skip();
    static const char *const runs[2][7] = {{"simulate", "model.yaml", "--input", "r160.csv", "-o", "t160.csv", NULL},
                                           {"simulate", "model.yaml", "--input", "r320.csv", "-o", "t320.csv", NULL}};
    check("simulate", growth(rig, MORE, CHANNELS, runs[0], runs[1]), most_streamed);
    must(rig, "! ls .beamfit-samples-* 2>/dev/null"); /* the file of the samples has no name any more */
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(simulate_does_not_grow),
                                       cmocka_unit_test(fit_grows_by_little_more_than_the_record),
                                       cmocka_unit_test(compare_grows_by_little_more_than_the_record),
                                       cmocka_unit_test(compare_does_not_grow_with_what_it_reads_in_pieces)};
    return cmocka_run_group_tests_name("long records", tests, setup, rig_teardown);
}
