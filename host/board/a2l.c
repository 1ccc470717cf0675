/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "board.h"

#include <math.h>
#include <stddef.h>

#include "a2l_text.h"
#include "ground/ground.h"
#include "beam_wire.h"

enum a2l_type { F32, U32, U8 };

struct member {
    const char *name, *what;
    enum a2l_type type;
    size_t offset;
    int count;
    const char *method; /* compu method: its unit */
};

#define LIVE(member, type, method, what)                                                                               \
    {                                                                                                                  \
        "live_" #member, what, type, offsetof(struct beam_live, member), 1, method                                     \
    }
#define INFO(member, type, count, what)                                                                                \
    {                                                                                                                  \
        "info_" #member, what, type, offsetof(struct beam_info, member), count, "NO_COMPU_METHOD"                      \
    }
#define DRIVE(member, type, method, what)                                                                              \
    {                                                                                                                  \
        "drive_" #member, what, type, offsetof(struct beam_drive, member), 1, method                                   \
    }
#define SETUP(member, method, what)                                                                                    \
    {                                                                                                                  \
        "image_" #member, what, F32,                                                                                   \
            offsetof(struct beam_image_front, setup) + offsetof(struct beam_image_setup, member), 1, method            \
    }

#define TRACKING(member, type, method, what)                                                                           \
    {                                                                                                                  \
        "tracking_" #member, what, type, offsetof(struct beam_tracking, member), 1, method                             \
    }
#define TRACKED_ONE(i, member, method, what)                                                                           \
    {                                                                                                                  \
        "tracking_" #i "_" #member, what, F32, offsetof(struct beam_tracking, mode[i].member), 1, method               \
    }
#define TRACKED(i)                                                                                                     \
    TRACKED_ONE(i, frequency_Hz, "cm_hertz", "frequency of a followed mode"),                                          \
        TRACKED_ONE(i, frequency_se_Hz, "cm_hertz", "its standard error"),                                             \
        TRACKED_ONE(i, damping, "NO_COMPU_METHOD", "damping ratio of a followed mode"),                                \
        TRACKED_ONE(i, damping_se, "NO_COMPU_METHOD", "its standard error"),                                           \
        TRACKED_ONE(i, gain, "NO_COMPU_METHOD", "gain of a followed mode over the model's"),                           \
        TRACKED_ONE(i, gain_se, "NO_COMPU_METHOD", "its standard error")

static const struct member live[] = {
    LIVE(sequence, U32, "NO_COMPU_METHOD", "sample intervals since power-on"),
    LIVE(step, U32, "NO_COMPU_METHOD", "steps since the model was last put to rest"),
    LIVE(input, F32, "cm_drive", "drive as the model saw it"),
    LIVE(measured, F32, "cm_sensor", "sensor"),
    LIVE(predicted, F32, "cm_sensor", "the model's prediction of the sensor"),
    LIVE(residual, F32, "cm_sensor", "measured less predicted"),
    LIVE(innovation, F32, "cm_sensor", "of the residual what the observer did not expect"),
    LIVE(ratio, F32, "cm_ratio", "running residual rms about its mean over the expected noise"),
    LIVE(innovation_ratio, F32, "cm_ratio", "running rms of the innovation, limited, over what is expected"),
    LIVE(codes, U32, "NO_COMPU_METHOD", "sensor code in bits 0 to 15, drive code in bits 16 to 31"),
    LIVE(status, U32, "NO_COMPU_METHOD",
         "bit 0 alarm, 1 built-in model, 2 solve, 3 reset, 4 clipped; sensor: 5 quiet, 6 stuck, 7 at its end, 8 "
         "offset; 24 to 31 counter"),
    LIVE(crc32, U32, "NO_COMPU_METHOD", "CRC-32 of the 36 bytes before it"),
};
static const struct member info[] = {
    INFO(firmware_version, U32, 1, "major, minor and patch in bits 16, 8 and 0"),
    INFO(image_layout, U32, 1, "layout of images it takes"),
    INFO(image_bytes, U32, 1, "bytes of an image"),
    INFO(device, U8, 12, "identity"),
    INFO(sample_mHz, U32, 1, "sample rate in mHz"),
    INFO(running, U32, 1, "0 built-in model, 1 slot 0, 2 slot 1, 3 downloaded"),
    INFO(counter, U32, 1, "counter of the active image"),
    INFO(stored, U32, 1, "greatest counter in the store"),
    INFO(missed, U32, 1, "conversions that were due and did not take place"),
    INFO(overrun, U32, 1, "samples that found no room on the line"),
    INFO(frames_bad, U32, 1, "frames dropped for length or sum"),
    INFO(wrong_keys, U32, 1, "since power-on"),
    INFO(refused, U32, 1, "images refused since power-on"),
    INFO(last_fault, U32, 1, "why the last image was refused"),
    INFO(slot_state, U32, 2, "0 empty, 1 valid, 2 spoilt"),
    INFO(boots, U32, 1, "starts counted in the store"),
    INFO(nvm_errors, U32, 1, "failed erases and programmings since power-on"),
    INFO(worst_step_us, U32, 1, "longest sample interrupt in microseconds"),
    INFO(model_sha256, U8, 32, "of the model file the active image was made from"),
    INFO(core_Hz, U32, 1, "clock of the processor"),
    INFO(step_budget, U32, 1, "instructions that the bound of a step may have"),
    INFO(step_bound, U32, 1, "instructions of the active image's step, at most"),
    INFO(proof_us, U32, 1, "longest step in the proof run in microseconds"),
    INFO(sequence, U32, 1, "of the newest sample"),
    INFO(latched, U32, 1, "bits of live_status that came: alarm and the sensor's faults"),
    INFO(alarms, U32, 1, "times that the alarm came"),
    INFO(faults, U32, 1, "times that a fault of the sensor came"),
    INFO(latch_first, U32, 1, "sequence of the first of them"),
    INFO(latch_last, U32, 1, "sequence of the last of them"),
    INFO(drive_stops, U32, 1, "drives stopped because their session ended or fell silent"),
    INFO(reset, U32, 1, "why it started: 0 power, 1 pin, 2 fault, 3 watchdog"),
    INFO(resets, U32, BEAM_RESETS, "starts for each of these reasons since power was applied"),
};
static const struct member tracking[] = {
    TRACKING(modes, U32, "NO_COMPU_METHOD", "modes that the board follows"),
    TRACKING(samples, U32, "NO_COMPU_METHOD", "since it began"),
    TRACKING(innovation_rms, F32, "cm_sensor", "of what the followed modes leave of the residual"),
    TRACKED(0),
    TRACKED(1),
    TRACKED(2),
};
static const struct member drive[] = {
    DRIVE(amplitude, F32, "cm_code", "of the chirp, in codes of the D/A"),
    DRIVE(rate, U32, "NO_COMPU_METHOD", "frequency at the start: 1/2^32 turns a sample"),
    DRIVE(sweep, U32, "NO_COMPU_METHOD", "change of the frequency a sample"),
    DRIVE(period, U32, "NO_COMPU_METHOD", "samples until it begins again; 0: never"),
    DRIVE(burst, U32, "NO_COMPU_METHOD", "samples of drive in a period; 0: all"),
    DRIVE(flags, U32, "NO_COMPU_METHOD", "bit 0: put the model to rest at the start"),
    DRIVE(generation, U32, "NO_COMPU_METHOD", "write last, unlocked: any new value starts the drive"),
};
/* Read only: a changed image needs a new code, which beamfit sign makes. */
static const struct member setup[] = {
    SETUP(sensor_V_per_code, "cm_sensor", "sensor's unit for one code"),
    SETUP(sensor_zero_code, "cm_code", "code that stands for 0 of the sensor"),
    SETUP(drive_V_per_code, "cm_drive", "drive's unit for one code"),
    SETUP(drive_zero_code, "cm_code", "code that stands for 0 of the drive"),
    SETUP(noise_rms, "cm_sensor", "expected residual"),
    SETUP(alarm_ratio, "cm_ratio", "alarm goes on above"),
    SETUP(clear_ratio, "cm_ratio", "alarm goes off below"),
    SETUP(averaging_s, "cm_second", "time constant of the running mean and rms"),
    SETUP(quiet_ratio, "cm_ratio", "sensor too quiet below"),
    SETUP(offset_ratio, "cm_ratio", "offset of the sensor above"),
};

static const char *const type_name[] = {[F32] = "FLOAT32_IEEE", [U32] = "ULONG", [U8] = "UBYTE"};
static const char *const layout_name[] = {[F32] = "rl_f32", [U32] = "rl_u32", [U8] = "rl_u8"};
static const char *const limits[] = {[F32] = "-1e12 1e12", [U32] = "0 4294967295", [U8] = "0 255"};

static void print_measurements(FILE *f, const struct member members[], size_t n, uint32_t address)
{
    for (size_t i = 0; i < n; i++) {
        const struct member *m = &members[i];
        (void)fprintf(f, "    /begin MEASUREMENT %s \"%s\" %s %s 0 0 %s\n      ECU_ADDRESS 0x%08lX\n", m->name, m->what,
                      type_name[m->type], m->method, limits[m->type], (unsigned long)(address + m->offset));
        if (m->count > 1)
            (void)fprintf(f, "      MATRIX_DIM %d\n", m->count);
        (void)fprintf(f, "    /end MEASUREMENT\n");
    }
}

static void print_characteristics(FILE *f, const struct member members[], size_t n, uint32_t address, bool read_only)
{
    for (size_t i = 0; i < n; i++) {
        const struct member *m = &members[i];
        (void)fprintf(f, "    /begin CHARACTERISTIC %s \"%s\" VALUE 0x%08lX %s 0 %s %s\n%s    /end CHARACTERISTIC\n",
                      m->name, m->what, (unsigned long)(address + m->offset), layout_name[m->type], m->method,
                      limits[m->type], read_only ? "      READ_ONLY\n" : "");
    }
}

static void print_method(FILE *f, const char *name, const char *what, const char *unit)
{
    (void)fprintf(f,
                  "    /begin COMPU_METHOD %s \"%s\" RAT_FUNC \"%%10.6\" \"%s\" COEFFS 0 1 0 0 0 1 /end COMPU_METHOD\n",
                  name, what, unit);
}

/* The sample interval in the coarsest of XCP's time units that holds it in 1..255 to the nearest count. */
static void event_cycle(double sample_Hz, int *cycle, int *unit)
{
    double ns = 1e9 / sample_Hz;
    for (*unit = 0; ns > 255.0 && *unit < 9; ++*unit)
        ns /= 10.0;
    *cycle = (int)fmin(255.0, fmax(1.0, round(ns)));
}

static void print_module(FILE *f, const struct target_image *image)
{
    int cycle, unit;
    event_cycle(image->board.sample_Hz, &cycle, &unit);
    for (int i = 0; a2l_head[i] != NULL; i++)
        (void)fputs(a2l_head[i], f);
    (void)fprintf(f, a2l_segment, (unsigned)BEAM_WIRE_IMAGE, (unsigned)BEAM_IMAGE_BYTES);
    (void)fprintf(f, a2l_protocol, (int)BEAM_WIRE_MAX_PACKET, (int)BEAM_WIRE_MAX_PACKET, (int)BEAM_DAQ_LISTS,
                  (int)BEAM_DAQ_EVENTS, (int)sizeof(struct beam_live), (int)BEAM_DAQ_LISTS, cycle, unit);
    print_measurements(f, live, sizeof live / sizeof *live, BEAM_WIRE_LIVE);
    print_measurements(f, info, sizeof info / sizeof *info, BEAM_WIRE_INFO);
    print_measurements(f, tracking, sizeof tracking / sizeof *tracking, BEAM_WIRE_TRACKING);
    print_characteristics(f, drive, sizeof drive / sizeof *drive, BEAM_WIRE_DRIVE, false);
    print_characteristics(f, setup, sizeof setup / sizeof *setup, BEAM_WIRE_IMAGE, true);
    print_method(f, "cm_sensor", image->board.sensor, image->sensor_unit);
    print_method(f, "cm_drive", image->board.drive, image->drive_unit);
    print_method(f, "cm_code", "converter code", "code");
    print_method(f, "cm_ratio", "times the expected noise", "1");
    print_method(f, "cm_second", "seconds", "s");
    print_method(f, "cm_hertz", "frequency", "Hz");
    for (int t = F32; t <= U8; t++)
        (void)fprintf(f, "    /begin RECORD_LAYOUT %s FNC_VALUES 1 %s ROW_DIR DIRECT /end RECORD_LAYOUT\n",
                      layout_name[t], type_name[t]);
    (void)fputs("  /end MODULE\n/end PROJECT\n", f);
}

enum bf_status a2l_write(const char *path, const struct target_image *image, struct bf_error *err)
{
    struct atomic_file out;
    if (atomic_open(path, &out, err) != BF_OK)
        return err->status;
    outputs_mark(&out, "/* ", " */\n");
    print_module(out.f, image);
    return atomic_commit(&out, err);
}
