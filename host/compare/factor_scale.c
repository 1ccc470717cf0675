/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factor_scale.c — sign and size of one channel against a model that knows the beam: the hypotheses of an open fit, read off the prediction. */
#include "factor_pair.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double explains = 0.5;     /* of the error: a factor that leaves less is worth a sentence */
static const double explained = 0.8;    /* of the signal: what is more like noise has no factor */
static const double gain_is_off = 0.03; /* |factor − 1| */

/* Error that the best factor leaves, as a share of the signal. */
static double scaled_error(const struct comparison_channel *c)
{
    return sqrt(fmax(0.0, 1.0 - c->alignment * c->alignment));
}

bool factor_scale_words(const struct model *model, const struct comparison_channel *c, bool named,
                        char text[SUSPECT_TEXT])
{
    struct channel_factor f = {.kind = FACTOR_CHANNEL, .found = c->scale};
    text[0] = '\0';
    if (!(scaled_error(c) < fmin(explained, explains * c->nrmse)) || !(fabs(c->scale - 1.0) > gain_is_off))
        return false;
    while (f.channel + 1 < model->n_outputs && strcmp(model->outputs[f.channel].name, c->name) != 0)
        f.channel++;
    f.factor = factor_size_of(fabs(c->scale), true);
    const bool sized = f.factor < 1.0 || f.factor > 1.0, turned = c->scale < 0.0;
    if (named && !sized && !turned)
        return false;
    const int n = snprintf(text, SUSPECT_TEXT, "Measured is %.3g times predicted, which leaves %.2g %%: ", c->scale,
                           100.0 * scaled_error(c));
    (void)snprintf(text + n, SUSPECT_TEXT - (size_t)n, "%s%s%s%s.",
                   turned ? "the sensor or an input is the other way round" : "", turned && sized ? ", and " : "",
                   f.factor != 1.0 ? "as if it were "
                   : turned        ? ""
                                   : "another gain, range, unit or level",
                   sized ? factor_unit_words(model, &f) : "");
    return true;
}
