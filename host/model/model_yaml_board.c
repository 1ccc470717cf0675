/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_board.c — the `board:` block: what a controller that runs the model is wired to. */
#include "model_yaml.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

static const double code_most = 65535.0, rate_most_Hz = 1e6, clock_most_MHz = 4000.0;

/* ---- Reading ---- */

/* The channel's name must be one of names[n]. */
static enum bf_status read_channel_name(const struct yaml_reader *r, const struct yaml_node *node, const char *what,
                                        const char *const names[], size_t n, char out[MODEL_NAME])
{
    enum bf_status status = yaml_name(r, node, what, MODEL_NAME, out);
    for (size_t i = 0; status == BF_OK && i < n; i++)
        if (strcmp(out, names[i]) == 0)
            return BF_OK;
    if (status != BF_OK)
        return status;
    const char *closest = text_closest(out, names, n);
    return yaml_fail(r, node, "%s '%s' is no %s of the model; name one of its %ss%s%s%s", what, out, what, what,
                     closest ? "; did you mean '" : "", closest ? closest : "", closest ? "'?" : "");
}

struct wire {
    const char *section, *what; /* "sensor" names an "output", "drive" an "input" */
    char *name;
    double *per_code, *zero_code;
};

static enum bf_status read_wire(const struct yaml_reader *r, const struct yaml_node *board, const struct wire *wire,
                                const char *const names[], size_t n)
{
    const char *const known[] = {wire->what, "per_code", "zero_code"};
    const struct yaml_node *node = yaml_get(board, wire->section, NULL);
    if (!node)
        return BF_OK;
    enum bf_status status = yaml_expect(r, node, YAML_MAPPING, wire->section);
    if (status == BF_OK)
        status = yaml_known_keys(r, node, wire->section, known, 3);
    if (status != BF_OK)
        return status;
    const struct yaml_node *name = yaml_get(node, wire->what, NULL), *per_code = yaml_get(node, "per_code", NULL);
    const struct yaml_node *zero_code = yaml_get(node, "zero_code", NULL);
    if (name)
        status = read_channel_name(r, name, wire->what, names, n, wire->name);
    if (status == BF_OK && per_code)
        status = yaml_number(r, per_code, "per_code", wire->per_code);
    if (status == BF_OK && per_code && !(isfinite(*wire->per_code) && fabs(*wire->per_code) > 0.0))
        return yaml_fail(r, per_code, "per_code of %s is %g; write how much of the channel's unit one code is worth",
                         wire->section, *wire->per_code);
    if (status == BF_OK && zero_code)
        status = yaml_number(r, zero_code, "zero_code", wire->zero_code);
    if (status == BF_OK && zero_code && !(fabs(*wire->zero_code) <= code_most))
        return yaml_fail(r, zero_code, "zero_code of %s is %g; write the code that stands for 0, e.g. 2048",
                         wire->section, *wire->zero_code);
    return status;
}

static enum bf_status read_positive(const struct yaml_reader *r, const struct yaml_node *board, const char *key,
                                    double most, double *out)
{
    const struct yaml_node *node = yaml_get(board, key, NULL);
    if (!node)
        return BF_OK;
    const enum bf_status status = yaml_number(r, node, key, out);
    if (status == BF_OK && !(*out > 0.0 && *out <= most))
        return yaml_fail(r, node, "%s is %g; it must be above 0%s", key, *out, *out > most ? " and smaller" : "");
    return status;
}

static enum bf_status read_wires(const struct yaml_reader *r, const struct yaml_node *node)
{
    struct model *m = r->model;
    struct model_board *b = &m->board;
    const struct wire sensor = {"sensor", "output", b->sensor, &b->sensor_per_code, &b->sensor_zero_code};
    const struct wire drive = {"drive", "input", b->drive, &b->drive_per_code, &b->drive_zero_code};
    const char **names = bf_alloc(m->n_inputs + m->n_outputs, sizeof *names);
    for (size_t o = 0; o < m->n_outputs; o++)
        names[o] = m->outputs[o].name;
    enum bf_status status = read_wire(r, node, &sensor, names, m->n_outputs);
    for (size_t i = 0; i < m->n_inputs; i++)
        names[i] = m->inputs[i].name;
    if (status == BF_OK)
        status = read_wire(r, node, &drive, names, m->n_inputs);
    free(names);
    return status;
}

static bool says_something(const struct model_board *b)
{
    const double numbers[] = {b->sample_Hz,      b->core_MHz,        b->sensor_per_code, b->sensor_zero_code,
                              b->drive_per_code, b->drive_zero_code, b->noise_rms,       b->alarm_ratio,
                              b->clear_ratio,    b->averaging_s,     b->quiet_ratio,     b->offset_ratio};
    bool any = b->sensor[0] || b->drive[0];
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        any = any || numbers[i] < 0.0 || numbers[i] > 0.0;
    return any;
}

enum bf_status yaml_read_board(const struct yaml_reader *r, const struct yaml_node *node)
{
    static const char *const known[] = {"sample_Hz",   "core_MHz",    "sensor",      "drive",       "noise_rms",
                                        "alarm_ratio", "clear_ratio", "averaging_s", "quiet_ratio", "offset_ratio"};
    struct model_board *b = &r->model->board;
    if (!node || yaml_is_nothing(node))
        return BF_OK;
    enum bf_status status = yaml_expect(r, node, YAML_MAPPING, "board");
    if (status == BF_OK)
        status = yaml_known_keys(r, node, "board", known, sizeof known / sizeof *known);
    if (status == BF_OK)
        status = read_wires(r, node);
    if (status != BF_OK || (status = read_positive(r, node, "sample_Hz", rate_most_Hz, &b->sample_Hz)) != BF_OK ||
        (status = read_positive(r, node, "core_MHz", clock_most_MHz, &b->core_MHz)) != BF_OK ||
        (status = read_positive(r, node, "noise_rms", HUGE_VAL, &b->noise_rms)) != BF_OK ||
        (status = read_positive(r, node, "alarm_ratio", HUGE_VAL, &b->alarm_ratio)) != BF_OK ||
        (status = read_positive(r, node, "clear_ratio", HUGE_VAL, &b->clear_ratio)) != BF_OK ||
        (status = read_positive(r, node, "averaging_s", HUGE_VAL, &b->averaging_s)) != BF_OK ||
        (status = read_positive(r, node, "quiet_ratio", 1.0, &b->quiet_ratio)) != BF_OK ||
        (status = read_positive(r, node, "offset_ratio", HUGE_VAL, &b->offset_ratio)) != BF_OK)
        return status;
    b->present = says_something(b);
    return BF_OK;
}

/* ---- Writing ---- */

static void add_number(struct yaml_text *text, const char *before, const char *key, double x)
{
    if (!(x > 0.0) && !(x < 0.0))
        return;
    yaml_text_addf(text, "%s%s: ", before, key);
    yaml_text_number(text, x);
}

static void add_wire(struct yaml_text *text, const char *section, const char *what, const char *name, double per_code,
                     double zero_code)
{
    const bool scaled = per_code < 0.0 || per_code > 0.0 || zero_code < 0.0 || zero_code > 0.0;
    if (!name[0] && !scaled)
        return;
    yaml_text_addf(text, "\n  %s: {", section);
    if (name[0]) {
        yaml_text_addf(text, "%s: ", what);
        yaml_text_scalar(text, name);
    }
    add_number(text, name[0] ? ", " : "", "per_code", per_code);
    add_number(text, name[0] || per_code < 0.0 || per_code > 0.0 ? ", " : "", "zero_code", zero_code);
    yaml_text_add(text, "}");
}

void model_print_board(struct yaml_text *text, const struct model_board *b)
{
    if (!b->present)
        return;
    yaml_text_add(text, "board:");
    add_number(text, "\n  ", "sample_Hz", b->sample_Hz);
    add_number(text, "\n  ", "core_MHz", b->core_MHz);
    add_wire(text, "sensor", "output", b->sensor, b->sensor_per_code, b->sensor_zero_code);
    add_wire(text, "drive", "input", b->drive, b->drive_per_code, b->drive_zero_code);
    add_number(text, "\n  ", "noise_rms", b->noise_rms);
    add_number(text, "\n  ", "alarm_ratio", b->alarm_ratio);
    add_number(text, "\n  ", "clear_ratio", b->clear_ratio);
    add_number(text, "\n  ", "averaging_s", b->averaging_s);
    add_number(text, "\n  ", "quiet_ratio", b->quiet_ratio);
    add_number(text, "\n  ", "offset_ratio", b->offset_ratio);
    yaml_text_add(text, "\n");
}
