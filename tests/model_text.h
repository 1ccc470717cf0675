/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_text.h — a good model file in pieces, and what reading a text says. Include after cmocka.h. */
#ifndef MODEL_TEXT_H
#define MODEL_TEXT_H

#include <string.h>
#include "model/model.h"

#define HEAD       "format: beamfit-model/1\n"                               /* line 1 */
#define BEAM       "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n" /* line 2 */
#define PARAMETERS                                                           /* lines 3 … 8 */                       \
    "parameters:\n  EI_beam_Nm2: {value: 0.495, prior: 0.03}\n  EI_patch_Nm2: 1.050\n"                                 \
    "  rho_beam_kgpm: {value: 0.0925, fixed: true}\n  rho_patch_kgpm: {value: 0.300}\n  Ks_V: {value: 60.0}\n"
#define CHANNELS /* lines 9 … 12 */                                                                                  \
    "inputs:\n  hammer_N: {kind: point_force, at_m: 0.0254}\noutputs:\n  piezo_V: {kind: patch_strain}\n"
#define GOOD HEAD BEAM PARAMETERS CHANNELS

static inline enum bf_status read_text(const char *text, struct model *model, struct bf_error *err)
{
    return model_read_text("m.yaml", text, strlen(text), model, err);
}

static inline void reads(const char *text, struct model *model)
{
    struct bf_error err = {0};
    if (read_text(text, model, &err) != BF_OK)
        fail_msg("%s\n%s", err.text, text);
}

/* Refused at `where` ("m.yaml:3: ") with the phrase and a remedy after a semicolon, and nothing left to free. */
static inline void refuses(const char *text, const char *where, const char *phrase)
{
    struct model model;
    struct bf_error err = {0};
    if (read_text(text, &model, &err) != BF_BAD_FILE)
        fail_msg("accepted:\n%s", text);
    if (strncmp(err.text, where, strlen(where)) != 0 || !strstr(err.text, phrase) || !strchr(err.text, ';'))
        fail_msg("wanted '%s … %s …; remedy', got '%s'", where, phrase, err.text);
    assert_null(model.regions);
    assert_null(model.document);
}

#endif
