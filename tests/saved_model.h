/* SPDX-License-Identifier: GPL-3.0-or-later */
/* saved_model.h — a model file with comments in every place; saving a model and reading it back. Include after cmocka.h. */
#ifndef SAVED_MODEL_H
#define SAVED_MODEL_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "ground/ground.h"
#include "model/model.h"
#include "test_files.h"

static const char pretty[] = "# a rig\n"
                             "format: beamfit-model/1\n"
                             "beam:\n"
                             "  length_m: 0.4573   # ruler\n"
                             "  patch_m: [0.02535, 0.08905]\n"
                             "parameters:   # all of them\n"
                             "  EI_beam_Nm2:   {value: 0.495, prior: 0.03}  # book\n"
                             "  EI_patch_Nm2:\n"
                             "    value: 1.050 # guess\n"
                             "    # not known well\n"
                             "    max: 1e6   # bound\n"
                             "  rho_beam_kgpm: 0.0925\n"
                             "  rho_patch_kgpm: {value: 0.300, sd: 0.1}\n"
                             "  # damping\n"
                             "  cDI_beam_sNm2: {value: 0.8e-5, }\n"
                             "  cDI_patch_sNm2: {\n"
                             "    value: 0.8e-5, # first\n"
                             "    min: 0 }       # second\n"
                             "  Ks_V: {value: 60.0}\n"
                             "x_operator: Ewa  # who\n"
                             "inputs:\n"
                             "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
                             "outputs:\n"
                             "  piezo_V: {kind: patch_strain}\n"
                             "effects:\n"
                             "  - {kind: quadratic_drag, coefficient_Ns2pm3: {value: 0.02}}  # air\n"
                             "  # the tip\n"
                             "  - kind: tip_mass\n"
                             "    mass_kg: 0.002  # scale\n"
                             "  - {kind: mains_hum, frequency_Hz: 50}\n"
                             "# the end\n";

static inline void reads(const char *text, struct model *model)
{
    struct bf_error err = {0};
    if (model_read_text("m.yaml", text, strlen(text), model, &err) != BF_OK)
        fail_msg("%s\n%s", err.text, text);
}

/* Saves, reads back, and returns the new text; caller frees. */
static inline char *save(struct model *model, struct model *back)
{
    struct bf_error err = {0};
    char *path = temporary_file("saved.yaml", "", 0);
    if (model_write(path, model, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_int_equal(model_read(path, back, &err), BF_OK);
    assert_string_equal(back->sha256, model->sha256);
    FILE *f = fopen(path, "rb");
    char *text = calloc(1, 1 << 16);
    assert_true(fread(text, 1, (1 << 16) - 1, f) > 0);
    (void)fclose(f);
    unlink(path);
    free(path);
    return text;
}

static inline void same_parameter(const struct parameter *a, const struct parameter *b)
{
    assert_string_equal(a->name, b->name);
    assert_true(!(a->value < b->value) && !(a->value > b->value)); /* every bit, −0 aside */
    assert_true(a->prior == b->prior && a->prior_value == b->prior_value);
    assert_true(a->min == b->min && a->max == b->max);
    assert_true(a->fixed == b->fixed && a->logarithmic == b->logarithmic);
    assert_true(fabs(a->sd - b->sd) <= 1e-5 * a->sd); /* written with 6 digits */
}

static inline void same_model(const struct model *a, const struct model *b)
{
    assert_int_equal(a->n_materials, b->n_materials);
    for (size_t i = 0; i < a->n_materials; i++) {
        same_parameter(&a->materials[i].EI, &b->materials[i].EI);
        same_parameter(&a->materials[i].rho, &b->materials[i].rho);
        same_parameter(&a->materials[i].cDI, &b->materials[i].cDI);
    }
    same_parameter(&a->gamma, &b->gamma);
    same_parameter(&a->Ks, &b->Ks);
    same_parameter(&a->KB, &b->KB);
    assert_int_equal(a->n_effects, b->n_effects);
    for (size_t i = 0; i < a->n_effects; i++) {
        const struct model_effect *p = &a->effects[i], *q = &b->effects[i];
        assert_ptr_equal(p->effect, q->effect);
        assert_string_equal(p->channel, q->channel);
        for (int j = 0; j < p->effect->n_parameters; j++)
            same_parameter(&p->parameters[j], &q->parameters[j]);
        assert_int_equal(p->n_per_record, q->n_per_record);
        for (size_t k = 0; k < p->n_per_record; k++) {
            assert_string_equal(p->per_record[k].record, q->per_record[k].record);
            assert_true(p->per_record[k].value == q->per_record[k].value);
        }
    }
    assert_int_equal(a->n_inputs, b->n_inputs);
    assert_int_equal(a->n_outputs, b->n_outputs);
    assert_int_equal(a->n_regions, b->n_regions);
    assert_int_equal(a->fit.present, b->fit.present);
    assert_int_equal(a->fit.n_records, b->fit.n_records);
    assert_string_equal(a->fit.parent_sha256, b->fit.parent_sha256);
}

static inline void add_fit_block(struct model *m)
{
    struct fit_info *fit = &m->fit;
    fit->present = fit->converged = true;
    fit->nrmse = 0.00412345678;
    fit->noise_ratio = 1.01;
    fit->check_nrmse = 0.005;
    fit->n_records = 2;
    fit->records = calloc(2, sizeof *fit->records);
    for (size_t i = 0; i < 2; i++) {
        struct fit_record *record = &fit->records[i];
        record->file = strdup(i ? "dir with blank/it's: #2.csv" : "train1.csv");
        hash_sha256_hex("x", i, record->sha256);
        record->held_out = i == 1;
        record->n_channels = 1;
        record->channels = calloc(1, sizeof *record->channels);
        record->channels[0] = (struct fit_channel){.name = "piezo_V", .nrmse = 0.1, .noise_ratio = 1.5};
    }
}

#endif
