/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>

#include "board_drive.h"
#include "board_options.h"
#include "commands.h"
#include "ground/ground.h"

static const struct answer_field drive_fields[] = {
    ANSWER_ROW(NUMBER, "amplitude", "in the drive's unit", .digits = 4),
    ANSWER_ROW(NUMBER, "from_Hz", "where the sweep begins", .digits = 4),
    ANSWER_ROW(NUMBER, "to_Hz", "where it ends", .digits = 4),
    ANSWER_ROW(NUMBER, "period_s", "it is repeated so often", .digits = 4),
    ANSWER_ROW(NUMBER, "burst_s", "and drives so long", .digits = 4),
    {0},
};

static const struct answer_field reset_fields[] = {
    ANSWER_ROW(COUNT, "power", "power came back"),
    ANSWER_ROW(COUNT, "pin", "somebody pulled the pin"),
    ANSWER_ROW(COUNT, "fault", "the processor faulted"),
    ANSWER_ROW(COUNT, "watchdog", "the program hung"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "port", "of the board"),
    ANSWER_ROW(TEXT, "device", "its identity, 24 hexadecimal digits"),
    ANSWER_ROW(TEXT, "firmware", "its version"),
    ANSWER_ROW(NUMBER, "sample_Hz", "samples a second", .digits = 6),
    ANSWER_ROW(NUMBER, "core_MHz", "clock of the processor", .digits = 4),
    ANSWER_ROW(TEXT, "running", "which model runs, and where from"),
    ANSWER_ROW(TEXT, "model_sha256", "of the model file behind it"),
    ANSWER_ROW(COUNT, "counter", "of the running image"),
    ANSWER_ROW(COUNT, "stored", "of the image in store"),
    ANSWER_ROW(COUNT, "boots", "since power-on"),
    ANSWER_ROW(COUNT, "missed", "samples that it was too slow for"),
    ANSWER_ROW(COUNT, "overrun", "samples that the line was too slow for"),
    ANSWER_ROW(COUNT, "frames_bad", "frames that it did not understand"),
    ANSWER_ROW(COUNT, "wrong_keys", "sessions refused for a wrong key"),
    ANSWER_ROW(COUNT, "refused", "images refused"),
    ANSWER_ROW(COUNT, "nvm_errors", "of the store"),
    ANSWER_ROW(COUNT, "layout", "of its images"),
    ANSWER_ROW(COUNT, "worst_step_us", "the longest step"),
    ANSWER_ROW(COUNT, "step_bound", "instructions of a step, at most"),
    ANSWER_ROW(COUNT, "step_budget", "instructions between two samples"),
    ANSWER_ROW(COUNT, "proof_us", "the proof run took"),
    ANSWER_ROW(COUNT, "alarms", "since they were acknowledged"),
    ANSWER_ROW(COUNT, "sensor_faults", "since they were acknowledged"),
    ANSWER_ROW(COUNT, "drive_stops", "drives that the board has stopped by itself"),
    ANSWER_ROW(TEXTS, "slots", "state of each"),
    ANSWER_ROW(TEXT, "last_fault", "why the last image was refused; empty: none was"),
    ANSWER_ROW(NUMBER, "noise_rms", "expected, in the sensor's unit", .digits = 4),
    ANSWER_ROW(NUMBER, "alarm_ratio", "the alarm goes on above", .digits = 3),
    ANSWER_ROW(NUMBER, "clear_ratio", "and off below", .digits = 3),
    ANSWER_ROW(NUMBER, "averaging_s", "of the running mean and rms", .digits = 3),
    ANSWER_ROW(TEXTS, "latched", "alarms and faults that nobody has acknowledged"),
    ANSWER_ROW(NUMBER, "first_s_ago", "the first of them", .unit = "s", .digits = 4),
    ANSWER_ROW(NUMBER, "last_s_ago", "the last of them", .unit = "s", .digits = 4),
    ANSWER_ROW(TEXT, "reset", "why it started last"),
    ANSWER_ROW_OF(OBJECT, "resets", "how often for each reason", reset_fields),
    ANSWER_ROW_OF(OBJECT, "drive", "that is set", drive_fields),
    ANSWER_SAY("Board     \t{device}, firmware {firmware}, at {port}"),
    ANSWER_SAY("Sampling  \t{sample_Hz}; longest sample interrupt {worst_step_us}; {missed} samples missed"),
    ANSWER_SAY("Step      \tat most {step_bound} instructions of the {step_budget} that {core_MHz} leave; longest in "
               "the proof run {proof_us}"),
    ANSWER_SAY("Model     \t{running}, counter {counter}, of model file {model_sha256}"),
    ANSWER_SAY("Alarm     \tresidual above {alarm_ratio} times the expected noise of {noise_rms} (output's unit), over "
               "{averaging_s}; off below {clear_ratio}"),
    ANSWER_SAY(
        "Latched   \t{latched?|nothing since power-on, or since it was acknowledged}[{latched}; {alarms} alarms, "
        "{sensor_faults} faults of the sensor, the first {first_s_ago} ago, the last {last_s_ago} ago]"),
    ANSWER_SAY("Started   \tby {reset}, {boots} times since it was made; since power was applied {resets.pin} by its "
               "pin, {resets.fault} by a fault, {resets.watchdog} by its watchdog"),
    ANSWER_SAY("Drive     \t{drive.amplitude?|off}[{drive.amplitude?}chirp from {drive.from_Hz} to {drive.to_Hz}, "
               "amplitude {drive.amplitude} (input's unit)][{drive.amplitude?}{drive.burst_s?}, {drive.burst_s} long]"
               "[{drive.amplitude?}{drive.period_s?}, again every {drive.period_s}]"),
    ANSWER_SAY("Store     \tslot 0 {slots.0}, slot 1 {slots.1}, greatest counter {stored}; {nvm_errors} failed writes"),
    ANSWER_SAY("Line      \t{frames_bad} bad frames, {overrun} samples found no room"),
    ANSWER_SAY("Refused   \t{refused} images, {wrong_keys} keys[; the last image: {last_fault}]"),
    {0},
};

static const char help[] =
    "Usage: beamfit info --port PORT [--baud RATE] [--acknowledge --key FILE] [--json]\n"
    "\n"
    "Says who is at the port: the board's identity and firmware, which model it runs and where from, what its\n"
    "store holds, and what went wrong since power-on, alarms and faults of the sensor included: those stay until\n"
    "somebody with the key acknowledges them. Nothing is changed and no key is needed otherwise.\n";

static const struct option_row options[] = {
    BOARD_OPTIONS,
    {'a', 0, "acknowledge", NULL, NULL, "forget the alarms and faults shown here; needs --key FILE, the board's key"},
    {'k', 0, "key", "FILE", NULL, "the board's secret key, for --acknowledge"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit info --port /dev/ttyUSB0\n"
    "\n"
    "Exit status: 0 done; 2 usage; 5 no such port, no permission, or no answer from the board.\n";

struct arguments {
    struct board_options board;
    const char *key;
    bool acknowledge;
};

/* Everything that was read, and texts made of it. */
struct answer {
    const struct link *link;
    struct beam_image_setup setup;
    struct beam_drive drive;
    char device[DEVICE_ID_TEXT], firmware[40], sha256[65];
};

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == 'a')
            a->acknowledge = true;
        else if (code == 'k')
            a->key = optarg;
        else if (board_take_option(code, &a->board, err) != BF_OK)
            return BF_USAGE;
    }
    if (options_only(argc, argv, err) != BF_OK)
        return BF_USAGE;
    if (a->acknowledge != (a->key != NULL))
        return bf_fail(err, BF_USAGE,
                       "--acknowledge and --key FILE go together: only who has the board's key may forget its alarms");
    return board_check_options(&a->board, "info", err);
}

static enum bf_status ask(struct link *link, struct answer *out, struct bf_error *err)
{
    const struct beam_info *info = &link->info;
    out->link = link;
    if (link_read_setup(link, &out->setup, err) != BF_OK || link_read_drive(link, &out->drive, err) != BF_OK)
        return err->status;
    device_id_print(info->device, out->device);
    (void)snprintf(out->firmware, sizeof out->firmware, "%u.%u.%u", (unsigned)(info->firmware_version >> 16),
                   (unsigned)(info->firmware_version >> 8 & 255), (unsigned)(info->firmware_version & 255));
    for (size_t i = 0; i < sizeof info->model_sha256; i++)
        (void)snprintf(out->sha256 + 2 * i, 3, "%02x", info->model_sha256[i]);
    return BF_OK;
}

static double sample_Hz(const struct beam_info *info)
{
    return 1e-3 * (double)info->sample_mHz;
}

static void put_drive(struct json *root, const struct answer *a)
{
    const double rate_Hz = sample_Hz(&a->link->info);
    const struct beam_drive *drive = &a->drive;
    struct json *out = json_put(root, "drive", json_new_object());
    json_put_number(out, "amplitude", (double)drive->amplitude * (double)a->setup.drive_V_per_code);
    json_put_number(out, "from_Hz", chirp_start_Hz(drive, rate_Hz));
    json_put_number(out, "to_Hz", chirp_end_Hz(drive, rate_Hz));
    json_put_number(out, "period_s", (double)drive->period / rate_Hz);
    json_put_number(out, "burst_s", (double)drive->burst / rate_Hz);
}

/* Seconds since the sample of this number. */
static double ago_s(const struct beam_info *info, uint32_t sequence)
{
    return (double)(info->sequence - sequence) / sample_Hz(info);
}

static const char *const reset_name[BEAM_RESETS] = {"power", "pin", "fault", "watchdog"};

enum { LATCH_NAMES = 5 };
static const struct {
    uint32_t bit;
    const char *name;
} latch_name[LATCH_NAMES] = {{BEAM_LIVE_ALARM, "model wrong"},
                             {BEAM_LIVE_STUCK, "sensor stuck"},
                             {BEAM_LIVE_AT_END, "sensor at its end"},
                             {BEAM_LIVE_QUIET, "sensor too quiet"},
                             {BEAM_LIVE_OFFSET, "sensor has an offset"}};

static void put_latch(struct json *root, const struct beam_info *info)
{
    struct json *names = json_put(root, "latched", json_new_array());
    for (int i = 0; i < LATCH_NAMES; i++)
        if (info->latched & latch_name[i].bit)
            json_push_text(names, latch_name[i].name);
    json_put_number(root, "first_s_ago", info->latched != 0 ? ago_s(info, info->latch_first) : (double)NAN);
    json_put_number(root, "last_s_ago", info->latched != 0 ? ago_s(info, info->latch_last) : (double)NAN);
}

static const char *reset_of(const struct beam_info *info)
{
    return info->reset < BEAM_RESETS ? reset_name[info->reset] : "unknown";
}

static void put_resets(struct json *root, const struct beam_info *info)
{
    json_put_text(root, "reset", reset_of(info));
    struct json *counts = json_put(root, "resets", json_new_object());
    for (int i = 0; i < BEAM_RESETS; i++)
        json_put_number(counts, reset_name[i], (double)info->resets[i]);
}

static enum bf_status print(const struct answer *a, struct bf_error *err)
{
    const struct beam_info *info = &a->link->info;
    const struct {
        const char *key;
        uint32_t value;
    } counts[] = {{"counter", info->counter},
                  {"stored", info->stored},
                  {"boots", info->boots},
                  {"missed", info->missed},
                  {"overrun", info->overrun},
                  {"frames_bad", info->frames_bad},
                  {"wrong_keys", info->wrong_keys},
                  {"refused", info->refused},
                  {"nvm_errors", info->nvm_errors},
                  {"layout", info->image_layout},
                  {"worst_step_us", info->worst_step_us},
                  {"step_bound", info->step_bound},
                  {"step_budget", info->step_budget},
                  {"proof_us", info->proof_us},
                  {"alarms", info->alarms},
                  {"sensor_faults", info->faults},
                  {"drive_stops", info->drive_stops}};
    struct json *root = json_new_object();
    json_put_text(root, "port", port_path(a->link->port));
    json_put_text(root, "device", a->device);
    json_put_text(root, "firmware", a->firmware);
    json_put_number(root, "sample_Hz", sample_Hz(info));
    json_put_number(root, "core_MHz", 1e-6 * (double)info->core_Hz);
    json_put_text(root, "running", link_running_name(info->running));
    json_put_text(root, "model_sha256", a->sha256);
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        json_put_number(root, counts[i].key, (double)counts[i].value);
    struct json *slots = json_put(root, "slots", json_new_array());
    for (int i = 0; i < 2; i++)
        json_push_text(slots, link_slot_name(info->slot_state[i]));
    json_put_text(root, "last_fault",
                  info->last_fault == BEAM_IMAGE_FINE ? ""
                                                      : beam_image_fault_text((enum beam_image_fault)info->last_fault));
    json_put_number(root, "noise_rms", (double)a->setup.noise_rms);
    json_put_number(root, "alarm_ratio", (double)a->setup.alarm_ratio);
    json_put_number(root, "clear_ratio", (double)a->setup.clear_ratio);
    json_put_number(root, "averaging_s", (double)a->setup.averaging_s);
    put_latch(root, info);
    put_resets(root, info);
    put_drive(root, a);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status acknowledge(const struct arguments *a, struct link *link, struct bf_error *err)
{
    struct device_key key;
    if (device_key_read(a->key, &key, err) != BF_OK)
        return err->status;
    const enum bf_status status = link_unlock(link, &key, a->key, err);
    device_key_wipe(&key);
    return status == BF_OK ? link_acknowledge(link, err) : status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct answer answer = {0};
    struct link link;
    if (parse(argc, argv, &a, err) != BF_OK || board_open(&a.board, &link, err) != BF_OK)
        return err->status;
    enum bf_status status = a.acknowledge ? acknowledge(&a, &link, err) : BF_OK;
    if (status == BF_OK)
        status = ask(&link, &answer, err);
    if (status == BF_OK)
        status = print(&answer, err);
    link_close(&link);
    return status;
}

const struct command command_info = {
    .place = 140,
    .name = "info",
    .summary = "who is at the port: board, firmware, running model, store",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
