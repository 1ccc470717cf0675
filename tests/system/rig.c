/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

const char rig_model[] = "format: beamfit-model/1\n"                       /* line 1 */
                         "beam:\n"                                         /* 2 */
                         "  length_m: 0.4573\n"                            /* 3 */
                         "  patch_m: [0.02535, 0.08905]\n"                 /* 4 */
                         "parameters:\n"                                   /* 5 */
                         "  EI_beam_Nm2: {value: 0.491, prior: 0.03}\n"    /* 6 */
                         "  EI_patch_Nm2: {value: 0.793}\n"                /* 7 */
                         "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"  /* 8 */
                         "  rho_patch_kgpm: {value: 0.433}\n"              /* 9 */
                         "  cDI_beam_sNm2: {value: 0.649e-5}\n"            /* 10 */
                         "  cDI_patch_sNm2: {value: 1.255e-5}\n"           /* 11 */
                         "  gamma_sNpm2: {value: 0.013}\n"                 /* 12 */
                         "  Ks_V: {value: 4682.342}\n"                     /* 13 */
                         "inputs:\n"                                       /* 14 */
                         "  hammer_N: {kind: point_force, at_m: 0.0254}\n" /* 15 */
                         "outputs:\n"                                      /* 16 */
                         "  piezo_V: {kind: patch_strain}\n";              /* 17 */

const char rig_old_output[] = "what was there before\n";

void rig_make_record(char text[RIG_RECORD_TEXT], const char *header, int samples, int at_sample, const char *line,
                     double time_scale)
{
    size_t n = (size_t)snprintf(text, RIG_RECORD_TEXT, "%s\n", header);
    for (int k = 0; k < samples; k++)
        if (k == at_sample)
            n += (size_t)snprintf(text + n, RIG_RECORD_TEXT - n, "%s\n", line);
        else
            n += (size_t)snprintf(text + n, RIG_RECORD_TEXT - n, "%.9g,%d,%.6f\n", time_scale * k / 256.0, k == 4,
                                  0.001 * ((k * 37) % 19 - 9));
    assert_true(n < RIG_RECORD_TEXT);
}

int rig_setup(void **state)
{
    struct rig *rig = calloc(1, sizeof *rig);
    if (rig == NULL)
        return -1;
    make_directory(rig->dir);
    write_text(rig->dir, "model.yaml", rig_model);
    char record[RIG_RECORD_TEXT];
    rig_make_record(record, "time_s,hammer_N,piezo_V", RIG_SAMPLES, -1, "", 1.0);
    write_text(rig->dir, "record.csv", record);
    *state = rig;
    return 0;
}

int rig_teardown(void **state)
{
    struct rig *rig = *state;
    remove_directory(rig->dir);
    free(rig);
    return 0;
}

void assert_refused(const struct outcome *outcome, const char *where, const char *word)
{
    char begin[256];
    snprintf(begin, sizeof begin, "beamfit: %s:", where);
    const char *message = strstr(outcome->err, "beamfit: ");
    while (message != NULL && strncmp(message, "beamfit: warning: ", 18) == 0)
        message = strstr(message + 1, "beamfit: ");
    if (outcome->status != 3 || message == NULL || strncmp(message, begin, strlen(begin)) != 0 ||
        strstr(message, word) == NULL || strchr(message, ';') == NULL || outcome->out[0] != 0)
        fail_msg("wanted status 3 and '%s ... %s ...; remedy', got status %d, output '%s', message '%s'", begin, word,
                 outcome->status, outcome->out, outcome->err);
    assert_non_null(strchr(message, '\n'));
    assert_string_equal(strchr(message, '\n'), "\n"); /* one line, the last */
}

void refuse_everywhere(struct rig *rig, const char *where, const char *word)
{
    write_text(rig->dir, "old.csv", rig_old_output);
    write_text(rig->dir, "old.yaml", rig_old_output);
    int files = count_files(rig->dir);
    const char *const simulate[] = {"simulate", "model.yaml", "--input", "record.csv",
                                    "-o",       "old.csv",    "--force", NULL};
    const char *const fit[] = {"fit", "model.yaml", "record.csv", "-o", "old.yaml", "--force", NULL};
    const char *const compare[] = {"compare", "model.yaml", "record.csv", NULL};
    const char *const *const commands[] = {simulate, fit, compare};
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        run_beamfit(rig->dir, commands[i], &rig->outcome);
        assert_refused(&rig->outcome, where, word);
    }
    assert_true(file_is(rig->dir, "old.csv", rig_old_output));
    assert_true(file_is(rig->dir, "old.yaml", rig_old_output));
    assert_int_equal(count_files(rig->dir), files);
}

void rig_model_with(struct rig *rig, int line, const char *replacement)
{
    char text[sizeof rig_model + 256];
    const char *from = rig_model;
    for (int i = 1; i < line; i++)
        from = strchr(from, '\n') + 1;
    snprintf(text, sizeof text, "%.*s%s%s", (int)(from - rig_model), rig_model, replacement, strchr(from, '\n'));
    write_text(rig->dir, "model.yaml", text);
}
