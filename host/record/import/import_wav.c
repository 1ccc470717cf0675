/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sound files by libsndfile (WAV, AIFF, FLAC). Only this file sees it. Integer samples become fractions of full scale. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sndfile.h>
#include "import_channel.h"
#include "import_format.h"

/* The file in memory, as libsndfile reads it. */
struct memory {
    const char *data;
    sf_count_t n, at;
};

static sf_count_t memory_length(void *user)
{
    return ((struct memory *)user)->n;
}

static sf_count_t memory_seek(sf_count_t offset, int whence, void *user)
{
    struct memory *m = user;
    sf_count_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? m->at : m->n;
    if (offset < -base || offset > m->n - base)
        return -1;
    m->at = base + offset;
    return m->at;
}

static sf_count_t memory_read(void *to, sf_count_t count, void *user)
{
    struct memory *m = user;
    sf_count_t n = count < m->n - m->at ? count : m->n - m->at;
    if (n <= 0)
        return 0;
    memcpy(to, m->data + m->at, (size_t)n);
    m->at += n;
    return n;
}

static sf_count_t memory_tell(void *user)
{
    return ((struct memory *)user)->at;
}

/* All samples of all channels; frames grow as they come, since a header may claim any number. */
static size_t read_frames(SNDFILE *sound, size_t channels, double *x[])
{
    enum { BLOCK_VALUES = 16384 };
    const size_t block_frames = 1 + BLOCK_VALUES / channels;
    size_t n = 0, capacity = 0;
    sf_count_t got;
    double *block = bf_alloc(block_frames * channels, sizeof *block);
    while ((got = sf_readf_double(sound, block, (sf_count_t)block_frames)) > 0) {
        if (n + (size_t)got > capacity) {
            capacity = 2 * capacity + (size_t)got;
            for (size_t i = 0; i < channels; i++)
                x[i] = bf_grow(x[i], capacity, sizeof **x);
        }
        for (size_t k = 0; k < (size_t)got; k++)
            for (size_t i = 0; i < channels; i++)
                x[i][n + k] = block[k * channels + i];
        n += (size_t)got;
    }
    free(block);
    return n;
}

static enum bf_status read_wav(struct import_file *file, const char *data, size_t n, const struct import_reading *how,
                               struct bf_error *err)
{
    (void)how;
    SF_VIRTUAL_IO io = {memory_length, memory_seek, memory_read, NULL, memory_tell};
    struct memory memory = {data, (sf_count_t)n, 0};
    SF_INFO info = {0};
    SNDFILE *sound = sf_open_virtual(&io, SFM_READ, &info, &memory);
    if (sound == NULL)
        return bf_fail_at(err, file->path, 0, "is no sound file that can be read: %s; export it as WAV",
                          sf_strerror(NULL));
    if (info.channels < 1 || info.channels > 1024 || info.samplerate < 1) {
        sf_close(sound);
        return bf_fail_at(err, file->path, 0, "has %d channels at %d Hz; export it again", info.channels,
                          info.samplerate);
    }
    size_t channels = (size_t)info.channels;
    double **x = bf_alloc(channels, sizeof *x);
    size_t frames = read_frames(sound, channels, x);
    bool is_float =
        (info.format & SF_FORMAT_SUBMASK) == SF_FORMAT_FLOAT || (info.format & SF_FORMAT_SUBMASK) == SF_FORMAT_DOUBLE;
    const char *title = sf_get_string(sound, SF_STR_TITLE);
    if (title != NULL)
        import_add_meta(file, "source_title", title, strlen(title));
    sf_close(sound);
    for (size_t i = 0; i < channels; i++) {
        static const char note[] = "fraction of full scale: --scale gives volts";
        struct import_channel *c = import_add(file, "", 0, x[i], frames);
        if (!is_float)
            import_set_text(&c->about, note, sizeof note - 1);
        c->dt_s = 1 / (double)info.samplerate;
    }
    free(x);
    return frames > 0 ? BF_OK
                      : bf_fail_at(err, file->path, 0, "has no samples; it is cut off, or nothing was recorded");
}

static enum import_match recognise(const char *path, const char *data, size_t n)
{
    (void)path;
    if (n > 12 && (memcmp(data + 8, "WAVE", 4) == 0 || memcmp(data + 8, "AIFF", 4) == 0))
        return IMPORT_MATCH_CONTENT;
    return import_starts_with(data, n, "fLaC", 4) || import_starts_with(data, n, "riff", 4) ? IMPORT_MATCH_CONTENT
                                                                                            : IMPORT_NO_MATCH;
}

const struct import_format import_format_wav = {.name = "wav",
                                                .title = "WAV, AIFF or FLAC sound",
                                                .recognise = recognise,
                                                .read = read_wav,
                                                .by_outside_library = true};
