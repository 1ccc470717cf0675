/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The truth simulator against another one: the open cases' outputs from their recorded inputs and their stated parameters.
 * It settles the conventions (signs, units, sensors) that two independent programs must share. The other simulator kept
 * 32 modes and held its inputs linearly on a 16-fold grid; both are imitated here (docs/truth.md).
 */
#include "truth/truth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_SAMPLES = 5000, MAX_COLUMNS = 4 };

struct table {
    size_t n;
    int columns;
    char name[MAX_COLUMNS][TRUTH_NAME];
    double x[MAX_COLUMNS][MAX_SAMPLES];
};

static const char *shared(void)
{
    const char *path = getenv("BEAMFIT_SHARED");
    return path ? path : "../shared";
}

static FILE *open_case(const char *name, const char *file)
{
    char path[512];
    snprintf(path, sizeof path, "%s/data/open/%s/%s", shared(), name, file);
    return fopen(path, "r");
}

static void read_table(const char *name, const char *record, struct table *table)
{
    char line[512], file[64], *rest, *word;
    snprintf(file, sizeof file, "%s.csv", record);
    FILE *stream = open_case(name, file);
    assert_non_null(stream);
    table->n = 0;
    table->columns = 0;
    assert_non_null(fgets(line, sizeof line, stream));
    for (rest = line; (word = strtok_r(rest, ",\n", &rest)) && table->columns < MAX_COLUMNS; table->columns++)
        snprintf(table->name[table->columns], TRUTH_NAME, "%.31s", word);
    while (table->n < MAX_SAMPLES && fgets(line, sizeof line, stream)) {
        rest = line;
        for (int c = 0; c < table->columns && (word = strtok_r(rest, ",\n", &rest)); c++)
            table->x[c][table->n] = strtod(word, NULL);
        table->n++;
    }
    fclose(stream);
}

static void read_answer(const char *name, struct truth_spec *spec)
{
    char line[256];
    FILE *stream = open_case(name, "answer.txt");
    assert_non_null(stream);
    struct truth_region *beam = &spec->region[0], *patch = &spec->region[1];
    const struct {
        const char *key;
        double *value;
    } known[] = {{"EI_b", &beam->EI_Nm2},       {"EI_p", &patch->EI_Nm2},   {"rho_b", &beam->rho_kgpm},
                 {"rho_p", &patch->rho_kgpm},   {"cDI_b", &beam->cDI_sNm2}, {"cDI_p", &patch->cDI_sNm2},
                 {"gamma", &spec->gamma_sNpm2}, {"Ks", &spec->Ks_V},        {"KB", &spec->KB_NmpV}};
    size_t found = 0;
    while (fgets(line, sizeof line, stream)) {
        char *colon = strchr(line, ':');
        if (!colon)
            continue;
        *colon = '\0';
        for (size_t k = 0; k < sizeof known / sizeof known[0]; k++)
            if (strcmp(known[k].key, line) == 0) {
                *known[k].value = strtod(colon + 1, NULL);
                found++;
            }
    }
    fclose(stream);
    assert_int_equal(found, sizeof known / sizeof known[0]);
}

static void say(struct truth_spec *spec, const char *line)
{
    char message[TRUTH_MESSAGE] = "";
    if (truth_spec_line(spec, line, message) != 0)
        fail_msg("%s: %s", line, message);
}

static void make_spec(const char *name, const struct table *table, const char *effect, struct truth_spec *spec)
{
    truth_spec_default(spec);
    read_answer(name, spec);
    say(spec, "modes = 32");
    say(spec, "static_vectors = 0");
    say(spec, "oversampling = 16");
    say(spec, "linear_hold = 1");
    say(spec, "filter_order = 0"); /* the recorded input has been through the filter, and the beam is linear */
    if (strcmp(table->name[1], "hammer_N") == 0) {
        say(spec, "input hammer_N point_force at_m=0.0254");
        say(spec, "output piezo_V patch_strain");
    } else {
        say(spec, "input drive_V patch_moment");
        say(spec, "output accel_mps2 acceleration at_m=0.0214");
        say(spec, "output tip_mps velocity at_m=0.44");
    }
    spec->n_signals = 1;
    spec->signal[0] =
        (struct truth_signal){.kind = TRUTH_RECORDED, .level = 1, .samples = table->x[1], .n_samples = table->n};
    if (effect && (!strstr(effect, "piezo_V") || spec->input[0].kind == TRUTH_POINT_FORCE))
        say(spec, effect);
}

/* Largest residual rms / measured rms over the channels of one record. */
static void expect_floor(const char *name, const char *record, const char *effect, double limit)
{
    static struct table table;
    struct truth_spec spec;
    struct truth_record model;
    char message[TRUTH_MESSAGE] = "";
    read_table(name, record, &table);
    make_spec(name, &table, effect, &spec);
    if (truth_simulate(&spec, &model, message) != 0)
        fail_msg("%s", message);
    for (int c = 2; c < table.columns; c++) {
        const double *y = truth_record_channel(&model, table.name[c]);
        double residual = 0, size = 0;
        assert_non_null(y);
        for (size_t i = 0; i < table.n; i++) {
            residual += (table.x[c][i] - y[i]) * (table.x[c][i] - y[i]);
            size += table.x[c][i] * table.x[c][i];
        }
        double share = sqrt(residual / size);
        print_message("%s %s %s: %.3f %%\n", name, record, table.name[c], 100 * share);
        if (!(share < limit))
            fail_msg("%s %s %s: residual %.3f %% of the measured rms, allowed %.3f %%", name, record, table.name[c],
                     100 * share, 100 * limit);
    }
    truth_record_free(&model);
}

static void whole_case(const char *name, const char *effect)
{
    static const char *const records[] = {"train1", "train2", "train3", "train4", "check1", "check2"};
    FILE *present = open_case(name, "answer.txt");
    if (!present) {
        print_message("SKIPPED: %s/data/open/%s is not here; set BEAMFIT_SHARED\n", shared(), name);
        skip();
    }
    fclose(present);
    for (size_t r = 0; r < sizeof records / sizeof records[0]; r++)
        expect_floor(name, records[r], effect, 0.0045); /* the noise is 0.4 % */
}

static void test_clean(void **state)
{
    (void)state;
    whole_case("o0_clean", NULL);
}

static void test_tip_mass(void **state)
{
    (void)state;
    whole_case("o1_tip_mass", "effect tip_mass mass_kg=0.0018");
}

/* The answer's (120, 0.003) are a stiffness in N·m/rad and a damper in N·m·s/rad. */
static void test_root_compliance(void **state)
{
    (void)state;
    whole_case("o2_root_compliance", "effect root_compliance compliance_radpNm=0.00833333333333 loss_s=2.5e-5");
}

static void test_sensor_highpass_on_the_patch_only(void **state)
{
    (void)state;
    whole_case("o4_sensor_highpass", "effect sensor_highpass tau_s=0.1 channel=piezo_V");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_clean),
        cmocka_unit_test(test_tip_mass),
        cmocka_unit_test(test_root_compliance),
        cmocka_unit_test(test_sensor_highpass_on_the_patch_only),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
