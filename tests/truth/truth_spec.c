/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Spec files: one statement a line; the words are listed in docs/truth.md. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_WORDS = 24 };

struct words {
    size_t n;
    char *word[MAX_WORDS];
};

void truth_spec_default(struct truth_spec *spec)
{
    /* the paper's beam as Table 3 has it for B1TAPIH; r² of the sections from their thickness, h²/12 */
    *spec = (struct truth_spec){.length_m = 0.4573,
                                .support = TRUTH_CLAMPED_FREE,
                                .n_regions = 2,
                                .gamma_sNpm2 = 0.013,
                                .Ks_V = 40,
                                .KB_NmpV = 1.746e-2,
                                .sample_rate_Hz = 1024,
                                .duration_s = 4,
                                .filter_order = 8,
                                .filter_ratio = 0.4,
                                .noise = 0.004,
                                .adc_bits = 16,
                                .adc_headroom = 1.1,
                                .seed = 1,
                                .elements = 80,
                                .modes = 40,
                                .static_vectors = true,
                                .tolerance = 1e-8,
                                .live = {.drive_per_code = 0.05,
                                         .drive_zero_code = 2048,
                                         .sensor_per_code = 0.01,
                                         .sensor_zero_code = 2048,
                                         .code_max = 4095}};
    spec->region[0] = (struct truth_region){0, 0.4573, 0.491, 0.093, 0.649e-5, 1.6e-3 * 1.6e-3 / 12};
    spec->region[1] = (struct truth_region){0.02535, 0.08905, 0.793, 0.433, 1.255e-5, 2.108e-3 * 2.108e-3 / 12};
}

static int number(const char *text, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && *end == '\0' && !isnan(*value) ? 0 : -1;
}

/* "name=value" → value; NULL when the word is not of that name */
static const char *option(const char *word, const char *name)
{
    size_t n = strlen(name);
    return strncmp(word, name, n) == 0 && word[n] == '=' ? word + n + 1 : NULL;
}

static int find_port(const struct truth_port *port, size_t n, const char *name)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(port[i].name, name) == 0)
            return (int)i;
    return -1;
}

static int read_port(const struct words *words, bool input, struct truth_port *port, char *message)
{
    static const struct {
        const char *name;
        bool input;
        enum truth_port_kind kind;
    } kinds[] = {{"point_force", true, TRUTH_POINT_FORCE},    {"patch_moment", true, TRUTH_PATCH_MOMENT},
                 {"patch_strain", false, TRUTH_PATCH_STRAIN}, {"displacement", false, TRUTH_DISPLACEMENT},
                 {"velocity", false, TRUTH_VELOCITY},         {"acceleration", false, TRUTH_ACCELERATION}};
    bool known = false;
    *port = (struct truth_port){.noise = -1, .gain = 1, .at_m = -1};
    if (words->n < 3 || strlen(words->word[1]) >= TRUTH_NAME)
        return truth_fail(message, "%s needs a name and a kind", words->word[0]);
    snprintf(port->name, sizeof port->name, "%s", words->word[1]);
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        if (kinds[k].input == input && strcmp(kinds[k].name, words->word[2]) == 0) {
            port->kind = kinds[k].kind;
            known = true;
        }
    if (!known)
        return truth_fail(message, "'%s' is no kind of %s", words->word[2], words->word[0]);
    for (size_t i = 3; i < words->n; i++) {
        const char *text;
        double flag = 0;
        int bad = -1;
        if ((text = option(words->word[i], "at_m")))
            bad = number(text, &port->at_m);
        else if ((text = option(words->word[i], "noise")))
            bad = number(text, &port->noise);
        else if ((text = option(words->word[i], "gain")))
            bad = number(text, &port->gain);
        else if ((text = option(words->word[i], "omitted")))
            bad = number(text, &flag);
        if (bad != 0)
            return truth_fail(message, "'%s' is not understood", words->word[i]);
        port->omitted = port->omitted || flag != 0;
    }
    bool patch = port->kind == TRUTH_PATCH_MOMENT || port->kind == TRUTH_PATCH_STRAIN;
    return patch || port->at_m >= 0 ? 0 : truth_fail(message, "%s needs at_m", port->name);
}

static int read_signal(struct truth_spec *spec, const struct words *words, char *message)
{
    static const char *const kinds[] = {"raised_cosine", "half_sine", "triangle", "chirp",
                                        "multisine",     "burst",     "sine"};
    struct truth_signal signal = {.level = 1, .count = 1, .kind = TRUTH_RECORDED};
    int input = words->n < 3 ? -1 : find_port(spec->input, spec->n_inputs, words->word[1]);
    if (input < 0 || spec->n_signals == TRUTH_SIGNALS)
        return truth_fail(message, "signal: no such input, or too many signals");
    signal.input = (size_t)input;
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        if (strcmp(kinds[k], words->word[2]) == 0)
            signal.kind = (enum truth_signal_kind)k;
    if (signal.kind == TRUTH_RECORDED)
        return truth_fail(message, "'%s' is no kind of signal", words->word[2]);
    for (size_t i = 3; i < words->n; i++) {
        const struct {
            const char *name;
            double *value;
        } real[] = {{"start_s", &signal.start_s},    {"width_s", &signal.width_s}, {"level", &signal.level},
                    {"from_Hz", &signal.from_Hz},    {"to_Hz", &signal.to_Hz},     {"taper_s", &signal.taper_s},
                    {"phase_rad", &signal.phase_rad}};
        double whole = 0;
        int bad = -1;
        const char *text;
        for (size_t k = 0; k < sizeof real / sizeof real[0]; k++)
            if ((text = option(words->word[i], real[k].name)))
                bad = number(text, real[k].value);
        if ((text = option(words->word[i], "count")) && (bad = number(text, &whole)) == 0 && whole >= 1)
            signal.count = (size_t)whole;
        if ((text = option(words->word[i], "seed")) && (bad = number(text, &whole)) == 0 && whole >= 0)
            signal.seed = (uint64_t)whole;
        if (bad != 0)
            return truth_fail(message, "'%s' is not understood", words->word[i]);
    }
    if (!(signal.width_s > 0) && signal.kind != TRUTH_SINE && signal.kind != TRUTH_MULTISINE)
        return truth_fail(message, "signal %s needs width_s > 0", words->word[1]);
    spec->signal[spec->n_signals++] = signal;
    return 0;
}

static int read_effect(struct truth_spec *spec, const struct words *words, char *message)
{
    struct truth_effect *effect = words->n > 1 ? truth_effect_add(spec, words->word[1]) : NULL;
    if (!effect)
        return truth_fail(message, "effect: unknown id, or too many");
    for (size_t i = 2; i < words->n; i++) {
        const char *channel = option(words->word[i], "channel");
        char *equals = strchr(words->word[i], '=');
        double value = 0;
        if (channel) {
            effect->output = find_port(spec->output, spec->n_outputs, channel);
            if (effect->output < 0)
                return truth_fail(message, "effect: there is no output '%s' above this line", channel);
            continue;
        }
        if (!equals || number(equals + 1, &value) != 0)
            return truth_fail(message, "'%s' is not name=value", words->word[i]);
        *equals = '\0';
        if (truth_effect_set(effect, words->word[i], value) != 0)
            return truth_fail(message, "%s has no parameter '%s'", words->word[1], words->word[i]);
    }
    return 0;
}

static int read_region(struct truth_spec *spec, const struct words *words, char *message)
{
    struct truth_region region = {.gyration2_m2 = spec->region[0].gyration2_m2};
    double *field[] = {&region.from_m, &region.to_m, &region.EI_Nm2, &region.rho_kgpm, &region.cDI_sNm2};
    if (words->n != 6 || spec->n_regions == TRUTH_REGIONS)
        return truth_fail(message, "region: from_m to_m EI_Nm2 rho_kgpm cDI_sNm2, at most %d", TRUTH_REGIONS);
    for (size_t i = 0; i < 5; i++)
        if (number(words->word[i + 1], field[i]) != 0)
            return truth_fail(message, "'%s' is not a number", words->word[i + 1]);
    spec->region[spec->n_regions++] = region;
    return 0;
}

static int read_support(struct truth_spec *spec, const struct words *words, char *message)
{
    static const char *const names[] = {"clamped-free", "clamped-clamped", "pinned-pinned", "free-free"};
    for (size_t k = 0; words->n == 2 && k < sizeof names / sizeof names[0]; k++)
        if (strcmp(names[k], words->word[1]) == 0) {
            spec->support = (enum truth_support)k;
            return 0;
        }
    return truth_fail(message, "support: clamped-free, clamped-clamped, pinned-pinned or free-free");
}

static int read_live(struct truth_live *live, const struct words *words, char *message)
{
    const struct {
        const char *name;
        double *value;
    } known[] = {{"drive_per_code", &live->drive_per_code},
                 {"drive_zero_code", &live->drive_zero_code},
                 {"sensor_per_code", &live->sensor_per_code},
                 {"sensor_zero_code", &live->sensor_zero_code},
                 {"code_max", &live->code_max},
                 {"noise_rms", &live->noise_rms}};
    for (size_t i = 1; i < words->n; i++) {
        int bad = -1;
        for (size_t k = 0; k < sizeof known / sizeof known[0]; k++) {
            const char *text = option(words->word[i], known[k].name);
            bad = text ? number(text, known[k].value) : bad;
        }
        if (bad != 0)
            return truth_fail(message, "'%s' is not understood", words->word[i]);
    }
    bool fine = live->code_max >= 1 && live->code_max <= 65535 && live->sensor_per_code > 0 && live->noise_rms >= 0;
    return fine ? 0 : truth_fail(message, "live: sensor_per_code > 0, noise_rms >= 0, code_max 1..65535");
}

struct key {
    const char *name;
    double *first, *second;
};

/* 0 stored, 1 none of these keys, −1 bad */
static int store(const struct key *keys, size_t n, const struct words *words, char *message)
{
    for (size_t k = 0; k < n; k++) {
        if (strcmp(keys[k].name, words->word[0]) != 0)
            continue;
        size_t wanted = keys[k].second ? 3 : 2;
        if (words->n != wanted || number(words->word[1], keys[k].first) != 0 ||
            (keys[k].second && number(words->word[2], keys[k].second) != 0))
            return truth_fail(message, "%s needs %zu number(s)", keys[k].name, wanted - 1);
        return 0;
    }
    return 1;
}

static int read_real(struct truth_spec *spec, const struct words *words, char *message)
{
    struct truth_region *beam = &spec->region[0], *patch = &spec->region[1];
    const struct key keys[] = {
        {"length_m", &spec->length_m, NULL},         {"patch_m", &patch->from_m, &patch->to_m},
        {"EI_beam_Nm2", &beam->EI_Nm2, NULL},        {"EI_patch_Nm2", &patch->EI_Nm2, NULL},
        {"rho_beam_kgpm", &beam->rho_kgpm, NULL},    {"rho_patch_kgpm", &patch->rho_kgpm, NULL},
        {"cDI_beam_sNm2", &beam->cDI_sNm2, NULL},    {"cDI_patch_sNm2", &patch->cDI_sNm2, NULL},
        {"gamma_sNpm2", &spec->gamma_sNpm2, NULL},   {"Ks_V", &spec->Ks_V, NULL},
        {"KB_NmpV", &spec->KB_NmpV, NULL},           {"sample_rate_Hz", &spec->sample_rate_Hz, NULL},
        {"duration_s", &spec->duration_s, NULL},     {"keep_from_s", &spec->keep_from_s, NULL},
        {"filter_ratio", &spec->filter_ratio, NULL}, {"noise", &spec->noise, NULL},
        {"input_noise", &spec->input_noise, NULL},   {"noise_ar", &spec->noise_ar[0], &spec->noise_ar[1]},
        {"adc_headroom", &spec->adc_headroom, NULL}, {"tolerance", &spec->tolerance, NULL}};
    int status = store(keys, sizeof keys / sizeof keys[0], words, message);
    beam->to_m = spec->length_m;
    if (status == 0 && !(spec->length_m > 0 && spec->sample_rate_Hz > 0 && spec->duration_s > 0))
        return truth_fail(message, "%s must be positive", words->word[0]);
    return status;
}

/* Whole numbers and switches. */
static int read_whole(struct truth_spec *spec, const struct words *words, char *message)
{
    double value[12] = {(double)spec->elements,     (double)spec->modes,  (double)spec->oversampling,
                        (double)spec->filter_order, spec->filter_causal,  (double)spec->adc_bits,
                        spec->adc_inputs,           (double)spec->seed,   spec->force_ode,
                        spec->linear_hold,          spec->static_vectors, spec->blind};
    static const struct {
        const char *name;
        double least, most;
    } limit[12] = {{"elements", 4, 1000},   {"modes", 1, 400},     {"oversampling", 0, 1000}, {"filter_order", 0, 20},
                   {"filter_causal", 0, 1}, {"adc_bits", 0, 32},   {"adc_inputs", 0, 1},      {"seed", 0, 0x1p53},
                   {"force_ode", 0, 1},     {"linear_hold", 0, 1}, {"static_vectors", 0, 1},  {"blind", 0, 1}};
    struct key keys[12];
    for (size_t k = 0; k < 12; k++)
        keys[k] = (struct key){limit[k].name, &value[k], NULL};
    int status = store(keys, 12, words, message);
    for (size_t k = 0; k < 12; k++)
        if (!(value[k] >= limit[k].least && value[k] <= limit[k].most))
            return truth_fail(message, "%s is out of range", limit[k].name);
    spec->elements = (size_t)value[0];
    spec->modes = (size_t)value[1];
    spec->oversampling = (size_t)value[2];
    spec->filter_order = 2 * (size_t)(value[3] / 2);
    spec->filter_causal = value[4] > 0;
    spec->adc_bits = (unsigned)value[5];
    spec->adc_inputs = value[6] > 0;
    spec->seed = (uint64_t)value[7];
    spec->force_ode = value[8] > 0;
    spec->linear_hold = value[9] > 0;
    spec->static_vectors = value[10] > 0;
    spec->blind = value[11] > 0;
    return status;
}

int truth_spec_line(struct truth_spec *spec, const char *line, char message[TRUTH_MESSAGE])
{
    char copy[512], *rest = copy, *word;
    struct words words = {0};
    if (snprintf(copy, sizeof copy, "%s", line) >= (int)sizeof copy)
        return truth_fail(message, "line too long");
    copy[strcspn(copy, "#")] = '\0';
    while ((word = strtok_r(rest, " \t\r\n", &rest))) {
        if (words.n == MAX_WORDS)
            return truth_fail(message, "too many words");
        if (strcmp(word, "=") != 0)
            words.word[words.n++] = word;
    }
    if (words.n == 0)
        return 0;
    if (strcmp(words.word[0], "input") == 0 || strcmp(words.word[0], "output") == 0) {
        bool input = words.word[0][0] == 'i';
        size_t *n = input ? &spec->n_inputs : &spec->n_outputs;
        struct truth_port *port = input ? spec->input : spec->output;
        if (*n == TRUTH_PORTS)
            return truth_fail(message, "at most %d of them", TRUTH_PORTS);
        if (read_port(&words, input, &port[*n], message) != 0)
            return -1;
        ++*n;
        return 0;
    }
    if (strcmp(words.word[0], "signal") == 0)
        return read_signal(spec, &words, message);
    if (strcmp(words.word[0], "effect") == 0)
        return read_effect(spec, &words, message);
    if (strcmp(words.word[0], "live") == 0)
        return read_live(&spec->live, &words, message);
    if (strcmp(words.word[0], "region") == 0)
        return read_region(spec, &words, message);
    if (strcmp(words.word[0], "support") == 0)
        return read_support(spec, &words, message);
    int status = read_real(spec, &words, message);
    status = status == 1 ? read_whole(spec, &words, message) : status;
    return status <= 0 ? status : truth_fail(message, "unknown word '%s'", words.word[0]);
}

int truth_spec_read(struct truth_spec *spec, const char *path, char message[TRUTH_MESSAGE])
{
    FILE *file = fopen(path, "r");
    char line[512], inner[TRUTH_MESSAGE];
    int status = 0;
    if (!file)
        return truth_fail(message, "%s: cannot be read", path);
    for (int n = 1; status == 0 && fgets(line, sizeof line, file); n++)
        if (truth_spec_line(spec, line, inner) != 0)
            status = truth_fail(message, "%.80s:%d: %.100s", path, n, inner);
    fclose(file);
    return status;
}
