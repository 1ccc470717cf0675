/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>

#include "board_drive.h"
#include "board_options.h"
#include "commands.h"
#include "ground/ground.h"

static const char help[] =
    "Usage: beamfit info --port PORT [--baud RATE] [--json]\n"
    "\n"
    "Says who is at the port: the board's identity and firmware, which model it runs and where from, what its store\n"
    "holds, and what went wrong since power-on. Nothing is changed and no key is needed.\n"
    "\n" BOARD_OPTIONS_HELP "  --json                {\"port\", \"device\", \"firmware\", \"layout\", \"sample_Hz\", "
    "\"running\", \"counter\",\n"
    "                        \"stored\", \"model_sha256\", \"slots\": [2], \"boots\", \"missed\", \"overrun\",\n"
    "                        \"frames_bad\", \"wrong_keys\", \"refused\", \"last_fault\", \"nvm_errors\",\n"
    "                        \"worst_step_us\", \"noise_rms\", \"alarm_ratio\", \"clear_ratio\", \"averaging_s\",\n"
    "                        \"drive\": {\"amplitude\", \"from_Hz\", \"to_Hz\", \"period_s\", \"burst_s\"}}\n"
    "\n"
    "Example:\n"
    "  beamfit info --port /dev/ttyUSB0\n"
    "\n"
    "Exit status: 0 done; 2 usage; 5 no such port, no permission, or no answer from the board.\n";

struct arguments {
    struct board_options board;
    bool json;
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
    static const struct option options[] = {
        BOARD_OPTIONS,
        {"json", no_argument, NULL, 'j'},
        {0},
    };
    int code;
    while ((code = options_next(argc, argv, ":", options, err)) != -1) {
        if (code == 'j')
            a->json = true;
        else if (board_take_option(code, &a->board, err) != BF_OK)
            return BF_USAGE;
    }
    if (options_only(argc, argv, err) != BF_OK)
        return BF_USAGE;
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

static void print_json_drive(struct json *root, const struct answer *a)
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

static enum bf_status print_json(const struct answer *a, struct bf_error *err)
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
                  {"worst_step_us", info->worst_step_us}};
    struct json *root = json_new_object();
    json_put_text(root, "port", port_path(a->link->port));
    json_put_text(root, "device", a->device);
    json_put_text(root, "firmware", a->firmware);
    json_put_number(root, "sample_Hz", sample_Hz(info));
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
    print_json_drive(root, a);
    return json_print_and_free(root, stdout, err);
}

static void print_drive(const struct answer *a)
{
    const double rate_Hz = sample_Hz(&a->link->info);
    const struct beam_drive *drive = &a->drive;
    if (!(drive->amplitude > 0.0F)) {
        (void)printf("Drive     off\n");
        return;
    }
    (void)printf("Drive     chirp from %.4g to %.4g Hz, amplitude %.4g (input's unit)", chirp_start_Hz(drive, rate_Hz),
                 chirp_end_Hz(drive, rate_Hz), (double)drive->amplitude * (double)a->setup.drive_V_per_code);
    if (drive->burst > 0)
        (void)printf(", %.4g s long", (double)drive->burst / rate_Hz);
    if (drive->period > 0)
        (void)printf(", again every %.4g s", (double)drive->period / rate_Hz);
    (void)printf("\n");
}

static void print_text(const struct answer *a)
{
    const struct beam_info *info = &a->link->info;
    (void)printf("Board     %s, firmware %s, at %s\n", a->device, a->firmware, port_path(a->link->port));
    (void)printf("Sampling  %.6g Hz; longest sample interrupt %u us; %u samples missed\n", sample_Hz(info),
                 (unsigned)info->worst_step_us, (unsigned)info->missed);
    (void)printf("Model     %s, counter %u, of model file %.12s...\n", link_running_name(info->running),
                 (unsigned)info->counter, a->sha256);
    (void)printf(
        "Alarm     residual above %.3g times the expected noise of %.4g (output's unit), over %.3g s; off below "
        "%.3g\n",
        (double)a->setup.alarm_ratio, (double)a->setup.noise_rms, (double)a->setup.averaging_s,
        (double)a->setup.clear_ratio);
    print_drive(a);
    (void)printf("Store     slot 0 %s, slot 1 %s, greatest counter %u; %u power-ons; %u failed writes\n",
                 link_slot_name(info->slot_state[0]), link_slot_name(info->slot_state[1]), (unsigned)info->stored,
                 (unsigned)info->boots, (unsigned)info->nvm_errors);
    (void)printf("Line      %u bad frames, %u samples found no room\n", (unsigned)info->frames_bad,
                 (unsigned)info->overrun);
    (void)printf("Refused   %u images, %u keys\n", (unsigned)info->refused, (unsigned)info->wrong_keys);
    if (info->last_fault != BEAM_IMAGE_FINE)
        (void)printf("          the last image: %s\n", beam_image_fault_text((enum beam_image_fault)info->last_fault));
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct answer answer = {0};
    struct link link;
    if (parse(argc, argv, &a, err) != BF_OK || board_open(&a.board, &link, err) != BF_OK)
        return err->status;
    enum bf_status status = ask(&link, &answer, err);
    if (status == BF_OK && a.json)
        status = print_json(&answer, err);
    else if (status == BF_OK)
        print_text(&answer);
    link_close(&link);
    return status;
}

const struct command command_info = {
    .place = 140,
    .name = "info",
    .summary = "who is at the port: board, firmware, running model, store",
    .help = help,
    .run = run,
};
