/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * deployment.h — a model on its way into a target image. target_image_make() runs, in this order: target_board(), deploy_channels(),
 * deploy_space(), deploy_judge(), deploy_effects(); then it packs and proves what they made.
 */
#ifndef BEAMFIT_DEPLOYMENT_H
#define BEAMFIT_DEPLOYMENT_H

#include "beam/beam.h"
#include "board.h"

/* A block of the step that the ten-dimensional model does not have: it takes the drive and adds to the sensor. */
struct beside {
    double phi[4]; /* Φ − 1 by rows */
    double row[2]; /* what one input's worth of state adds; the drive enters the first state with 1 */
};

struct deployment {
    struct model model; /* one output, one input, effects that are deployed, patch at its shifted place */
    size_t *origin;     /* [model.n_effects] index of each effect in the model it came from */
    double direct;      /* output per input beside the modes, at once */
    int n_links;        /* effects on the sensor */
    struct parameter_ref *refs;
    double *theta;
    struct parameter_map map;
    struct reduced reduced;
    struct system *system;
    struct beam_model out; /* double */
    int n_beside;
    struct beside beside[2];
};

void target_note(struct target_image *image, const char *format, ...) __attribute__((format(printf, 2, 3)));

void target_say(struct target_effect *effect, bool runs, const char *format, ...) __attribute__((format(printf, 3, 4)));
void target_values(const struct model_effect *effect, double p[BEAM_EFFECT_PARAMETERS]); /* zeros beyond its own */

/* target_image_board.c: the board of the options, the model and the fit, complete. */
enum bf_status target_board(const struct model *model, const struct target_options *options, struct target_image *image,
                            struct bf_error *err);

/*
 * target_image_effects.c: d->model is a copy of the model that keeps the board's two channels and the effects that act
 * through them; what became of the effects, and notes, into image.
 */
enum bf_status deploy_channels(const struct model *model, const struct target_options *options, struct deployment *d,
                               struct target_image *image, struct bf_error *err);
/* target_image_ports.c: uses and ports of d->out, from the space. */
enum bf_status deploy_effects(struct deployment *d, struct target_image *image, struct bf_error *err);

/*
 * target_image_model.c: the space with so many static responses (fewer where they depend on each other), and matrices and
 * channels of d->out in it; what an earlier call made is forgotten.
 */
enum bf_status deploy_space(struct deployment *d, size_t statics, struct target_image *image, struct bf_error *err);
size_t deploy_statics(const struct model *model); /* inputs, outputs and places of effects, four at most */
/*
 * target_image_judge.c: what the space is worth, into image; with `mending` the blocks beside it that a held drive needs,
 * at most two and as many as there is room for.
 */
enum bf_status deploy_judge(struct deployment *d, bool mending, struct target_image *image, struct bf_error *err);
/*
 * target_image_observer.c: blocks, gains and times of the image's observer, from the narrowed plan and the board's noise, into the file. A model that
 * has nothing to observe gets an offset alone.
 */
enum bf_status deploy_observer(struct target_image *image, struct bf_error *err);
/*
 * target_image_tracking.c: the modes that the board follows, the lowest observed ones, into the file. BF_BAD_FILE: there is none.
 */
enum bf_status deploy_tracking(struct target_image *image, struct bf_error *err);
void deployment_free(struct deployment *d);

#endif
