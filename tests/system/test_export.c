/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From a model to a controller's image: export, sign, verify, replay; what they refuse and how they say so. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <cmocka.h>
#include "ask.h"

enum { IMAGE_BYTES = 5060 };
#define DEVICE "0123456789abcdef01234567"
static const char model[] = "format: beamfit-model/1\n"
                            "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                            "parameters:\n"
                            "  EI_beam_Nm2: {value: 0.491}\n"
                            "  EI_patch_Nm2: {value: 0.793}\n"
                            "  rho_beam_kgpm: {value: 0.093}\n"
                            "  rho_patch_kgpm: {value: 0.433}\n"
                            "  cDI_beam_sNm2: {value: 0.649e-5}\n"
                            "  cDI_patch_sNm2: {value: 1.255e-5}\n"
                            "  gamma_sNpm2: {value: 0.013}\n"
                            "  Ks_V: {value: 40}\n"
                            "  KB_NmpV: {value: 0.0175}\n"
                            "inputs: {drive_V: {kind: patch_moment}}\n"
                            "outputs: {piezo_V: {kind: patch_strain}, tip_m: {kind: displacement, at_m: 0.44}}\n"
                            "effects:%s\n"
                            "board:\n"
                            "  sample_Hz: 1000\n"
                            "  sensor: {output: piezo_V, per_code: 0.001, zero_code: 2048}\n"
                            "  drive: {input: drive_V, per_code: 0.02, zero_code: 2048}%s\n";

static void write_model(struct rig *rig, const char *name, const char *effects, const char *board)
{
    char text[4096];
    assert_true(snprintf(text, sizeof text, model, effects, board) < (int)sizeof text);
    write_text(rig->dir, name, text);
}

static void set_mode(const struct rig *rig, const char *name, mode_t mode)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    assert_int_equal(chmod(path, mode), 0);
}

static void read_image(const struct rig *rig, const char *name, unsigned char bytes[IMAGE_BYTES])
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", rig->dir, name);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    assert_int_equal(fread(bytes, 1, IMAGE_BYTES, f), IMAGE_BYTES);
    assert_int_equal(fgetc(f), EOF);
    fclose(f);
}

/* model.yaml, two keys, an unsigned and a signed image. */
static int setup(void **state)
{
    if (rig_setup(state) != 0)
        return -1;
    struct rig *rig = *state;
    write_model(rig, "model.yaml", " []", "\n  noise_rms: 0.002");
    write_text(rig->dir, "board.key", "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n");
    write_text(rig->dir, "other.key", "100102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n");
    set_mode(rig, "board.key", 0600);
    set_mode(rig, "other.key", 0600);
    RAN(rig, 0, "export", "model.yaml", "-o", "plain.bfi");
    says(rig->outcome.out, "unsigned");
    RAN(rig, 0, "sign", "plain.bfi", "--key", "board.key", "--device", DEVICE, "--counter", "7", "-o", "signed.bfi");
    return 0;
}

static void export_makes_what_verify_takes(void **state)
{
    struct rig *rig = *state;
    unsigned char once[IMAGE_BYTES], again[IMAGE_BYTES];
    says(RAN(rig, 0, "verify", "plain.bfi"), "unsigned");
    RAN(rig, 0, "export", "model.yaml", "--key", "board.key", "--device", DEVICE, "--counter", "7", "-o", "direct.bfi");
    read_image(rig, "signed.bfi", once);
    read_image(rig, "direct.bfi", again);
    assert_memory_equal(once, again, IMAGE_BYTES); /* signed at once or later: the same bytes */
    const char *text = RAN(rig, 0, "verify", "signed.bfi", "--key", "board.key", "--device", DEVICE, "--stored", "6",
                           "--sample-Hz", "1000");
    says(text, "the image is fine");
    says(text, "for device " DEVICE ", counter 7");
    says(text, "1000 Hz");
}

static void what_verify_refuses(void **state)
{
    struct rig *rig = *state;
    unsigned char bytes[IMAGE_BYTES + 1] = {0};
    says(RAN(rig, 1, "verify", "signed.bfi", "--key", "other.key"), "not signed with this device's key");
    says(RAN(rig, 1, "verify", "plain.bfi", "--key", "board.key"), "not signed with this device's key");
    says(RAN(rig, 1, "verify", "signed.bfi", "--device", "1123456789abcdef01234567"), "another device");
    says(RAN(rig, 1, "verify", "signed.bfi", "--stored", "7"), "not above the stored");
    says(RAN(rig, 1, "verify", "signed.bfi", "--sample-Hz", "1024"), "sample rate");
    read_image(rig, "signed.bfi", bytes);
    bytes[1000] ^= 1;
    write_file(rig->dir, "bad.bfi", bytes, IMAGE_BYTES);
    says(RAN(rig, 1, "verify", "bad.bfi"), "CRC-32");
    says(RAN(rig, 1, "sign", "bad.bfi", "--key", "board.key", "--device", DEVICE, "--counter", "8", "-o", "new.bfi"),
         "CRC-32");
    assert_false(file_exists(rig->dir, "new.bfi"));
    bytes[1000] ^= 1;
    write_file(rig->dir, "cut.bfi", bytes, IMAGE_BYTES - 1);
    says(RAN(rig, 1, "verify", "cut.bfi"), "length");
    write_file(rig->dir, "long.bfi", bytes, IMAGE_BYTES + 1);
    says(RAN(rig, 1, "verify", "long.bfi"), "length");
    says(RAN(rig, 1, "verify", "model.yaml"), "no target image");
    says(RAN(rig, 3, "verify", "nowhere.bfi"), "nowhere.bfi");
    says(RAN(rig, 3, "sign", "cut.bfi", "--key", "board.key", "--device", DEVICE, "--counter", "8", "-o", "new.bfi"),
         "fewer than 5060");
}

static void keys_that_others_could_read(void **state)
{
    struct rig *rig = *state;
    set_mode(rig, "board.key", 0640);
    says(RAN(rig, 3, "verify", "signed.bfi", "--key", "board.key"), "chmod 600 board.key");
    says(RAN(rig, 3, "sign", "plain.bfi", "--key", "board.key", "--device", DEVICE, "--counter", "8", "-o", "new.bfi"),
         "chmod 600");
    says(RAN(rig, 3, "export", "model.yaml", "--key", "board.key", "--device", DEVICE, "--counter", "8", "-o",
             "new.bfi"),
         "chmod 600");
    assert_false(file_exists(rig->dir, "new.bfi"));
    says(RAN(rig, 3, "verify", "signed.bfi", "--key", "model.yaml"), "model.yaml");
}

static void mistakes_on_the_command_line(void **state)
{
    struct rig *rig = *state;
    says(RAN(rig, 2, "export", "model.yaml"), "-o IMAGE");
    says(RAN(rig, 2, "export", "model.yaml", "-o", "n.bfi", "--key", "board.key"), "--device is missing");
    says(RAN(rig, 2, "export", "model.yaml", "-o", "n.bfi", "--device", DEVICE, "--counter", "1"), "--key is missing");
    says(RAN(rig, 2, "export", "model.yaml", "-o", "n.bfi", "--hold", "cubic"), "--hold");
    says(RAN(rig, 2, "export", "model.yaml", "-o", "n.bfi", "--without", "tip_mass"), "no such effect");
    says(RAN(rig, 2, "export", "model.yaml", "-o", "n.bfi", "--sensor", "accel"), "no such output");
    says(RAN(rig, 2, "export", "model.yaml", "-o", "n.bfi", "--noise-rms", "0"), "above 0");
    says(RAN(rig, 3, "export", "model.yaml", "-o", "n.bfi", "--drive-per-code", "1e38"),
         "the drive's per_code is 1e+38");
    says(RAN(rig, 3, "export", "model.yaml", "-o", "n.bfi", "--noise-rms", "1e-45"), "noise_rms is 1.4013e-45");
    says(RAN(rig, 3, "export", "model.yaml", "-o", "n.bfi", "--noise-rms", "1e-9"), "codes of the sensor");
    says(RAN(rig, 3, "export", "model.yaml", "-o", "n.bfi", "--averaging-s", "1e9"), "averaging_s is 1e+09");
    says(RAN(rig, 3, "export", "model.yaml", "-o", "n.bfi", "--alarm-ratio", "1e30"), "alarm_ratio");
    says(RAN(rig, 2, "sign", "plain.bfi", "-o", "n.bfi", "--key", "board.key", "--device", DEVICE),
         "--counter is missing");
    says(RAN(rig, 2, "sign", "plain.bfi", "-o", "n.bfi", "--key", "board.key", "--device", "12", "--counter", "1"),
         "24 hexadecimal digits");
    static const char *const counters[] = {"0", "-1", "4294967296", "7x", "", "1e3", " 7"};
    for (size_t i = 0; i < sizeof counters / sizeof *counters; i++)
        says(RAN(rig, 2, "sign", "plain.bfi", "-o", "n.bfi", "--key", "board.key", "--device", DEVICE, "--counter",
                 counters[i]),
             "from 1 to 4294967295");
    says(RAN(rig, 2, "verify"), "beamfit verify IMAGE");
    says(RAN(rig, 2, "replay", "record.csv"), "--image");
    assert_false(file_exists(rig->dir, "n.bfi"));
}

static void what_the_model_does_not_say(void **state)
{
    struct rig *rig = *state;
    write_model(rig, "quiet.yaml", " []", "");
    says(RAN(rig, 3, "export", "quiet.yaml", "-o", "n.bfi"), "--noise-rms");
    says(RAN(rig, 0, "export", "quiet.yaml", "-o", "n.bfi", "--noise-rms", "0.003"), "noise from the command line");
    write_model(rig, "hum.yaml", " [{kind: mains_hum}]", "\n  noise_rms: 0.002");
    says(RAN(rig, 3, "export", "hum.yaml", "-o", "m.bfi"), "--without mains_hum");
    says(RAN(rig, 0, "export", "hum.yaml", "-o", "m.bfi", "--without", "mains_hum"), "left out, as asked");
    write_model(rig, "wrong.yaml", " []", "\n  alarm: 3");
    says(RAN(rig, 3, "export", "wrong.yaml", "-o", "k.bfi"), "wrong.yaml:20: ");
    write_text(rig->dir, "bare.yaml", rig_model);
    says(RAN(rig, 3, "export", "bare.yaml", "-o", "k.bfi"), "sample rate");
    assert_false(file_exists(rig->dir, "k.bfi"));
}

static void an_old_image_stays_when_a_new_one_cannot_be_made(void **state)
{
    struct rig *rig = *state;
    write_text(rig->dir, "old.bfi", rig_old_output);
    write_model(rig, "hum.yaml", " [{kind: mains_hum}]", "\n  noise_rms: 0.002");
    RAN(rig, 3, "export", "hum.yaml", "-o", "old.bfi", "--force");
    assert_true(file_is(rig->dir, "old.bfi", rig_old_output));
    RAN(rig, 3, "export", "model.yaml", "-o", "no/such/place.bfi");
}

static void answers_for_programs(void **state)
{
    struct rig *rig = *state;
    static const char *const export_keys[] = {"file",  "bytes", "signed", "device",   "counter", "model_sha256",
                                              "board", "step",  "uses",   "deployed", "effects", "notes"};
    json_error_t error;
    write_model(rig, "drag.yaml", "\n  - {kind: quadratic_drag}\n  - {kind: tip_mass}", "\n  noise_rms: 0.002");
    json_t *root = json_loads(RAN(rig, 0, "export", "drag.yaml", "-o", "drag.bfi", "--a2l", "drag.a2l", "--json"),
                              JSON_REJECT_DUPLICATES, &error);
    assert_non_null(root);
    for (size_t i = 0; i < sizeof export_keys / sizeof *export_keys; i++)
        if (json_object_get(root, export_keys[i]) == NULL)
            fail_msg("no key '%s'", export_keys[i]);
    assert_int_equal(json_integer_value(json_object_get(root, "bytes")) +
                         (json_int_t)json_real_value(json_object_get(root, "bytes")),
                     IMAGE_BYTES);
    json_t *effects = json_object_get(root, "effects"), *deployed = json_object_get(root, "deployed");
    assert_int_equal(json_array_size(effects), 2);
    assert_string_equal(json_string_value(json_object_get(json_array_get(effects, 1), "fate")), "in the matrices");
    assert_true(json_array_size(json_object_get(deployed, "frequency_Hz")) >= 5);
    assert_true(json_number_value(json_object_get(deployed, "float_error")) < 1e-5);
    json_decref(root);
    assert_true(file_exists(rig->dir, "drag.a2l"));
    root = json_loads(RAN(rig, 0, "verify", "signed.bfi", "--json"), JSON_REJECT_DUPLICATES, &error);
    assert_non_null(root);
    assert_true(json_is_true(json_object_get(root, "fine")));
    assert_true(json_is_false(json_object_get(root, "code_checked")));
    json_decref(root);
    RAN(rig, 1, "verify", "signed.bfi", "--stored", "9", "--json");
    root = json_loads(rig->outcome.out, JSON_REJECT_DUPLICATES, &error);
    assert_non_null(root);
    assert_true(json_is_false(json_object_get(root, "fine")));
    says(json_string_value(json_object_get(root, "reason")), "stored");
    json_decref(root);
}

/* The block that init leaves as a comment is what export wants. */
static void the_block_of_init(void **state)
{
    struct rig *rig = *state;
    RAN(rig, 0, "init", "--length", "0.4573", "--width", "0.0203", "--thickness", "0.0016", "--patch", "0.02535",
        "0.08905", "--input", "drive_V=patch_moment", "--output", "piezo_V=patch_strain");
    char *text = strdup(rig->outcome.out), *block = strstr(text, "#board:");
    assert_non_null(block);
    for (char *line = block; line && line[0] == '#'; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL)
        memmove(line, line + 1, strlen(line));
    write_text(rig->dir, "new.yaml", text);
    free(text);
    RAN(rig, 0, "export", "new.yaml", "--noise-rms", "0.01", "-o", "new.bfi");
}

/* Without any drive the model stays at rest: a recording that can be written by hand. */
static void a_recording_at_rest_is_replayed(void **state)
{
    struct rig *rig = *state;
    static const char header[] =
        "# start: model at rest\ntime_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status\n";
    char text[2048];
    size_t n = (size_t)snprintf(text, sizeof text, "%s", header);
    for (int k = 0; k < 10; k++) /* drive at its zero, the sensor one code above */
        n += (size_t)snprintf(text + n, sizeof text - n, "%g,0,0.001,%s,0.001,0.5,%d,%d,%d,%d\n", 1e-3 * k,
                              k == 7 ? "@" : "0", 40 + k, k, 2048 << 16 | 2049, 7 << 24);
    char *at = strchr(text, '@');
    *at = '0';
    write_text(rig->dir, "live.csv", text);
    says(RAN(rig, 0, "replay", "live.csv", "--image", "signed.bfi"),
         "10 of 10 samples compared, all equal bit for bit");
    json_error_t error;
    json_t *root = json_loads(RAN(rig, 0, "replay", "live.csv", "--image", "signed.bfi", "--json"),
                              JSON_REJECT_DUPLICATES, &error);
    assert_non_null(root);
    assert_true(json_is_true(json_object_get(root, "equal")));
    json_decref(root);
    *at = '1';
    write_text(rig->dir, "live.csv", text);
    says(RAN(rig, 1, "replay", "live.csv", "--image", "signed.bfi"), "live.csv:10: sample 47, step 7: predicted is 1");
    says(RAN(rig, 3, "replay", "live.csv", "--image", "plain.bfi"), "counter ends in 7, this one's ends in 0");
    says(RAN(rig, 3, "replay", "record.csv", "--image", "signed.bfi"), "no column 'predicted'");
    says(RAN(rig, 3, "replay", "nowhere.csv", "--image", "signed.bfi"), "nowhere.csv");
    says(RAN(rig, 3, "replay", "live.csv", "--image", "live.csv"), "no target image");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(export_makes_what_verify_takes, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(what_verify_refuses, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(keys_that_others_could_read, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(mistakes_on_the_command_line, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(what_the_model_does_not_say, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(an_old_image_stays_when_a_new_one_cannot_be_made, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(answers_for_programs, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(the_block_of_init, setup, rig_teardown),
        cmocka_unit_test_setup_teardown(a_recording_at_rest_is_replayed, setup, rig_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
