/* SPDX-License-Identifier: MIT */
/* A plan into an image, member by member: arrays of other builds have other sizes than a controller's. */
#include <string.h>

#include "beam_image_file.h"

/* What is denormal in single precision is nothing: a controller takes no such number. */
static void pack_list(size_t n, const beam_real from[], float out[])
{
    const float least = 1.17549435e-38F;
    for (size_t i = 0; i < n; i++) {
        out[i] = (float)from[i];
        if (out[i] > -least && out[i] < least)
            out[i] = 0.0F;
    }
}

static int ring_fits(const struct beam_ring *ring)
{
    return ring->offset + ring->length <= BEAM_IMAGE_HISTORY;
}

static int fits(const struct beam_plan_counts *n)
{
    int all = n->n_inputs == 1 && n->n_outputs == 1 && n->n_ports <= BEAM_IMAGE_PORTS && ring_fits(&n->input_ring[0]) &&
              ring_fits(&n->command_ring) && ring_fits(&n->output_ring[0]) &&
              n->n_taps * (1 + 2 * n->n_ports) <= BEAM_IMAGE_TAPS;
    for (int c = 0; c < n->n_links[0]; c++) {
        const struct beam_link *link = &n->link[0][c];
        all = all && (link->n_taps == 0 || (ring_fits(&link->ring) && link->tap + link->n_taps <= BEAM_IMAGE_TAPS));
    }
    return all;
}

static void pack_counts(const struct beam_plan_counts *n, struct beam_image_counts *out)
{
    out->n_blocks = n->n_blocks;
    out->n_inputs = n->n_inputs;
    out->n_outputs = n->n_outputs;
    out->n_ports = n->n_ports;
    out->n_uses = n->n_uses;
    out->base_use = n->base_use;
    out->drive_input = n->drive_input;
    out->n_taps = n->n_taps;
    out->beam_latency = n->beam_latency;
    out->latency = n->latency;
    out->law_evaluations = n->law_evaluations;
    for (int p = 0; p < n->n_ports; p++) {
        out->port_use[p] = n->port_use[p];
        out->port_coordinate[p] = n->port_coordinate[p];
    }
    memcpy(out->input_ring, n->input_ring, sizeof out->input_ring);
    out->command_ring = n->command_ring;
    out->output_ring[0] = n->output_ring[0];
    out->n_links[0] = n->n_links[0];
    memcpy(out->link[0], n->link[0], sizeof out->link[0]);
}

static void pack_numbers(const struct beam_plan *plan, struct beam_image_numbers *out)
{
    const struct beam_plan_numbers *x = &plan->x;
    const int n_ports = plan->n.n_ports, n_rows = 1 + 2 * n_ports;
    out->dt_s = (float)x->dt_s;
    for (int b = 0; b < BEAM_BLOCKS; b++)
        pack_list(4, x->phi[b], out->phi[b]);
    for (int i = 0; i < BEAM_IMAGE_INPUTS; i++)
        pack_list(BEAM_STATES, x->gamma[i], out->gamma[i]);
    for (int p = 0; p < n_ports; p++)
        pack_list(BEAM_STATES, x->gamma_port[p], out->gamma_port[p]);
    for (int r = 0; r < n_rows; r++) {
        pack_list(BEAM_STATES, x->row[r], out->row[r]);
        pack_list((size_t)n_ports, x->compliance[r], out->compliance[r]);
    }
    pack_list((size_t)n_ports, x->weight, out->weight);
    pack_list(1, x->base_gain, out->base_gain);
    pack_list(BEAM_CHAIN, x->link_phi[0], out->link_phi[0]);
    pack_list(BEAM_CHAIN, x->link_gamma[0], out->link_gamma[0]);
    pack_list(BEAM_IMAGE_TAPS, x->taps, out->taps);
}

static void pack_uses(const struct beam_plan *plan, struct beam_image_use out[BEAM_USES])
{
    for (int u = 0; u < plan->n.n_uses; u++) {
        const struct beam_use *use = &plan->use[u];
        out[u].effect = beam_image_effect_key(use->effect->id);
        out[u].channels = use->channels;
        pack_list((size_t)use->effect->n_parameters, use->p, out[u].p);
    }
}

enum beam_image_fault beam_image_pack(const struct beam_plan *plan, struct beam_image_file *file)
{
    if (!fits(&plan->n))
        return BEAM_IMAGE_BAD_PLAN;
    pack_counts(&plan->n, &file->counts);
    pack_numbers(plan, &file->numbers);
    pack_uses(plan, file->front.use);
    return BEAM_IMAGE_FINE;
}
