/* SPDX-License-Identifier: GPL-3.0-or-later */
/* target_image_board.c — what the controller is wired to: options over the model's block over what the model implies. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "deployment.h"

static const double default_alarm = 3.0, default_clear = 2.0, default_averaging_s = 1.0, default_quiet = 0.2,
                    default_offset = 1.0, default_core_MHz = 168.0; /* the product's STM32F405 */

static void override(double over, double *value)
{
    if (over < 0.0 || over > 0.0)
        *value = over;
}

static void merge(const struct target_options *options, struct model_board *b)
{
    const struct model_board *o = &options->board;
    override(o->sample_Hz, &b->sample_Hz);
    override(o->core_MHz, &b->core_MHz);
    override(o->sensor_per_code, &b->sensor_per_code);
    override(o->drive_per_code, &b->drive_per_code);
    override(o->noise_rms, &b->noise_rms);
    override(o->alarm_ratio, &b->alarm_ratio);
    override(o->clear_ratio, &b->clear_ratio);
    override(o->averaging_s, &b->averaging_s);
    override(o->quiet_ratio, &b->quiet_ratio);
    override(o->offset_ratio, &b->offset_ratio);
    if (options->sensor_zero)
        b->sensor_zero_code = o->sensor_zero_code;
    if (options->drive_zero)
        b->drive_zero_code = o->drive_zero_code;
    if (o->sensor[0])
        memcpy(b->sensor, o->sensor, sizeof b->sensor);
    if (o->drive[0])
        memcpy(b->drive, o->drive, sizeof b->drive);
}

static enum bf_status missing(const struct model *model, const char *what, const char *remedy, struct bf_error *err)
{
    return bf_fail_at(err, model->path ? model->path : "model", 0,
                      "does not say %s; add it to the file's board block or give %s (beamfit export --help)", what,
                      remedy);
}

/* The only output; the only patch_moment input, else the only input. */
static void imply_channels(const struct model *model, struct model_board *b)
{
    size_t moments = 0, moment = 0;
    for (size_t i = 0; i < model->n_inputs; i++)
        if (model->inputs[i].kind == INPUT_PATCH_MOMENT) {
            moment = i;
            moments++;
        }
    if (!b->sensor[0] && model->n_outputs == 1)
        memcpy(b->sensor, model->outputs[0].name, sizeof b->sensor);
    if (!b->drive[0] && (moments == 1 || model->n_inputs == 1))
        memcpy(b->drive, model->inputs[moments == 1 ? moment : 0].name, sizeof b->drive);
}

/* Root mean square over the fitted records of the sensor's noise; 0 when the fit block does not know it. */
static double fitted_noise(const struct model *model, const char *sensor)
{
    double square = 0.0, n = 0.0;
    for (size_t r = 0; r < model->fit.n_records; r++) {
        const struct fit_record *record = &model->fit.records[r];
        for (size_t c = 0; c < record->n_channels && !record->held_out; c++) {
            if (strcmp(record->channels[c].name, sensor) != 0 || !(record->channels[c].noise_rms > 0.0))
                continue;
            square += record->channels[c].noise_rms * record->channels[c].noise_rms;
            n += 1.0;
        }
    }
    return n > 0.0 ? sqrt(square / n) : 0.0;
}

static bool has_name(const struct model *model, const char *name, bool output)
{
    for (size_t i = 0; i < (output ? model->n_outputs : model->n_inputs); i++)
        if (strcmp(output ? model->outputs[i].name : model->inputs[i].name, name) == 0)
            return true;
    return false;
}

enum bf_status target_board(const struct model *model, const struct target_options *options, struct target_image *image,
                            struct bf_error *err)
{
    struct model_board *b = &image->board;
    *b = model->board;
    merge(options, b);
    imply_channels(model, b);
    if (!b->sensor[0])
        return missing(model, "which output is at the A/D converter", "--sensor NAME", err);
    if (!has_name(model, b->sensor, true))
        return bf_fail(err, BF_USAGE, "--sensor %s: the model has no such output", b->sensor);
    if (!b->drive[0])
        return missing(model, "which input is at the D/A converter", "--drive NAME", err);
    if (!has_name(model, b->drive, false))
        return bf_fail(err, BF_USAGE, "--drive %s: the model has no such input", b->drive);
    if (!(b->sample_Hz > 0.0))
        return missing(model, "the controller's sample rate (sample_Hz)", "--sample-Hz HZ", err);
    if (!(fabs(b->sensor_per_code) > 0.0))
        return missing(model, "what one code of the A/D is worth (sensor: per_code)", "--sensor-per-code X", err);
    if (!(fabs(b->drive_per_code) > 0.0))
        return missing(model, "what one code of the D/A is worth (drive: per_code)", "--drive-per-code X", err);
    const char *from = options->board.noise_rms > 0.0 ? "the command line" : "the board block";
    if (!(b->noise_rms > 0.0)) {
        b->noise_rms = fitted_noise(model, b->sensor);
        from = "the fit";
    }
    if (!(b->noise_rms > 0.0))
        return missing(model, "how large the sensor's noise is (noise_rms), and no fit has told", "--noise-rms X", err);
    (void)snprintf(image->noise_from, sizeof image->noise_from, "%s", from);
    b->alarm_ratio = b->alarm_ratio > 0.0 ? b->alarm_ratio : default_alarm;
    b->clear_ratio = b->clear_ratio > 0.0 ? b->clear_ratio : fmin(default_clear, 0.7 * b->alarm_ratio);
    b->averaging_s = b->averaging_s > 0.0 ? b->averaging_s : default_averaging_s;
    b->quiet_ratio = b->quiet_ratio > 0.0 ? b->quiet_ratio : default_quiet;
    b->offset_ratio = b->offset_ratio > 0.0 ? b->offset_ratio : default_offset;
    b->core_MHz = b->core_MHz > 0.0 ? b->core_MHz : default_core_MHz;
    if (!(b->clear_ratio < b->alarm_ratio))
        return bf_fail(err, BF_BAD_FILE, "clear_ratio %g is not below alarm_ratio %g; the alarm would never go off",
                       b->clear_ratio, b->alarm_ratio);
    b->present = true;
    return BF_OK;
}
