/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_check.h — where in a model a fault is; model_yaml_read.c looks the place up in the file. */
#ifndef BEAMFIT_MODEL_CHECK_H
#define BEAMFIT_MODEL_CHECK_H

#include "model.h"

struct model_where {
    const char *section; /* "beam", "parameters", "inputs", "outputs", "effects" */
    const char *item;    /* key inside the section; NULL: none */
    size_t index;        /* of an effect, when section is "effects" */
    const char *key;     /* key inside the item; NULL: none */
};

/* model_check() with the place of the fault, and text without a file name. */
enum bf_status model_check_where(const struct model *model, struct model_where *where, struct bf_error *err);

enum { PLACE_ADVICE = 120 };

/* What to do about a place outside the beam: its metres, where it fits the beam as millimetres or centimetres; else the beam's ends. */
void model_place_advice(double x_m, double length_m, char text[PLACE_ADVICE]);

#endif
