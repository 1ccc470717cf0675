/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * link.h — a beamfit board at the end of a port: who it is, its memory, its model, its drive, its samples.
 *
 * Blocks that may be written or read twice carry everything; their size halves when the line damages them and grows
 * again when it does not. What matters is compared by CRC-32 or byte by byte, since the line's sum lets errors through.
 * All failures are BF_DEVICE unless said otherwise.
 */
#ifndef BEAMFIT_LINK_H
#define BEAMFIT_LINK_H

#include "beam_image_file.h"
#include "ground/device_key.h"
#include "xcp_master.h"

struct link {
    struct port *port;
    struct xcp_master xcp;
    size_t largest, block; /* data bytes of a transfer: most, and now */
    unsigned easy;         /* transfers without loss since the block's size changed */
    struct beam_info info; /* as last read */
};

/* Opens, connects, reads who it is. On failure nothing is left open. */
enum bf_status link_open(const char *path, long baud, struct link *out, struct bf_error *err);
void link_close(struct link *link);

enum bf_status link_read_info(struct link *link, struct bf_error *err);
/* In words: "built in", "slot 0", "slot 1", "downloaded"; "?" for anything else. */
const char *link_running_name(uint32_t running);
const char *link_slot_name(uint32_t state);

/* what: for messages, "reading the model". */
enum bf_status link_read(struct link *link, const char *what, uint32_t address, size_t n, void *out,
                         struct bf_error *err);
enum bf_status link_write(struct link *link, const char *what, uint32_t address, size_t n, const void *bytes,
                          struct bf_error *err);
/* CRC-32 that the board takes of its memory. */
enum bf_status link_crc(struct link *link, uint32_t address, size_t n, uint32_t *crc, struct bf_error *err);
/* Which page BEAM_WIRE_IMAGE shows: BEAM_WIRE_PAGE_ACTIVE or _STAGING. */
enum bf_status link_show_page(struct link *link, int page, struct bf_error *err);

/* Seed and key. key_path: for messages. */
enum bf_status link_unlock(struct link *link, const struct device_key *key, const char *key_path, struct bf_error *err);

/* Scales, expected noise and alarm of the running model. */
enum bf_status link_read_setup(struct link *link, struct beam_image_setup *out, struct bf_error *err);
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

/* The drive; `generation` is chosen here. Compared before it takes effect. */
enum bf_status link_read_drive(struct link *link, struct beam_drive *out, struct bf_error *err);
enum bf_status link_start_drive(struct link *link, const struct beam_drive *drive, struct bf_error *err);

/* Samples as they come, every prescale-th. */
struct link_stream {
    void (*live)(void *context, const struct beam_live *live); /* of samples whose CRC-32 is right */
    void *context;
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

#endif
