/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * board.h — a model on a controller: the image, the line to the controller, and whether both compute the same.
 *
 *     target_image_make(), target_image_sign(), target_image_write()   model → image file
 *     a2l_write()                                                      its description for measurement tools
 *     link_open(), link_unlock(), link_download()                      image → running model
 *     link_start_drive(), link_start_stream(), link_run_stream()       samples; record.h keeps them
 *     link_close()
 *     replay_run()                                                     did the controller compute what this machine computes?
 */
#ifndef BEAMFIT_BOARD_H
#define BEAMFIT_BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "beam_image_file.h"
#include "beam_wire.h"
#include "ground/ground.h"
#include "model/model.h"

/*
 * PORT — a serial port below a link: 8 data bits, no parity, 1 stop bit, no flow control.
 *
 * Two back ends: libserialport for real ports (port_serial.c), termios for the pseudo terminals of emulated boards
 * (port_pty.c), which libserialport cannot open. A path that leads to /dev/pts is a pseudo terminal. One program at a
 * time: the port is locked. Every failure is BF_DEVICE with a text that says what to do.
 */

enum { PORT_BAUD = 115200 };

struct port;

const char *port_path(const struct port *port);
long port_baud(const struct port *port);
bool port_is_pty(const struct port *port);

/* "; ports here: /dev/ttyUSB0 (FT232R), …" or that none was found, cut to size: the end of a message. */
void port_list(size_t size, char text[]);

/* Milliseconds of a clock that never jumps. */
int64_t port_clock_ms(void);

/*
 * XCP FRAME — packets in frames of XCP on SxI (beam_wire.h), found again in a stream of any bytes. The functions are in
 * xcp_frame.h; a link holds the state.
 *
 * A frame whose length is impossible or whose sum is wrong is dropped one byte at a time, so that a good frame behind a
 * damaged one is found. The sum is weak (two flips in one bit column pass): what matters is checked again by CRC-32.
 */

enum { XCP_RECEIVER_BYTES = 4096 };
struct xcp_receiver {
    size_t start, end;
    bool lost;           /* the last byte was dropped: a run of dropped bytes counts once */
    uint64_t frames;     /* good ones */
    uint64_t resyncs;    /* runs of bytes that were no frame */
    uint64_t junk_bytes; /* in those runs */
    uint8_t buffer[XCP_RECEIVER_BYTES];
};

/*
 * XCP MASTER — one XCP session over a port: commands with deadlines and retries, samples and events sorted out. The
 * functions are in xcp_master.h; a link holds the state.
 *
 * A lost answer is followed by SYNCH, whose own answer cannot be mistaken for another; what comes before it is stale.
 * Only then, and only a command that may be executed twice, is the command repeated. Samples that stream in meanwhile do
 * not extend a deadline. An error answer is believed when it comes twice, because the line's sum is weak.
 * Failures are BF_DEVICE: nobody answers, or the port is gone.
 */

struct xcp_counts {
    uint64_t commands, repeats, synchs, stale; /* stale: answers that nobody waited for any more */
    uint64_t stored, overloads, terminated;    /* events */
};

struct xcp_master {
    struct port *port; /* the caller's */
    int timeout_ms;    /* for an answer, beside the time on the wire, until answers have shown how long they take */
    int patience_ms;   /* for an answer at least: for a command that takes the board long */
    int tries;         /* of a command, and of SYNCH; the second waits twice, others four times as long */
    int busy_ms;       /* how long "busy" is borne */
    void (*sample)(void *context, size_t n, const uint8_t packet[]); /* NULL: dropped. packet[0]: number of the ODT */
    void *context;
    struct xcp_receiver receiver;
    struct xcp_counts counts;
    int64_t heard_ms; /* when the last good frame came */
    unsigned timed;   /* answers that were timed */
    double usual_ms;  /* their running mean */
    uint16_t counter;
    bool answered, pending;
    size_t n_answer;
    uint8_t answer[BEAM_WIRE_MAX_PACKET];
};

/*
 * LINK — a beamfit board at the end of a port: who it is, its memory, its model, its drive, its samples.
 *
 * Blocks that may be written or read twice carry everything; their size halves when the line damages them and grows
 * again when it does not. What matters is compared by CRC-32 or byte by byte, since the line's sum lets errors through.
 * All failures are BF_DEVICE unless said otherwise.
 */

struct link {
    struct port *port;
    struct xcp_master xcp;
    size_t largest, block; /* data bytes of a transfer: most, and now */
    unsigned easy;         /* transfers without loss since the block's size changed */
    struct beam_info info; /* as last read */
    bool driving;          /* started here: the board wants to hear of us, or it stops the drive */
    int64_t told_ms;       /* when it last did, */
    uint64_t told_samples; /* and the stream's samples then */
};

/* Opens, connects, reads who it is. On failure nothing is left open. */
enum bf_status link_open(const char *path, long baud, struct link *out, struct bf_error *err);
void link_close(struct link *link);

enum bf_status link_read_info(struct link *link, struct bf_error *err);

/* In words: "built in", "slot 0", "slot 1", "downloaded"; "?" for anything else. */
const char *link_running_name(uint32_t running);
const char *link_slot_name(uint32_t state);

/* What a sample's status says of the sensor: "stuck", "at its end", "too quiet", "offset"; "" when it is in order. */
const char *link_sensor_fault(uint32_t status);

/* what: for messages, "reading the model". */
enum bf_status link_read(struct link *link, const char *what, uint32_t address, size_t n, void *out,
                         struct bf_error *err);

/* Seed and key. key_path: for messages. */
enum bf_status link_unlock(struct link *link, const struct device_key *key, const char *key_path, struct bf_error *err);

/* Scales, expected noise and alarm of the running model. */
enum bf_status link_read_setup(struct link *link, struct beam_image_setup *out, struct bf_error *err);

/* The modes that the board follows; out->modes 0 when its image asks for none. */
enum bf_status link_read_tracking(struct link *link, struct beam_tracking *out, struct bf_error *err);

/* A whole page, compared by CRC-32. */
enum bf_status link_upload(struct link *link, int page, struct beam_image_file *out, struct bf_error *err);

/*
 * Makes the image the running model: staged in blocks, CRC-32 compared, checked and switched by the board, read back and
 * compared, and stored unless no_store. The link must be unlocked. Until the board has accepted the whole image nothing
 * changes; Ctrl-C is heeded until then. Repeating it after any interruption is safe: an image that already runs is only
 * stored. When the board says no, the text says why.
 */
struct link_download {
    bool no_store;
    bool was_running, was_stored; /* out: nothing had to be written, nothing had to be stored */
    double seconds;               /* out: from the first block to the last word */
};
enum bf_status link_download(struct link *link, const struct beam_image_file *image, struct link_download *download,
                             struct bf_error *err);

/*
 * The drive; `generation` is chosen here. Compared before it takes effect. Starting one needs link_unlock(); it goes on while
 * link_run_stream() is called, and ends with the link.
 */
enum bf_status link_read_drive(struct link *link, struct beam_drive *out, struct bf_error *err);
enum bf_status link_start_drive(struct link *link, const struct beam_drive *drive, struct bf_error *err);

/* Lets the board forget its latch of alarms and faults, and reads its information after that. Needs link_unlock(). */
enum bf_status link_acknowledge(struct link *link, struct bf_error *err);

/* Samples as they come, every prescale-th. */
struct link_stream {
    void (*live)(void *context, const struct beam_live *live); /* of samples whose CRC-32 is right */
    void *context;
    unsigned prescale;              /* as it was started */
    uint64_t samples, crc_failures; /* since the start that succeeded; live() may have seen some before it */
};

/* Samples a second that a line of this rate carries, one byte in ten kept for commands. */
double link_rate_Hz(long baud);

/* stream and its context must outlive the stream. prescale: 1..255. */
enum bf_status link_start_stream(struct link *link, unsigned prescale, struct link_stream *stream,
                                 struct bf_error *err);

/* Handles what comes within timeout_ms; BF_DEVICE when the board has fallen silent. */
enum bf_status link_run_stream(struct link *link, int timeout_ms, struct bf_error *err);
void link_stop_stream(struct link *link);

/*
 * TARGET IMAGE — from a model to the image a controller runs: the model in a space of ten dimensions with one input (the
 * drive at the D/A) and one output (the sensor at the A/D), its exact step in 24-bit numbers, the board's scales, and the
 * proof run computed by the controller's own library. docs/target_image.md has the bytes.
 */

struct target_options {
    struct model_board board;     /* what the command line says; it overrides the model's block, member by member */
    bool sensor_zero, drive_zero; /* board.sensor_zero_code, board.drive_zero_code are said */
    enum beam_hold hold;          /* of the drive: zero order (after a D/A) or first order */
    bool tracks;                  /* the board follows the lowest modes beside the model */
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
    uint32_t step_bound,
        step_budget;     /* instructions: of a step at most, and that a board of this rate and clock leaves */
    int law_evaluations; /* in one step at most: 16, fewer when the bound would not fit; 0: no law */
    double unsolved;     /* share of steps under half the full drive in which the laws wanted more of them */
    size_t n_observed;   /* blocks that the observer follows, BEAM_OBSERVED at most */
    size_t n_tracked;    /* modes that the board follows, BEAM_TRACKED at most */
    double observer_s;   /* time constant with which it takes up a push */
    double float_error;  /* rms of float − double ÷ rms of double over a random run, by the controller's own code */
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
 * device NULL: any; stored: greatest counter in its store, −1: any; sample_Hz 0: any; core_Hz 0: any (wants sample_Hz).
 */
struct target_controller {
    const struct device_key *key;
    const uint8_t *device;
    int64_t stored;
    double sample_Hz, core_Hz;
};
enum beam_image_fault target_image_check(const struct beam_image_file *file, const struct target_controller *against);

/* The answers of export and verify, for a person and for programs. */
/* beam_image_bound() of a file; 0 when a controller would not take the plan. */
uint32_t target_image_bound(const struct beam_image_file *file);

struct json *target_image_json(const struct target_image *image);
struct json *target_image_file_json(const struct beam_image_file *file);

/*
 * A2L — the controller's description for measurement and calibration tools (ASAM MCD-2 MC 1.7.1): live sample, facts,
 * drive, the image's segment with its two pages, and how to reach them (XCP on SxI).
 */

/* BF_BAD_FILE when the file cannot be written. */
enum bf_status a2l_write(const char *path, const struct target_image *image, struct bf_error *err);

/*
 * REPLAY — did the controller compute what this machine computes? A recording of `record` carries the drive's codes and
 * what the controller predicted; the same image, stepped here by the same library from the sample where the model was at
 * rest, must give the same bits. docs/target_image.md has the columns.
 */

enum replay_difference { REPLAY_EQUAL, REPLAY_INPUT, REPLAY_PREDICTED, REPLAY_STATUS };

struct replay {
    size_t rows;
    size_t compared;
    size_t before_rest; /* rows before the first step 0 */
    size_t after_gap;   /* rows between a lost sample and the next step 0 */
    size_t gaps, rests; /* lost stretches; times the model was at rest */
    size_t resets;      /* samples in which the controller's state was not finite: not compared */
    size_t other_image; /* rows of an image with another counter */
    unsigned other_counter;
    enum replay_difference difference; /* first of them, then: */
    long line;                         /* of the recording */
    uint32_t sequence, step;
    float recorded, computed; /* of input, predicted; the SOLVE bit of the status */
};

/*
 * The image must be fine (target_image_check()). BF_BAD_FILE: no recording, or nothing in it can be compared, and why.
 * BF_OK also when something differs. Cost: a step a row.
 */
enum bf_status replay_run(const char *recording, const struct beam_image_file *image, struct replay *out,
                          struct bf_error *err);

#endif
