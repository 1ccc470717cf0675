/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "line_set.h"

#include <stdio.h>

struct line_group *line_group_add(struct line_rows *lines, const struct line_set *set, enum line_kind kind,
                                  const char *name)
{
    lines->groups = bf_grow(lines->groups, lines->n_groups + 1, sizeof *lines->groups);
    struct line_group *group = &lines->groups[lines->n_groups++];
    *group = (struct line_group){.record = set->index, .kind = kind, .row = lines->n_rows, .stated = true};
    (void)snprintf(group->name, sizeof group->name, "%s", name);
    return group;
}

void line_row_add(struct line_rows *lines, double measured, double scale)
{
    const size_t n = lines->n_rows++;
    lines->measured = bf_grow(lines->measured, n + 1, sizeof *lines->measured);
    lines->scale = bf_grow(lines->scale, n + 1, sizeof *lines->scale);
    lines->measured[n] = measured;
    lines->scale[n] = scale;
    lines->groups[lines->n_groups - 1].n++;
}
