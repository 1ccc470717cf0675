/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * target_image.h — from a model to the image a controller runs: the model in a space of ten dimensions with one input (the
 * drive at the D/A) and one output (the sensor at the A/D), its exact step in 24-bit numbers, the board's scales, and the
 * proof run computed by the controller's own library. docs/target_image.md has the bytes.
 */
#ifndef BEAMFIT_TARGET_IMAGE_H
#define BEAMFIT_TARGET_IMAGE_H

#include "beam_image_file.h"
#include "ground/device_key.h"
#include "ground/json.h"
#include "model/model.h"

enum { TARGET_PROOF_STEPS = 256 };

struct target_options {
    struct model_board board;     /* what the command line says; it overrides the model's block, member by member */
    bool sensor_zero, drive_zero; /* board.sensor_zero_code, board.drive_zero_code are said */
    enum beam_hold hold;          /* of the drive: zero order (after a D/A) or first order */
    bool plain;                   /* the ten-dimensional model alone, without the two blocks beside it */
    size_t n_without;
    const char *const *without; /* ids of effects to leave out */
};

/* What became of one effect of the model. */
struct target_effect {
    const char *id;
    char fate[160]; /* "in the matrices", "a law at 1 point", "on the sensor", "left out: …" */
    bool runs;      /* the step calls it */
};

struct target_image {
    struct beam_image_file file; /* unsigned: device, counter and code are 0 */
    struct model_board board;    /* as it is in the image, complete */
    const char *sensor_unit, *drive_unit;
    char noise_from[80]; /* where noise_rms comes from: "the board block", … */
    double dt_s;         /* true interval: (1 + clock_relative)/sample_Hz */
    double clock_relative;
    size_t n_modes, n_statics;                           /* what spans the space */
    size_t in_band;                                      /* modes below half the sample rate, ten at most */
    bool band_is_wider;                                  /* there are more of them than the space has modes */
    double frequency_Hz[BEAM_N], relative_error[BEAM_N]; /* undamped, deployed; against a converged space */
    double held_error; /* of the sampled pulse response of a held drive, rms ÷ rms, against many modes; NAN: unknown */
    int n_beside;      /* blocks beside the space, target_image_judge.c */
    double float_error; /* rms of float − double ÷ rms of double over a random run, by the controller's own code */
    size_t n_effects;
    struct target_effect *effects;
    size_t n_notes;
    char **notes;          /* sentences for a person: what the image does not carry */
    struct beam_plan plan; /* in double, narrowed: what the bytes were made from */
};

/*
 * BF_BAD_FILE: something about the board is not said, or an effect cannot be deployed (err says why and what to do);
 * BF_NUMERIC: the model cannot be stepped. Free with target_image_free() also after a failure.
 */
enum bf_status target_image_make(const struct model *model, const struct target_options *options,
                                 struct target_image *out, struct bf_error *err);
void target_image_free(struct target_image *image);

/* Sets device and counter and computes the code: HMAC-SHA256 of every byte before it. */
void target_image_sign(struct beam_image_file *file, const struct device_key *key,
                       const uint8_t device[BEAM_IMAGE_DEVICE_BYTES], uint32_t counter);
bool target_image_is_signed(const struct beam_image_file *file);

/* As far as there are bytes, at most sizeof *out and one, into *n. BF_BAD_FILE when the file cannot be read. */
enum bf_status target_image_load(const char *path, struct beam_image_file *out, size_t *n, struct bf_error *err);
/* BF_BAD_FILE also when it has another size. Nothing else is checked. */
enum bf_status target_image_read(const char *path, struct beam_image_file *out, struct bf_error *err);
enum bf_status target_image_write(const char *path, const struct beam_image_file *file, struct bf_error *err);

/*
 * Everything a controller checks, by the controller's own code, in its order. key NULL: the code is not checked;
 * device NULL: any; stored: greatest counter in its store, −1: any; sample_Hz 0: any.
 */
struct target_controller {
    const struct device_key *key;
    const uint8_t *device;
    int64_t stored;
    double sample_Hz;
};
enum beam_image_fault target_image_check(const struct beam_image_file *file, const struct target_controller *against);

/* What a step of this image costs, in one clause: "linear", "laws at 8 points" … with the instructions measured. */
void target_image_cost(const struct beam_image_file *file, char text[160]);

/* The answers of export and verify, for a person and for programs. */
void target_image_print(FILE *out, const struct target_image *image);
void target_image_print_file(FILE *out, const struct beam_image_file *file);
struct json *target_image_json(const struct target_image *image);
struct json *target_image_file_json(const struct beam_image_file *file);

#endif
