/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_records.c — what is fitted: inputs and channels of the records, and the pieces of long ones. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A longer record is taken in pieces of about PIECE samples, and what a fit needs does not grow with it. */
enum { LONG = 131072, PIECE = 65536 };
/* Samples over which the edges of an input that was cut ring, to 1e-8: a floor is known to three digits. */
enum { GUARD = 1024 };

/* Residues of this record alone: its level is unknown, or a channel was elsewhere than in the others. */
static bool own_residues(const struct model *model, const struct record *record, const struct model_input *input)
{
    const char *excitation = record_meta(record, "excitation");
    return input->level_per_record || record_has_places(model, record) ||
           (excitation != NULL && strcmp(excitation, "unknown_level") == 0);
}

/* Its first samples are louder than noise (times `clearly`), and no trifle (a share of the rms): the noise may be underrated. */
static bool in_motion(const struct attainable_data *data, size_t n)
{
    static const double clearly = 5.0; /* times the noise: not one of 10,000 samples of noise */
    static const double trifle = 0.01; /* of the channel's rms: what it may cost to take a slight motion for rest */
    for (size_t k = 0; k < 3 && k < n; k++)
        if (fabs(data->z[k]) > fmax(clearly * data->noise, trifle * data->rms))
            return true;
    return false;
}

/* ---- One record ---- */

static void add_input(struct attainable_problem *p, const struct model *model, const struct record *record, size_t i,
                      struct attainable_record *r)
{
    const double *u = record_column(record, model->inputs[i].name);
    if (u == NULL || !(root_mean_square(u, r->n) > 0.0))
        return;
    const size_t slot = own_residues(model, record, &model->inputs[i]) ? p->n_slots++ : i;
    r->sources[r->n_sources++] = (struct attainable_source){.slot = slot, .u = u};
}

static void add_channels(struct attainable_problem *p, const struct model *model, const struct record *record,
                         size_t index, const double noise_rms[], struct attainable_record *r)
{
    const size_t from = record->n - r->n, outputs = model->n_outputs;
    for (size_t o = 0; o < outputs; o++) {
        const double *z = record_column(record, model->outputs[o].name);
        if (z == NULL)
            continue;
        const double rms = root_mean_square(z + from, r->n);
        if (!(rms > 0.0))
            continue;
        struct attainable_data *data = &r->data[r->n_data++];
        *data = (struct attainable_data){
            .record = index, .output = o, .channel = p->n_channels++, .z = z + from, .rms = rms};
        data->noise = noise_rms[index * outputs + o];
        r->moving = r->moving || in_motion(data, r->n);
    }
}

/* ---- Pieces ---- */

/* Samples from … to − 1 of a whole record. */
static struct attainable_record cut(const struct attainable_record *whole, size_t from, size_t to)
{
    struct attainable_record r = *whole;
    r.n = to - from;
    r.first = from == 0;
    r.moving = whole->moving || from > 0;
    r.n_rings = from > 0 ? 0 : whole->n_rings;
    r.lead = from < GUARD ? from : GUARD;
    r.after = whole->n - to < GUARD ? whole->n - to : GUARD;
    r.sources = bf_alloc(r.n_sources + 1, sizeof *r.sources);
    r.data = bf_alloc(r.n_data + 1, sizeof *r.data);
    for (size_t i = 0; i < r.n_sources; i++) {
        r.sources[i] = whole->sources[i];
        r.sources[i].u += from;
    }
    for (size_t d = 0; d < r.n_data; d++) {
        r.data[d] = whole->data[d];
        r.data[d].z += from;
    }
    return r;
}

static void add_pieces(struct attainable_problem *p, const struct attainable_record *whole)
{
    const size_t n_pieces = whole->periodic || whole->n <= LONG ? 1 : whole->n / PIECE;
    p->records = bf_grow(p->records, p->n_records + n_pieces, sizeof *p->records);
    for (size_t i = 0; i < n_pieces; i++)
        p->records[p->n_records++] = cut(whole, i * whole->n / n_pieces, (i + 1) * whole->n / n_pieces);
}

void attainable_add_record(struct attainable_problem *p, const struct model *model, const struct record *record,
                           size_t index, const double noise_rms[])
{
    const bool decay = record_is_free_decay(record);
    struct attainable_record whole = {.n = record->n - record_free_from(record),
                                      .moving = record_state_is_free(record),
                                      .periodic = record_is_periodic(record),
                                      .dt_s = record->dt_s,
                                      .window_rate = record_window_rate(record)};
    whole.n_whole = whole.n;
    whole.sources = bf_alloc(model->n_inputs + 1, sizeof *whole.sources);
    whole.data = bf_alloc(model->n_outputs + 1, sizeof *whole.data);
    add_channels(p, model, record, index, noise_rms, &whole);
    whole.moving = whole.moving && !whole.periodic;
    for (size_t i = 0; i < model->n_inputs && !decay; i++)
        add_input(p, model, record, i, &whole);
    whole.n_rings = recorder_rings(record, whole.ring);
    add_pieces(p, &whole);
    free(whole.sources), free(whole.data);
}

void attainable_problem_free(struct attainable_problem *p)
{
    for (size_t r = 0; r < p->n_records; r++) {
        attainable_close(&p->records[r]);
        free(p->records[r].sources), free(p->records[r].data);
    }
    free(p->records);
}
