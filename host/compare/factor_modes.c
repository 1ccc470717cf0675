/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factor_modes.c — whether the modes of the records settle that no channel has a wrong sign or unit. */
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>

/* All that is set by hand. */
static const struct agreement {
    double floor; /* of the signal: what the free linear model may leave, or it tells no modes */
    double
        alike; /* cosine between measured and fitted residues of a path: a mass or a spring turns some modes, not all */
    double factor; /* between them, either way: a decade, g and a turned sign are beyond */
} limits = {.floor = 0.3, .alike = 0.8, .factor = 2.0};

/* Measured and fitted residues of one path have the same sign and size. */
static bool path_agrees(const struct model *model, const struct measured_modes *modes, const double complex fitted[],
                        size_t path)
{
    const size_t n_paths = modes->n_outputs * modes->n_inputs;
    double both = 0.0, of_fitted = 0.0, of_measured = 0.0;
    for (size_t k = 0; k < modes->n; k++) {
        const double weight = measured_modes_weight(modes, model, k, path);
        const double complex measured = weight * modes->residue[k * n_paths + path];
        const double complex own = weight * fitted[k * n_paths + path];
        if (isnan(creal(measured)))
            continue;
        both += creal(measured * conj(own));
        of_fitted += creal(own * conj(own)), of_measured += creal(measured * conj(measured));
    }
    if (!(of_measured > 0.0))
        return true; /* no record has it */
    return both >= limits.alike * sqrt(of_fitted * of_measured) && both <= limits.factor * of_fitted &&
           of_fitted <= limits.factor * both;
}

bool factor_modes_agree(const struct model *model, const struct record records[], size_t n_records,
                        const struct predict_options *options, struct attainable *attainable)
{
    struct bf_error ignored;
    struct model own;
    double left;
    if (attainable_find(model, records, n_records, NULL, attainable, &ignored) != BF_OK) {
        attainable_free(attainable);
        return false;
    }
    struct measured_modes modes = measured_modes_of(attainable, records, n_records);
    const size_t n_paths = modes.n_outputs * modes.n_inputs;
    double complex *fitted = bf_alloc(modes.n * n_paths + 1, sizeof *fitted);
    const struct modal_options how = {.predict = *options, .fitted = fitted};
    bool agree = attainable->nrmse < limits.floor && modes.n > 1 && model_copy(model, &own, &ignored) == BF_OK;
    if (agree) {
        agree = refit_to_modes(&own, &modes, &how, &left, &ignored) == BF_OK;
        model_free(&own);
    }
    for (size_t path = 0; path < n_paths && agree; path++)
        agree = path_agrees(model, &modes, fitted, path);
    measured_modes_free(&modes);
    free(fitted);
    return agree;
}
