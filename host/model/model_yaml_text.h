/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_text.h — a growing text of YAML. */
#ifndef BEAMFIT_MODEL_YAML_TEXT_H
#define BEAMFIT_MODEL_YAML_TEXT_H

#include <stddef.h>

/* Starts empty ({0}); the caller frees s, which is NULL until something was added. */
struct yaml_text {
    char *s;
    size_t n, room;
};
void yaml_text_add(struct yaml_text *text, const char *s);
void yaml_text_addf(struct yaml_text *text, const char *format, ...)
    __attribute__((format(printf, 2, 3))); /* 511 bytes at most */
void yaml_text_number(struct yaml_text *text, double x);

/* A scalar, quoted when plain YAML would read it as something else. */
void yaml_text_scalar(struct yaml_text *text, const char *s);

#endif
