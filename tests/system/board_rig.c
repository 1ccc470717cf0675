/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <jansson.h>
#include "board_rig.h"

static const char model[] = "format: beamfit-model/1\n"
                            "beam:\n"
                            "  length_m: 0.4573\n"
                            "  patch_m: [0.02535, 0.08905]\n"
                            "parameters:\n"
                            "  EI_beam_Nm2: {value: 0.491}\n"
                            "  EI_patch_Nm2: {value: 0.793}\n"
                            "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                            "  rho_patch_kgpm: {value: 0.433}\n"
                            "  cDI_beam_sNm2: {value: 0.649e-5}\n"
                            "  cDI_patch_sNm2: {value: 1.255e-5}\n"
                            "  gamma_sNpm2: {value: 0.013}\n"
                            "  Ks_V: {value: 46.8}\n"
                            "  KB_NmpV: {value: 0.01}\n"
                            "inputs:\n"
                            "  drive_V: {kind: patch_moment}\n"
                            "outputs:\n"
                            "  piezo_V: {kind: patch_strain}\n"
                            "board:\n"
                            "  sample_Hz: 1000\n"
                            "  sensor: {output: piezo_V, per_code: 0.001, zero_code: 2048}\n"
                            "  drive: {input: drive_V, per_code: 0.01, zero_code: 2048}\n"
                            "  noise_rms: 0.002\n";

static void make_images(struct board_rig *rig)
{
    static const char *const a[] = {"export", "model.yaml", "-o", "a.img", NULL};
    static const char *const b[] = {"export", "model.yaml", "--noise-rms", "0.004", "-o", "b.img", NULL};
    write_text(rig->dir, "model.yaml", model);
    const char *const *const calls[] = {a, b};
    for (int i = 0; i < 2; i++) {
        run_beamfit(rig->dir, calls[i], &rig->outcome);
        if (rig->outcome.status != 0)
            fail_msg("export: %s", rig->outcome.err);
    }
}

int board_rig_setup(void **state)
{
    static const char right[32] = "beamfit test key, 32 bytes long";
    static const char wrong[32] = "beamfit test key, 32 bytes wrong";
    struct board_rig *rig = calloc(1, sizeof *rig);
    if (rig == NULL)
        return -1;
    make_directory(rig->dir);
    write_key(rig->dir, "key", right);
    write_key(rig->dir, "wrong_key", wrong);
    make_images(rig);
    board_start(&rig->board, rig->dir, (const char *[]){"--key", "key", "--nvm", "nvm", NULL});
    *state = rig;
    return 0;
}

int board_rig_teardown(void **state)
{
    struct board_rig *rig = *state;
    line_stop(&rig->line);
    board_stop(&rig->board);
    remove_directory(rig->dir);
    free(rig);
    return 0;
}

void board_run(struct board_rig *rig, const char *port, const char *const arguments[])
{
    enum { MOST = 24 };
    const char *argv[MOST];
    size_t n = 0;
    for (; arguments[n] != NULL; n++) {
        assert_true(n < MOST - 3);
        argv[n] = arguments[n];
    }
    argv[n++] = "--port";
    argv[n++] = port;
    argv[n] = NULL;
    run_beamfit(rig->dir, argv, &rig->outcome);
}

void board_run_expect(struct board_rig *rig, const char *port, int status, const char *const arguments[])
{
    board_run(rig, port, arguments);
    if (rig->outcome.status != status)
        fail_msg("beamfit %s: status %d, wanted %d: %s%s", arguments[0], rig->outcome.status, status, rig->outcome.out,
                 rig->outcome.err);
}

static json_t *parse(const struct board_rig *rig)
{
    json_t *root = json_loads(rig->outcome.out, 0, NULL);
    if (root == NULL)
        fail_msg("no JSON: %s%s", rig->outcome.out, rig->outcome.err);
    return root;
}

double board_answer(const struct board_rig *rig, const char *key)
{
    json_t *root = parse(rig), *value = json_object_get(root, key);
    if (!json_is_number(value) && !json_is_boolean(value))
        fail_msg("'%s' is no number: %s", key, rig->outcome.out);
    const double x = json_is_boolean(value) ? json_is_true(value) : json_number_value(value);
    json_decref(root);
    return x;
}

int board_answer_is(const struct board_rig *rig, const char *key, const char *text)
{
    json_t *root = parse(rig);
    const char *found = json_string_value(json_object_get(root, key));
    const int same = found != NULL && strcmp(found, text) == 0;
    json_decref(root);
    return same;
}

struct board_model board_ask(struct board_rig *rig)
{
    struct board_model m = {0};
    board_run_expect(rig, rig->board.port, 0, (const char *[]){"info", "--json", NULL});
    m.downloaded = !board_answer_is(rig, "running", "built in");
    m.counter = board_answer(rig, "counter");
    m.stored = board_answer(rig, "stored");
    json_t *root = parse(rig);
    snprintf(m.sha256, sizeof m.sha256, "%s", json_string_value(json_object_get(root, "model_sha256")));
    json_decref(root);
    return m;
}
