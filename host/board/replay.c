/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "replay.h"

#include <stdlib.h>
#include <string.h>

#include "beam_wire.h"
#include "ground/ground.h"

enum column { INPUT, PREDICTED, SEQUENCE, STEP, CODES, STATUS, COLUMNS };
enum { MOST_CELLS = 64 };

struct table {
    struct lines *lines;
    int place[COLUMNS]; /* cell of each column; INPUT is the one after time_s */
    int n_cells;
};

struct row {
    float input, predicted;
    uint32_t sequence, step, codes, status;
};

struct player {
    const struct beam_image_file *image;
    struct beam_image_run *run;
    bool known; /* the state is the controller's */
    bool rested;
    uint32_t next_step, next_sequence;
    struct replay *out;
};

/* ---- Reading ---- */

/* Cells of a line, separated by commas; −1 when there are too many. */
static int split(const char *text, size_t n, const char *from[MOST_CELLS], const char *to[MOST_CELLS])
{
    const char *end = text + n;
    int count = 0;
    for (;;) {
        const char *comma = memchr(text, ',', (size_t)(end - text));
        if (count == MOST_CELLS)
            return -1;
        from[count] = text;
        to[count++] = comma ? comma : end;
        if (!comma)
            return count;
        text = comma + 1;
    }
}

static enum bf_status next_line(struct table *t, const char **text, size_t *n, struct bf_error *err)
{
    enum bf_status status;
    do
        status = lines_next(t->lines, text, n, err);
    while (status == BF_OK && *text != NULL && (*n == 0 || **text == '#'));
    return status;
}

static enum bf_status read_header(struct table *t, struct bf_error *err)
{
    static const char *const names[COLUMNS] = {
        [PREDICTED] = "predicted", [SEQUENCE] = "sequence", [STEP] = "step", [CODES] = "codes", [STATUS] = "status"};
    const char *text, *from[MOST_CELLS], *to[MOST_CELLS];
    size_t n;
    const enum bf_status status = next_line(t, &text, &n, err);
    if (status != BF_OK)
        return status;
    t->n_cells = text != NULL ? split(text, n, from, to) : 0;
    t->place[INPUT] = 1;
    for (int c = PREDICTED; c < COLUMNS; c++) {
        t->place[c] = -1;
        for (int i = 0; i < t->n_cells; i++)
            if ((size_t)(to[i] - from[i]) == strlen(names[c]) && memcmp(from[i], names[c], strlen(names[c])) == 0)
                t->place[c] = i;
        if (t->place[c] < 2)
            return bf_fail_at(err, t->lines->path, t->lines->number,
                              "has no column '%s'; replay needs a recording that beamfit record wrote", names[c]);
    }
    return BF_OK;
}

static bool whole_number(double x, uint32_t *out)
{
    if (!(x >= 0.0 && x <= 4294967295.0))
        return false;
    *out = (uint32_t)x;
    return !((double)*out < x);
}

/* *found is false after the last row. */
static enum bf_status read_row(struct table *t, struct row *row, bool *found, struct bf_error *err)
{
    const char *text, *from[MOST_CELLS], *to[MOST_CELLS];
    double x[COLUMNS];
    size_t n;
    const enum bf_status status = next_line(t, &text, &n, err);
    *found = status == BF_OK && text != NULL;
    if (!*found)
        return status;
    if (split(text, n, from, to) != t->n_cells)
        return bf_fail_at(err, t->lines->path, t->lines->number, "has another number of cells than the header; %s",
                          "the recording was cut or edited");
    for (int c = 0; c < COLUMNS; c++)
        if (!number_parse(from[t->place[c]], to[t->place[c]], '.', &x[c]))
            return bf_fail_at(
                err, t->lines->path, t->lines->number, "'%.*s' is not a number",
                (int)(to[t->place[c]] - from[t->place[c]] < 40 ? to[t->place[c]] - from[t->place[c]] : 40),
                from[t->place[c]]);
    row->input = (float)x[INPUT];
    row->predicted = (float)x[PREDICTED];
    if (!whole_number(x[SEQUENCE], &row->sequence) || !whole_number(x[STEP], &row->step) ||
        !whole_number(x[CODES], &row->codes) || !whole_number(x[STATUS], &row->status))
        return bf_fail_at(err, t->lines->path, t->lines->number,
                          "sequence, step, codes and status are whole numbers below 2^32; the recording was edited");
    return BF_OK;
}

/* ---- Playing ---- */

/* Is the state after this row's step the controller's too? Counts why not. */
static bool follow(struct player *p, const struct row *row)
{
    struct replay *out = p->out;
    const bool lost = out->rows > 0 && row->sequence != p->next_sequence;
    out->gaps += lost;
    out->rows++;
    p->next_sequence = row->sequence + 1;
    if (row->status >> BEAM_LIVE_COUNTER != (p->image->front.header.counter & 0xFFu)) {
        out->other_image++;
        out->other_counter = row->status >> BEAM_LIVE_COUNTER;
        p->known = false;
        return false;
    }
    if (row->step == 0) {
        beam_image_run_rest(p->run);
        p->known = p->rested = true;
        out->rests++;
    } else if (lost || row->step != p->next_step) {
        p->known = false;
    }
    p->next_step = row->step + 1;
    if (p->known)
        return true;
    *(p->rested ? &out->after_gap : &out->before_rest) += 1;
    return false;
}

static bool same_bits(float a, float b)
{
    uint32_t word[2];
    memcpy(&word[0], &a, sizeof a);
    memcpy(&word[1], &b, sizeof b);
    return word[0] == word[1];
}

static void compare(struct player *p, const struct row *row, long line)
{
    struct replay *out = p->out;
    const float input = beam_image_drive_value(&p->image->front.setup, row->codes >> 16);
    float y;
    const enum beam_status status = beam_image_run_step(p->run, input, &y);
    if (row->status & BEAM_LIVE_RESET) {
        out->resets++;
        p->known = false; /* the next row is step 0 */
        return;
    }
    out->compared++;
    const bool solve = status == BEAM_ERROR_SOLVE || status == BEAM_ERROR_EFFECT_RANGE;
    const bool said = (row->status & BEAM_LIVE_SOLVE) != 0;
    if (out->difference != REPLAY_EQUAL)
        return;
    if (!same_bits(input, row->input)) {
        out->difference = REPLAY_INPUT;
        out->recorded = row->input;
        out->computed = input;
    } else if (!same_bits(y, row->predicted)) {
        out->difference = REPLAY_PREDICTED;
        out->recorded = row->predicted;
        out->computed = y;
    } else if (solve != said) {
        out->difference = REPLAY_STATUS;
        out->recorded = said ? 1.0F : 0.0F;
        out->computed = solve ? 1.0F : 0.0F;
    }
    out->line = line;
    out->sequence = row->sequence;
    out->step = row->step;
}

static enum bf_status nothing_compared(const char *path, const struct player *p, struct bf_error *err)
{
    const struct replay *out = p->out;
    if (out->rows == 0)
        return bf_fail_at(err, path, 0, "has no samples; record some");
    if (out->other_image > 0)
        return bf_fail_at(err, path, 0,
                          "was recorded on an image whose counter ends in %u, this one's ends in %u; give the signed "
                          "image that ran (beamfit upload reads it back)",
                          out->other_counter, (unsigned)(p->image->front.header.counter & 0xFFu));
    if (!p->rested)
        return bf_fail_at(
            err, path, 0,
            "has no sample with step 0: the model's state at its beginning is not known; record again with "
            "the drive started anew, which puts the model to rest");
    return bf_fail_at(err, path, 0, "has nothing to compare: in every sample the state was reset");
}

enum bf_status replay_lines(struct lines *lines, const struct beam_image_file *image, struct replay *out,
                            struct bf_error *err)
{
    struct table table = {.lines = lines};
    struct row row = {.sequence = 0};
    struct player player = {.image = image, .run = bf_alloc(1, beam_image_run_bytes()), .out = out};
    bool found = true;
    *out = (struct replay){.rows = 0};
    beam_image_run_load(player.run, image);
    enum bf_status status = BF_OK;
    if (beam_image_run_check(player.run, NULL, 0.0F) != BEAM_IMAGE_FINE)
        status = bf_fail(err, BF_BAD_FILE, "the image is damaged; beamfit verify says how");
    if (status == BF_OK)
        status = read_header(&table, err);
    while (status == BF_OK && (status = read_row(&table, &row, &found, err)) == BF_OK && found)
        if (follow(&player, &row))
            compare(&player, &row, lines->number);
    free(player.run);
    return status == BF_OK && out->compared == 0 ? nothing_compared(lines->path, &player, err) : status;
}

enum bf_status replay_run(const char *recording, const struct beam_image_file *image, struct replay *out,
                          struct bf_error *err)
{
    struct lines lines;
    enum bf_status status = lines_open(recording, &lines, err);
    if (status != BF_OK)
        return status;
    status = replay_lines(&lines, image, out, err);
    lines_close(&lines);
    return status;
}
