/* SPDX-License-Identifier: GPL-3.0-or-later */
/* capture.h — a board that streams: what is known of it, and its samples up to some number. For record and monitor. */
#ifndef BEAMFIT_CAPTURE_H
#define BEAMFIT_CAPTURE_H

#include "board_options.h"
#include "model/model.h"
#include "ground/ground.h"
#include "record/record.h"

struct capture {
    struct link link;
    struct beam_info before; /* the link has what is known now */
    struct beam_image_setup setup;
    struct recording recording;
    struct link_stream stream;
    char device[DEVICE_ID_TEXT], sha256[65];    /* of the running model's file */
    char input[MODEL_NAME], output[MODEL_NAME]; /* names of the channels */
    int latency;                                /* samples by which the output is late */
    uint32_t origin; /* sequence − step of the newest sample: changes when the model is put to rest */
    bool any;        /* a sample has come */
    uint32_t newest; /* its sequence */
};

/* Names of the board's channels: from the model file, or "drive_V" and "piezo_V" when model is NULL. */
enum bf_status capture_name(struct capture *capture, const char *model, struct bf_error *err);
/* Opens the port and reads what is known. prescale: as in board_prescale(). On failure nothing is left open. */
enum bf_status capture_open(struct capture *capture, const struct board_options *options, long prescale,
                            struct bf_error *err);
void capture_close(struct capture *capture);

/* Seed and key of a key file, so that the board drives. */
enum bf_status capture_unlock(struct capture *capture, const char *key_path, struct bf_error *err);

enum bf_status capture_start(struct capture *capture, struct bf_error *err);

/*
 * Listens until the board's samples have reached `sequence` (before any has come: until the first), or until Ctrl-C. bar
 * may be NULL; it is full at `sequence` and empty at `from`.
 */
enum bf_status capture_until(struct capture *capture, uint32_t sequence, struct progress *bar, uint32_t from,
                             struct bf_error *err);

/* Drive off, settle_s of the board's time, then this drive and the model at rest; samples before that are forgotten. */
enum bf_status capture_from_rest(struct capture *capture, const struct beam_drive *drive, double settle_s,
                                 struct bf_error *err);

/* Ends the stream and reads the board's counts again. */
enum bf_status capture_stop(struct capture *capture, struct bf_error *err);

#endif
