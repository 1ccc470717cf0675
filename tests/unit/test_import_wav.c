/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <sndfile.h>
#include "test_import.h"

enum { FRAMES = 5000, CHANNELS = 2 };

static double sample(size_t k, size_t channel)
{
    return 0.9 * sin(0.01 * (double)k * (double)(channel + 1));
}

/* A sound file written by libsndfile itself. */
static char *write_sound(const char *name, int format)
{
    SF_INFO info = {.samplerate = 44100, .channels = CHANNELS, .format = format};
    char *path = temporary_file(name, "", 0);
    SNDFILE *sound = sf_open(path, SFM_WRITE, &info);
    assert_non_null(sound);
    for (size_t k = 0; k < FRAMES; k++) {
        double frame[CHANNELS] = {sample(k, 0), sample(k, 1)};
        assert_int_equal(sf_writef_double(sound, frame, 1), 1);
    }
    assert_int_equal(sf_close(sound), 0);
    return path;
}

/* Floats are exact. Integers are rounded (0.5 units), and libsndfile writes with 32767 what it reads with 32768 (0.9). */
static void every_subformat_is_read(void **state)
{
    (void)state;
    static const struct {
        int format;
        double error;
    } formats[] = {{SF_FORMAT_WAV | SF_FORMAT_PCM_16, 1.4 / 32768},
                   {SF_FORMAT_WAV | SF_FORMAT_PCM_24, 1.4 / 8388608},
                   {SF_FORMAT_WAV | SF_FORMAT_PCM_U8, 1.4 / 128},
                   {SF_FORMAT_WAV | SF_FORMAT_PCM_32, 1e-9},
                   {SF_FORMAT_WAV | SF_FORMAT_FLOAT, 1e-7},
                   {SF_FORMAT_WAV | SF_FORMAT_DOUBLE, 0},
                   {SF_FORMAT_WAVEX | SF_FORMAT_PCM_24, 1.4 / 8388608},
                   {SF_FORMAT_AIFF | SF_FORMAT_PCM_16, 1.4 / 32768}};
    static const struct import_reading find_out = {.format = NULL};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
        struct import_file file;
        struct record record;
        struct bf_error err;
        struct import_choice choice = no_choice();
        char *path = write_sound("sound.wav", formats[i].format);
        if (import_read(path, &find_out, &file, &err) != BF_OK)
            fail_msg("%s", err.text);
        assert_string_equal(import_format_name(file.format), "wav");
        makes(&file, &choice, &record);
        assert_int_equal(record.n, FRAMES);
        assert_int_equal(record.n_columns, CHANNELS);
        assert_true(record.dt_s == 1.0 / 44100 && record.t0_s == 0);
        for (size_t c = 0; c < CHANNELS; c++)
            for (size_t k = 0; k < FRAMES; k++)
                assert_true(fabs(record.columns[c].x[k] - sample(k, c)) <= formats[i].error);
        record_free(&record);
        import_free(&file);
        unlink(path);
        free(path);
    }
}

static void a_scale_makes_volts(void **state)
{
    (void)state;
    static const struct import_reading find_out = {.format = NULL};
    struct import_file file;
    struct record record;
    struct bf_error err;
    struct import_choice choice = no_choice();
    const struct import_pick pick = {"#1", "piezo_V"};
    const struct import_scale scale = {"piezo_V", 2.5, "V", NULL};
    choice.n_picks = choice.n_scales = 1;
    choice.picks = &pick;
    choice.scales = &scale;
    char *path = write_sound("sound.wav", SF_FORMAT_WAV | SF_FORMAT_DOUBLE);
    assert_int_equal(import_read(path, &find_out, &file, &err), BF_OK);
    makes(&file, &choice, &record);
    assert_true(record_column(&record, "piezo_V")[100] == 2.5 * sample(100, 0));
    assert_string_equal(record_meta(&record, "unit_piezo_V"), "V");
    record_free(&record);
    import_free(&file);
    unlink(path);
    free(path);
}

static void what_is_no_sound_is_refused(void **state)
{
    (void)state;
    refuses("x.wav", "RIFF\x10\0\0\0WAVEfmt ", 16, "no sound file", "export");
    refuses("x.wav", "RIFF\x04\0\0\0WAVE----", 16, "x.wav", "export");
}

static void any_damage_is_survived(void **state)
{
    (void)state;
    static struct bytes good;
    char *path = write_sound("short.wav", SF_FORMAT_WAV | SF_FORMAT_PCM_16);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    good.n = fread(good.data, 1, 400, f);
    fclose(f);
    unlink(path);
    free(path);
    survives_damage("damaged.wav", &good, "wav", 17);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_subformat_is_read),
        cmocka_unit_test(a_scale_makes_volts),
        cmocka_unit_test(what_is_no_sound_is_refused),
        cmocka_unit_test(any_damage_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
