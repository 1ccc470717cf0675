/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "commands.h"
#include "record/import/import.h"
#include "ground/ground.h"

static const char help[] =
    "Usage: beamfit import FILE -o OUT.csv [options]\n"
    "       beamfit import FILE --list [--json]\n"
    "\n"
    "Turns a foreign recording into a record: CSV with a header row, 'time_s' first, uniform in time.\n"
    "Reads Universal File Format 58 (ASCII and 58b binary), MATLAB .mat (5 and 7.3), LabVIEW .lvm, WAV, and\n"
    "text tables (separator , ; tab or blank; decimal point or comma; header and units rows or none).\n"
    "Nothing is converted silently: units that the file states are written down, numbers stay as they are.\n"
    "Where the data come from (file, SHA-256, this command) is written into '#' lines of the record.\n"
    "\n"
    "First look what is there, then choose:\n"
    "  --list               channels, units, samples, time axes; writes nothing\n"
    "  --channel FROM=TO    take channel FROM as column TO (again for each column); =TO may be left out.\n"
    "                       FROM is the name in the list, or #3 for the third. Without: all channels\n"
    "  --time CHANNEL       the channel that holds the times\n"
    "  --time-unit UNIT     unit of the times: s, ms, us, min (default: as the file says, else s)\n"
    "  --rate HZ            sampling rate, instead of a time channel or against a wrong one\n"
    "  --scale NAME=K[:UNIT]  multiply a column by K; UNIT is what it is then in (accel_mps2=9.80665:m/s^2)\n"
    "  --from S, --to S     keep only these seconds, both ends included\n"
    "\n"
    "What is known of the excitation (read by fit and compare):\n"
    "  --free-decay         no input was recorded: the beam swings freely from an unknown state\n"
    "  --free-from S        ... from this time on, in seconds of the record\n"
    "  --unknown-level      the input's shape was recorded, its level is unknown\n"
    "\n"
    "Output and reading:\n"
    "  -o, --output FILE    the record; an existing one is replaced only by a whole new one\n"
    "  --digits N           significant digits (default 9; 17 keeps every bit)\n"
    "  --format NAME        the kind of file where the content does not tell: uff, mat ...; a wrong NAME lists all\n"
    "  --separator C, --decimal C   of a text table: ',' ';' ' ' or 'tab'; '.' or ','\n"
    "  --json               one JSON object: columns, samples, dt_s, t0_s; with --list the channels\n"
    "\n"
    "Examples:\n"
    "  A voltmeter's record of a beam after a hit, with two time columns, of which the second is right;\n"
    "  the hit is at sample 5799 = 1.1598 s, and the beam is free soon after:\n"
    "    beamfit import pzt_free_decay.csv --list\n"
    "    beamfit import pzt_free_decay.csv --time time_s_corrected --channel pzt_voltage_V=piezo_V \\\n"
    "                   --free-decay --free-from 1.175 -o hit.csv\n"
    "  An accelerometer in g from LabVIEW, made m/s^2:\n"
    "    beamfit import test.lvm --channel Force=hammer_N --channel Accel=accel_mps2 \\\n"
    "                   --scale accel_mps2=9.80665:m/s^2 -o test.csv\n"
    "  A German spreadsheet of volts without time, 2 kHz:\n"
    "    beamfit import messung.csv --rate 2000 --channel '#1=piezo_V' -o messung_record.csv\n"
    "  A WAV file holds fractions of full scale; the interface had 2.5 V full scale:\n"
    "    beamfit import hit.wav --channel '#1=piezo_V' --scale piezo_V=2.5:V -o hit.csv\n"
    "\n"
    "Exit status: 0 done; 2 usage, or a choice the file cannot satisfy; 3 a bad file, or output not writable.\n";

struct arguments {
    const char *input, *output;
    struct import_reading reading;
    struct import_choice choice;
    struct import_pick *picks;
    struct import_scale *scales;
    char **texts; /* parts of options, owned */
    size_t n_texts;
    char *command;
    int digits;
    bool list, json;
};

enum option_code {
    OPTION_LIST = 256,
    OPTION_CHANNEL,
    OPTION_TIME,
    OPTION_TIME_UNIT,
    OPTION_RATE,
    OPTION_SCALE,
    OPTION_FROM,
    OPTION_TO,
    OPTION_FREE_DECAY,
    OPTION_FREE_FROM,
    OPTION_UNKNOWN_LEVEL,
    OPTION_DIGITS,
    OPTION_FORMAT,
    OPTION_SEPARATOR,
    OPTION_DECIMAL,
    OPTION_JSON
};

static const struct option options[] = {{"list", no_argument, NULL, OPTION_LIST},
                                        {"channel", required_argument, NULL, OPTION_CHANNEL},
                                        {"time", required_argument, NULL, OPTION_TIME},
                                        {"time-unit", required_argument, NULL, OPTION_TIME_UNIT},
                                        {"rate", required_argument, NULL, OPTION_RATE},
                                        {"scale", required_argument, NULL, OPTION_SCALE},
                                        {"from", required_argument, NULL, OPTION_FROM},
                                        {"to", required_argument, NULL, OPTION_TO},
                                        {"free-decay", no_argument, NULL, OPTION_FREE_DECAY},
                                        {"free-from", required_argument, NULL, OPTION_FREE_FROM},
                                        {"unknown-level", no_argument, NULL, OPTION_UNKNOWN_LEVEL},
                                        {"output", required_argument, NULL, 'o'},
                                        {"digits", required_argument, NULL, OPTION_DIGITS},
                                        {"format", required_argument, NULL, OPTION_FORMAT},
                                        {"separator", required_argument, NULL, OPTION_SEPARATOR},
                                        {"decimal", required_argument, NULL, OPTION_DECIMAL},
                                        {"json", no_argument, NULL, OPTION_JSON},
                                        {NULL, 0, NULL, 0}};

/* The text before the last `mark`, and after it (NULL: none); the parts belong to the arguments. */
static void split_option(struct arguments *a, const char *text, char mark, const char **left, const char **right)
{
    char *copy = bf_strdup(text), *at = strrchr(copy, mark);
    a->texts = bf_grow(a->texts, a->n_texts + 1, sizeof *a->texts);
    a->texts[a->n_texts++] = copy;
    *left = copy;
    *right = NULL;
    if (at == NULL)
        return;
    *at = '\0';
    *right = at + 1;
}

static enum bf_status channel_option(struct arguments *a, struct bf_error *err)
{
    struct import_pick pick;
    split_option(a, optarg, '=', &pick.from, &pick.to);
    if (pick.from[0] == '\0' || (pick.to != NULL && pick.to[0] == '\0'))
        return bf_fail(err, BF_USAGE, "--channel %s: give FROM=TO, a channel of the file and a name for its column",
                       optarg);
    a->picks = bf_grow(a->picks, a->choice.n_picks + 1, sizeof *a->picks);
    a->picks[a->choice.n_picks++] = pick;
    a->choice.picks = a->picks;
    return BF_OK;
}

static enum bf_status scale_option(struct arguments *a, struct bf_error *err)
{
    struct import_scale scale;
    const char *value, *factor;
    split_option(a, optarg, '=', &scale.name, &value);
    if (value == NULL)
        return bf_fail(err, BF_USAGE, "--scale %s: give NAME=FACTOR or NAME=FACTOR:UNIT", optarg);
    split_option(a, value, ':', &factor, &scale.unit);
    if (options_number("--scale", factor, &scale.factor, err) != BF_OK)
        return err->status;
    if (scale.factor == 0)
        return bf_fail(err, BF_USAGE, "--scale %s: a factor of 0 leaves nothing", optarg);
    a->scales = bf_grow(a->scales, a->choice.n_scales + 1, sizeof *a->scales);
    a->scales[a->choice.n_scales++] = scale;
    a->choice.scales = a->scales;
    return BF_OK;
}

/* One character out of a set; "tab" means '\t'. */
static enum bf_status character_option(const char *name, const char *allowed, char *out, struct bf_error *err)
{
    char c = strcmp(optarg, "tab") == 0 || strcmp(optarg, "\\t") == 0 ? '\t' : optarg[0];
    if (c == '\0' || strchr(allowed, c) == NULL || (c != '\t' && optarg[1] != '\0'))
        return bf_fail(err, BF_USAGE, "%s '%s': give one of %s", name, optarg,
                       strchr(allowed, ';') != NULL ? "',' ';' ' ' or tab" : "'.' and ','");
    *out = c;
    return BF_OK;
}

static enum bf_status format_option(struct arguments *a, struct bf_error *err)
{
    char known[400];
    a->reading.format = import_format_by_name(optarg);
    if (a->reading.format != NULL)
        return BF_OK;
    import_format_list(sizeof known, known);
    return bf_fail(err, BF_USAGE, "--format %s: give one of %s", optarg, known);
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    double x;
    switch (code) {
    case OPTION_CHANNEL:
        return channel_option(a, err);
    case OPTION_SCALE:
        return scale_option(a, err);
    case OPTION_SEPARATOR:
        return character_option("--separator", ",; \t", &a->reading.separator, err);
    case OPTION_DECIMAL:
        return character_option("--decimal", ".,", &a->reading.point, err);
    case OPTION_FROM:
        return options_number("--from", optarg, &a->choice.from_s, err);
    case OPTION_TO:
        return options_number("--to", optarg, &a->choice.to_s, err);
    case OPTION_FREE_FROM:
        return options_number("--free-from", optarg, &a->choice.free_from_s, err);
    case OPTION_LIST:
        a->list = true;
        return BF_OK;
    case OPTION_JSON:
        a->json = true;
        return BF_OK;
    case OPTION_FREE_DECAY:
        a->choice.free_decay = true;
        return BF_OK;
    case OPTION_UNKNOWN_LEVEL:
        a->choice.unknown_level = true;
        return BF_OK;
    case OPTION_TIME:
        a->choice.time = optarg;
        return BF_OK;
    case OPTION_TIME_UNIT:
        a->choice.time_unit = optarg;
        return BF_OK;
    case 'o':
        a->output = optarg;
        return BF_OK;
    case OPTION_RATE:
        if (options_number("--rate", optarg, &a->choice.rate_Hz, err) == BF_OK && !(a->choice.rate_Hz > 0))
            bf_fail(err, BF_USAGE, "--rate %s: a sampling rate is positive, in Hz", optarg);
        return err->status;
    case OPTION_DIGITS:
        if (options_number("--digits", optarg, &x, err) == BF_OK && !(x >= 1 && x <= 17))
            bf_fail(err, BF_USAGE, "--digits %s: give 1 to 17", optarg);
        a->digits = err->status == BF_OK ? (int)x : 0;
        return err->status;
    case OPTION_FORMAT:
        return format_option(a, err);
    default:
        return bf_fail(err, BF_USAGE, "see 'beamfit import --help'");
    }
}

/* The command line as it was, for the record's metadata. */
static char *command_line(int argc, char **argv)
{
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (f == NULL)
        return bf_strdup("beamfit import");
    fprintf(f, "beamfit %s", BEAMFIT_VERSION);
    for (int i = 0; i < argc; i++)
        fprintf(f, strpbrk(argv[i], " \t'\"#;*?$&|<>()") != NULL ? " '%s'" : " %s", argv[i]);
    fclose(f);
    return text;
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    *a = (struct arguments){.choice = {.from_s = NAN, .to_s = NAN, .free_from_s = NAN}};
    a->command = command_line(argc, argv);
    a->choice.command = a->command;
    err->status = BF_OK;
    opterr = 0;
    while ((code = getopt_long(argc, argv, ":o:", options, NULL)) != -1) {
        if (code == ':' || code == '?')
            return bf_fail(err, BF_USAGE, "%s: %s; see 'beamfit import --help'", argv[optind - 1],
                           code == ':' ? "needs a value" : "no such option");
        if (take_option(a, code, err) != BF_OK)
            return err->status;
    }
    if (argc - optind != 1)
        return bf_fail(err, BF_USAGE, "give one file to import, not %d; see 'beamfit import --help'", argc - optind);
    a->input = argv[optind];
    if (!a->list && a->output == NULL)
        return bf_fail(err, BF_USAGE, "give the record to write with -o OUT.csv, or look into the file with --list");
    if (!isnan(a->choice.free_from_s) && !a->choice.free_decay)
        return bf_fail(err, BF_USAGE, "--free-from needs --free-decay");
    if (a->choice.free_decay && a->choice.unknown_level)
        return bf_fail(err, BF_USAGE, "--free-decay and --unknown-level exclude each other");
    struct stat in, out;
    if (a->output != NULL && stat(a->input, &in) == 0 && stat(a->output, &out) == 0 && in.st_dev == out.st_dev &&
        in.st_ino == out.st_ino)
        return bf_fail(err, BF_USAGE, "-o %s would overwrite the file to import; choose another name", a->output);
    return BF_OK;
}

static void describe_axis(const struct import_file *file, const struct import_channel *c, char text[64])
{
    double factor;
    if (c->axis != IMPORT_NO_AXIS)
        snprintf(text, 64, "times in '%.30s'", file->channels[c->axis].name);
    else if (c->dt_s > 0)
        snprintf(text, 64, "%.9g Hz from %.6g s", 1 / c->dt_s, c->t0_s);
    else if (c->unusable == NULL && c->n >= 2 && import_looks_like_time(c, &factor))
        snprintf(text, 64, "looks like time");
    else
        text[0] = '\0';
}

static enum bf_status print_list(const struct import_file *file, bool json, struct bf_error *err)
{
    char axis[64];
    struct json *root = json ? json_new_object() : NULL, *channels = NULL;
    if (json) {
        json_put_text(root, "format", import_format_name(file->format));
        json_put_text(root, "sha256", file->sha256);
        json_put_number(root, "rate_Hz", file->rate_Hz > 0 ? file->rate_Hz : (double)NAN);
        channels = json_put(root, "channels", json_new_array());
    } else {
        printf("%s: %s, %zu channels", file->path, import_format_name(file->format), file->n_channels);
        if (file->rate_Hz > 0)
            printf(", %.9g Hz (%s)", file->rate_Hz, file->rate_from);
        printf("\n%4s  %-28s %-10s %10s  %s\n", "#", "channel", "unit", "samples", "time axis; notes");
    }
    for (size_t i = 0; i < file->n_channels; i++) {
        const struct import_channel *c = &file->channels[i];
        describe_axis(file, c, axis);
        const char *note = c->unusable != NULL ? c->unusable : c->about;
        if (json) {
            struct json *one = json_push(channels, json_new_object());
            json_put_text(one, "name", c->name);
            json_put_text(one, "unit", c->unit);
            json_put_number(one, "samples", (double)c->n);
            json_put_number(one, "dt_s", c->dt_s > 0 ? c->dt_s : (double)NAN);
            json_put_bool(one, "usable", c->unusable == NULL);
            json_put_text(one, "note", note);
        } else {
            printf("%4zu  %-28s %-10s %10zu  %s%s%s\n", i + 1, c->name, c->unit, c->n, axis,
                   axis[0] != '\0' && note[0] != '\0' ? "; " : "", note);
        }
    }
    return json ? json_print_and_free(root, stdout, err) : BF_OK;
}

static enum bf_status print_record(const struct record *record, const char *output, bool json, struct bf_error *err)
{
    if (json) {
        struct json *root = json_new_object(), *columns = json_put(root, "columns", json_new_array());
        for (size_t i = 0; i < record->n_columns; i++)
            json_push_text(columns, record->columns[i].name);
        json_put_number(root, "samples", (double)record->n);
        json_put_number(root, "dt_s", record->dt_s);
        json_put_number(root, "t0_s", record->t0_s);
        return json_print_and_free(root, stdout, err);
    }
    printf("%s: %zu samples, %.9g Hz, %.6g s to %.6g s; time: %s\n", output, record->n, 1 / record->dt_s, record->t0_s,
           record->t0_s + (double)(record->n - 1) * record->dt_s, record_meta(record, "time_from"));
    for (size_t i = 0; i < record->n_columns; i++) {
        char key[128];
        const double *x = record->columns[i].x;
        double low = x[0], high = x[0];
        for (size_t k = 1; k < record->n; k++) {
            low = fmin(low, x[k]);
            high = fmax(high, x[k]);
        }
        snprintf(key, sizeof key, "channel_%.60s", record->columns[i].name);
        const char *from = record_meta(record, key);
        printf("  %-20s %12.5g to %-12.5g from %s\n", record->columns[i].name, low, high, from != NULL ? from : "");
    }
    return BF_OK;
}

static enum bf_status work(const struct arguments *a, struct bf_error *err)
{
    struct import_file file;
    struct record record;
    if (import_read(a->input, &a->reading, &file, err) != BF_OK)
        return err->status;
    enum bf_status status;
    if (a->list) {
        status = print_list(&file, a->json, err);
    } else {
        status = import_record(&file, &a->choice, &record, err);
        if (status == BF_OK) {
            status = record_write(a->output, &record, a->digits, err);
            if (status == BF_OK)
                status = print_record(&record, a->output, a->json, err);
            record_free(&record);
        }
    }
    import_free(&file);
    return status;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a;
    enum bf_status status = parse(argc, argv, &a, err);
    if (status == BF_OK)
        status = work(&a, err);
    for (size_t i = 0; i < a.n_texts; i++)
        free(a.texts[i]);
    free(a.texts);
    free(a.picks);
    free(a.scales);
    free(a.command);
    return status;
}

const struct command command_import = {
    .place = 120,
    .name = "import",
    .summary = "turn a foreign recording (UFF, MAT, LVM, WAV, CSV) into a record",
    .help = help,
    .run = run,
};
