/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "functional.h"

#include <stdlib.h>

struct functional *functionals_new(size_t count, size_t n)
{
    struct functional *list = bf_alloc(count, sizeof *list);
    for (size_t i = 0; i < count; i++)
        list[i].g = bf_alloc(n, sizeof(double));
    return list;
}

void functionals_free(struct functional **list, size_t count)
{
    for (size_t i = 0; *list != NULL && i < count; i++) {
        struct functional *f = &(*list)[i];
        free(f->g);
        free(f->alpha);
        free(f->d_alpha);
        for (size_t c = 0; c < f->n_changes; c++)
            free(f->changes[c].g);
        free(f->changes);
    }
    free(*list);
    *list = NULL;
}

static const struct functional_change *find_change(const struct functional *f, size_t parameter)
{
    for (size_t c = 0; c < f->n_changes; c++)
        if (f->changes[c].parameter == parameter)
            return &f->changes[c];
    return NULL;
}

double *functional_change(struct functional *f, size_t n, size_t parameter)
{
    const struct functional_change *known = find_change(f, parameter);
    if (known != NULL)
        return known->g;
    f->changes = bf_grow(f->changes, f->n_changes + 1, sizeof *f->changes);
    f->changes[f->n_changes] = (struct functional_change){.parameter = parameter, .g = bf_alloc(n, sizeof(double))};
    return f->changes[f->n_changes++].g;
}

bool functional_changes(const struct functional *f, size_t parameter)
{
    return find_change(f, parameter) != NULL;
}

void functionals_place(const struct model *model, const struct reduced *reduced, struct functional inputs[],
                       struct functional outputs[])
{
    for (size_t i = 0; i < model->n_inputs; i++)
        reduced_input(reduced, &model->inputs[i], inputs[i].g);
    for (size_t o = 0; o < model->n_outputs; o++)
        reduced_output(reduced, &model->outputs[o], outputs[o].g);
}

static void add_change(const struct system *s, const double dg[], double complex work[], double complex d_alpha[])
{
    system_functional(s, dg, work);
    for (size_t k = 0; k < s->n_poles; k++)
        d_alpha[k] += work[k];
}

void functionals_evaluate(const struct system *s, const bool structural[], struct functional list[], size_t count)
{
    double complex *work = bf_alloc(s->n_poles, sizeof *work);
    for (size_t i = 0; i < count; i++) {
        struct functional *f = &list[i];
        f->alpha = bf_grow(f->alpha, s->n_poles, sizeof *f->alpha);
        system_functional(s, f->g, f->alpha);
        if (structural == NULL)
            continue;
        f->d_alpha = bf_grow(f->d_alpha, s->map->n * s->n_poles, sizeof *f->d_alpha);
        for (size_t j = 0; j < s->map->n; j++)
            if (structural[j])
                system_functional_derivative(s, j, f->alpha, f->d_alpha + j * s->n_poles);
        for (size_t c = 0; c < f->n_changes; c++)
            if (structural[f->changes[c].parameter])
                add_change(s, f->changes[c].g, work, f->d_alpha + f->changes[c].parameter * s->n_poles);
    }
    free(work);
}
