/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "board_drive.h"
#include "capture.h"
#include "commands.h"
#include "ground/ground.h"

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(COUNT, "samples", "of the record"),
    ANSWER_ROW(NUMBER, "seconds", "it lasts", .unit = "s", .digits = 4),
    ANSWER_ROW(NUMBER, "sample_Hz", "of the board"),
    ANSWER_ROW(COUNT, "prescale", "every so many samples only"),
    ANSWER_ROW(COUNT, "first_step", "step of the model in the first sample"),
    ANSWER_ROW(COUNT, "gaps", "holes in what came"),
    ANSWER_ROW(COUNT, "lost", "samples that did not come"),
    ANSWER_ROW(COUNT, "crc_failures", "samples with a wrong CRC-32"),
    ANSWER_ROW(COUNT, "bad_frames", "starts of frames that were none"),
    ANSWER_ROW(COUNT, "missed", "samples that the board was too slow for"),
    ANSWER_ROW(COUNT, "overrun", "samples that the line was too slow for"),
    ANSWER_ROW(NUMBER, "noise_ratio", "residual over the expected noise", .digits = 3),
    ANSWER_ROW(COUNT, "alarms", "samples under alarm"),
    ANSWER_ROW(COUNT, "clipped", "samples at an end of the range"),
    ANSWER_ROW(COUNT, "sensor_faults", "samples in which the sensor was out of order"),
    ANSWER_ROW(COUNT, "counter", "of the image"),
    ANSWER_ROW(TEXT, "sensor", "stuck, at its end, too quiet, offset; empty: in order"),
    ANSWER_ROW(TEXT, "device", "identity of the board, 24 hexadecimal digits"),
    ANSWER_ROW(TEXT, "model_sha256", "of the model file behind the image"),
    ANSWER_ROW(TEXT, "ended", "why it ended early; empty: it did not"),
    ANSWER_SAY("{file}: {samples} samples at {sample_Hz} ({seconds}), {gaps} {gaps#gap|gaps}[{noise_ratio?}; residual "
               "{noise_ratio} times the expected noise at its end]"),
    {0},
};

static const char help[] =
    "Usage: beamfit record --port PORT --key FILE -o OUT.csv [--seconds S | --samples N] [--chirp F0:F1:T:AMPL] "
    "[options]\n"
    "\n"
    "Records what the board drives and measures, with what its model predicts, as the CSV that `beamfit fit` and\n"
    "`beamfit replay` read. It begins at rest: the drive is turned off until the beam has settled, then the model\n"
    "is put to rest and the drive starts, in the same sample. Columns: time_s, INPUT, OUTPUT, predicted,\n"
    "residual, ratio (residual rms over the expected noise), sequence (the board's samples), step (of the model),\n"
    "codes (sensor in bits 0 to 15, drive above), status, innovation (of the residual what the board's observer\n"
    "did not expect), innovation_ratio. INPUT is held between samples, as a D/A converter does: fit it with\n"
    "--intersample zoh.\n"
    "\n"
    "Every sample carries its number and a CRC-32. A sample that did not come is never made up: OUT.csv is then\n"
    "the longest stretch without a hole, names every hole in a line '# gap: ...', and a warning says so.\n";

static const struct option_row options[] = {
    BOARD_OPTIONS,
    {'o', 'o', "output", "OUT.csv", NULL, "the file to write"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace OUT.csv when it exists: a recording cannot be made again"},
    {'s', 0, "seconds", "S", NULL, "how long, s (default 10)"},
    {'n', 0, "samples", "N", NULL, "how many samples, instead of --seconds"},
    {'c', 0, "chirp", "F0:F1:T:AMPL", NULL,
     "drive: from F0 to F1 Hz in T seconds, amplitude AMPL in the input's unit, again and again"},
    {'e', 0, "every", "S", NULL, "the chirp begins again only every S seconds"},
    {'1', 0, "once", NULL, NULL, "the chirp is not begun again"},
    {'k', 0, "key", "FILE", NULL, "the board's key: without it nobody drives the beam or puts the model to rest"},
    {'d', 0, "drive", "HOW", "off|on|keep",
     "off: no drive (default); on: the drive that is set, started anew; keep: nothing is touched, the "
     "record begins in motion, and no key is needed"},
    {'t', 0, "settle", "S", NULL, "how long the drive is off before (default 2)"},
    {'P', 0, "prescale", "P", NULL,
     "every P-th sample only. By default the least that the line carries: a sample takes 48 bytes, so "
     "115200 bit/s carries 216 a second and 921600 bit/s 1728. A record with P > 1 says nothing about the "
     "motion between its samples; raise --baud rather"},
    {'m', 0, "model", "MODEL", NULL, "names of the columns INPUT and OUTPUT (default drive_V, piezo_V)"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Ctrl-C ends the recording; what has come is written. The drive ends with the recording; should this program\n"
    "be killed or the cable be cut, the board stops it by itself within two seconds.\n"
    "\n"
    "Example:\n"
    "  beamfit record --port /dev/ttyUSB0 --baud 921600 --key board.key --model fitted.yaml --chirp 5:200:8:2 "
    "--seconds 16 -o run.csv\n"
    "  beamfit fit fitted.yaml run.csv --intersample zoh -o better.yaml\n"
    "\n"
    "Exit status: 0 done, also with gaps; 2 usage; 3 OUT.csv not writable, or MODEL bad; 5 no port, no answer,\n"
    "the board fell silent (what had come is written) or no two samples in a row arrived.\n";

enum { MOST_SAMPLES = 2000000000, LONGEST_SETTLE_S = 3600 };
enum drive_choice { BOARD_DRIVE_OFF, BOARD_DRIVE_ON, BOARD_DRIVE_KEEP, BOARD_DRIVE_CHIRP };

struct arguments {
    struct board_options board;
    const char *output, *model, *key;
    double seconds, settle_s;
    long samples, prescale;
    enum drive_choice drive;
    struct chirp chirp;
    bool once, every, given_drive;
};

/* ---- Options ---- */

static enum bf_status take_drive(struct arguments *a, const char *text, struct bf_error *err)
{
    static const char *const names[] = {"off", "on", "keep"}; /* order of enum drive_choice */
    size_t chosen;
    if (options_choice("--drive", text, names, 3, &chosen, err) != BF_OK)
        return BF_USAGE;
    a->drive = (enum drive_choice)chosen;
    a->given_drive = true;
    return BF_OK;
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'm':
        a->model = optarg;
        return BF_OK;
    case 'k':
        a->key = optarg;
        return BF_OK;
    case 's':
        return options_positive("--seconds", optarg, INFINITY, &a->seconds, err);
    case 'n':
        return options_count("--samples", optarg, 2, 1000000000, &a->samples, err);
    case 'P':
        return options_count("--prescale", optarg, 1, BOARD_MOST_PRESCALE, &a->prescale, err);
    case 'c':
        a->drive = BOARD_DRIVE_CHIRP;
        return chirp_read(optarg, &a->chirp, err);
    case 'e':
        a->every = true;
        return options_positive("--every", optarg, INFINITY, &a->chirp.every_s, err);
    case '1':
        a->once = true;
        a->chirp.every_s = -1.0;
        return BF_OK;
    case 'd':
        return take_drive(a, optarg, err);
    case 't':
        if (options_number("--settle", optarg, &a->settle_s, err) == BF_OK &&
            !(a->settle_s >= 0.0 && a->settle_s <= LONGEST_SETTLE_S))
            return bf_fail(err, BF_USAGE, "--settle '%.40s': give from 0 to %d seconds", optarg, LONGEST_SETTLE_S);
        return err->status;
    default:
        return board_take_option(code, &a->board, err);
    }
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    bool chirp = false;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
        chirp = chirp || code == 'c';
    }
    if (optind < argc || a->output == NULL)
        return bf_fail(err, BF_USAGE, "give one file to write: beamfit record --port PORT -o OUT.csv");
    if (a->seconds > 0.0 && a->samples > 0)
        return bf_fail(err, BF_USAGE, "give --seconds or --samples, not both");
    if ((a->once || a->every) && !chirp)
        return bf_fail(err, BF_USAGE, "--every and --once belong to --chirp");
    if ((a->once && a->every) || (chirp && a->given_drive))
        return bf_fail(err, BF_USAGE, "--every and --once, and --drive and --chirp, exclude each other");
    if (a->drive != BOARD_DRIVE_KEEP && a->key == NULL)
        return bf_fail(err, BF_USAGE,
                       "a board puts its model to rest, and drives, only for who has its key: --key FILE (--drive keep "
                       "needs none)");
    return board_check_options(&a->board, "record", err);
}

/* ---- Recording ---- */

static double wanted_samples(const struct arguments *a, const struct recording *recording)
{
    enum { SECONDS = 10 };
    if (a->samples > 0)
        return (double)(a->samples - 1) * recording->prescale;
    const double samples = round((a->seconds > 0.0 ? a->seconds : SECONDS) * recording->sample_Hz);
    return fmax(samples - recording->prescale, recording->prescale);
}

static enum bf_status choose_drive(const struct arguments *a, struct capture *c, struct beam_drive *drive,
                                   struct bf_error *err)
{
    if (link_read_drive(&c->link, drive, err) != BF_OK)
        return err->status;
    if (a->drive == BOARD_DRIVE_OFF)
        drive->amplitude = 0.0F;
    return a->drive == BOARD_DRIVE_CHIRP ? chirp_make(&a->chirp, c->recording.sample_Hz, &c->setup, drive, err) : BF_OK;
}

/* The sequence at which the record begins: of step 0, or with a prescale the sample sent first after it. */
static enum bf_status begin(const struct arguments *a, struct capture *c, uint32_t *from, struct bf_error *err)
{
    struct beam_drive drive;
    if (a->drive != BOARD_DRIVE_KEEP && capture_unlock(c, a->key, err) != BF_OK)
        return err->status;
    if (choose_drive(a, c, &drive, err) != BF_OK || capture_start(c, err) != BF_OK)
        return err->status;
    if (a->drive == BOARD_DRIVE_KEEP ? capture_until(c, 0, NULL, 0, err) != BF_OK
                                     : capture_from_rest(c, &drive, a->settle_s, err) != BF_OK)
        return err->status;
    if (c->recording.n == 0)
        return bf_fail(err, BF_DEVICE, "%s: interrupted before the recording began; nothing was written",
                       a->board.port);
    if (a->drive == BOARD_DRIVE_KEEP)
        recording_drop_before(&c->recording, c->newest);
    *from = c->recording.live[0].sequence;
    if (a->drive != BOARD_DRIVE_KEEP) /* the first that came may not be the first that was sent */
        *from -= (*from - c->origin) / c->recording.prescale * c->recording.prescale;
    return BF_OK;
}

/* Everything between the first and the last sample. */
static enum bf_status record(const struct arguments *a, struct capture *c, struct bf_error *err)
{
    const double wanted = wanted_samples(a, &c->recording);
    uint32_t from = 0;
    if (wanted > MOST_SAMPLES)
        return bf_fail(err, BF_USAGE, "so long a recording does not fit; give at most %.3g s",
                       MOST_SAMPLES / c->recording.sample_Hz);
    if (begin(a, c, &from, err) != BF_OK)
        return err->status;
    struct progress *bar = progress_begin("record");
    const enum bf_status status = capture_until(c, from + (uint32_t)wanted, bar, from, err);
    progress_end(bar);
    recording_drop_after(&c->recording, from + (uint32_t)wanted);
    return status;
}

/* ---- The answer ---- */

/* A recording, what it came to, and how it ended. */
struct outcome {
    const struct arguments *a;
    struct capture *c;
    const struct bf_error *ended; /* BF_OK: as asked */
    struct recording_summary summary;
    struct record record;
};

static void add_meta(struct outcome *o)
{
    const struct capture *c = o->c;
    char text[128];
    record_add_meta(&o->record, "device", c->device);
    record_add_meta(&o->record, "model_sha256", c->sha256);
    (void)snprintf(text, sizeof text, "%u", (unsigned)c->before.counter);
    record_add_meta(&o->record, "image_counter", text);
    (void)snprintf(text, sizeof text, "%.9g", (double)c->setup.noise_rms);
    record_add_meta(&o->record, "expected_noise_rms", text);
    record_add_meta(&o->record, "intersample", "the input is held to the next sample; fit with --intersample zoh");
    (void)snprintf(text, sizeof text, "%llu", (unsigned long long)c->stream.crc_failures);
    record_add_meta(&o->record, "crc_failures", text);
    if (o->ended->status != BF_OK)
        record_add_meta(&o->record, "ended", o->ended->text);
}

static void warn(const struct outcome *o)
{
    const struct recording *recording = &o->c->recording;
    const struct recording_summary *summary = &o->summary;
    const unsigned missed = (unsigned)(o->c->link.info.missed - o->c->before.missed);
    if (recording->prescale > 1)
        bf_warn("every %u. sample is recorded, so motion above %.4g Hz is folded; a greater --baud carries more",
                recording->prescale, 0.5 * recording->sample_Hz / recording->prescale);
    if (summary->breaks > 0)
        bf_warn(
            "%zu gaps, %llu samples lost, %llu with a wrong CRC-32: the record is the longest whole stretch, %zu of "
            "%zu samples; record again for all",
            summary->breaks, (unsigned long long)summary->lost, (unsigned long long)o->c->stream.crc_failures,
            summary->n, recording->n);
    if (recording->live[summary->from].step >= recording->prescale)
        bf_warn("the record begins in motion (step %u); fits take a record to begin at rest",
                (unsigned)recording->live[summary->from].step);
    if (summary->clipped > 0)
        bf_warn("%llu samples are at the end of the sensor's range; drive less", (unsigned long long)summary->clipped);
    if (summary->sensor_faults > 0)
        bf_warn(
            "in %llu samples the board calls its sensor out of order (%s): look at wire, supply and amplifier before "
            "the model",
            (unsigned long long)summary->sensor_faults, link_sensor_fault(summary->sensor_flags));
    if (missed > 0)
        bf_warn("the board missed %u samples meanwhile: its model is too large for its rate", missed);
}

static enum bf_status print(const struct outcome *o, struct bf_error *err)
{
    const struct capture *c = o->c;
    const struct recording_summary *summary = &o->summary;
    const struct {
        const char *key;
        double value;
    } numbers[] = {{"samples", (double)o->record.n},
                   {"seconds", (double)o->record.n * o->record.dt_s},
                   {"sample_Hz", c->recording.sample_Hz},
                   {"prescale", c->recording.prescale},
                   {"first_step", c->recording.live[summary->from].step},
                   {"gaps", (double)summary->breaks},
                   {"lost", (double)summary->lost},
                   {"crc_failures", (double)c->stream.crc_failures},
                   {"bad_frames", (double)c->link.xcp.receiver.resyncs},
                   {"missed", (double)(c->link.info.missed - c->before.missed)},
                   {"overrun", (double)(c->link.info.overrun - c->before.overrun)},
                   {"noise_ratio", summary->noise_ratio},
                   {"alarms", (double)summary->alarms},
                   {"clipped", (double)summary->clipped},
                   {"sensor_faults", (double)summary->sensor_faults},
                   {"counter", c->before.counter}};
    struct json *root = json_new_object();
    json_put_text(root, "file", o->a->output);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        json_put_number(root, numbers[i].key, numbers[i].value);
    json_put_text(root, "sensor", link_sensor_fault(summary->sensor_flags));
    json_put_text(root, "device", c->device);
    json_put_text(root, "model_sha256", c->sha256);
    json_put_text(root, "ended", o->ended->status != BF_OK ? o->ended->text : "");
    answer_next(root, "beamfit", "replay", o->a->output, "--image", "IMAGE", NULL);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status write_and_print(struct outcome *o, struct bf_error *err)
{
    struct capture *c = o->c;
    o->summary = recording_summarise(&c->recording);
    if (recording_make_record(&c->recording, &o->summary, c->input, c->output, c->latency, &o->record, err) != BF_OK)
        return err->status;
    add_meta(o);
    if (record_write(o->a->output, &o->record, RECORDING_DIGITS, err) != BF_OK)
        return err->status;
    warn(o);
    return print(o, err);
}

/* A board that falls silent ends the recording; what came before is worth keeping. */
static enum bf_status answer(const struct arguments *a, struct capture *c, struct bf_error *err)
{
    struct bf_error ended = {BF_OK, ""};
    struct outcome o = {.a = a, .c = c, .ended = &ended};
    enum bf_status status = record(a, c, &ended);
    if (status == BF_OK)
        status = capture_stop(c, &ended);
    if (status == BF_USAGE || (status != BF_OK && c->recording.n < 2))
        return bf_fail(err, status, "%s", ended.text);
    status = write_and_print(&o, err);
    record_free(&o.record);
    if (status == BF_OK && ended.status != BF_OK)
        return bf_fail(err, ended.status, "%s; what came before is in %s", ended.text, a->output);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.settle_s = 2.0};
    struct capture c = {0};
    if (parse(argc, argv, &a, err) != BF_OK || capture_name(&c, a.model, err) != BF_OK)
        return err->status;
    if (atomic_check_file(a.output, err) != BF_OK)
        return err->status;
    progress_catch_interrupts();
    if (capture_open(&c, &a.board, a.prescale, err) != BF_OK)
        return err->status;
    const enum bf_status status = answer(&a, &c, err);
    capture_close(&c);
    return status;
}

const struct command command_record = {
    .place = 150,
    .name = "record",
    .summary = "record the board's samples as the CSV that fit reads",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
    .unrepeatable = true,
};
