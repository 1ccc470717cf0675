/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which unit's board is at which port, read from a CSV file. */
#include "csv.h"
#include "fleet.h"

#include <stdlib.h>
#include <string.h>

enum { UNIT, PORT, KEY, NAMED };
static const char *const named[NAMED] = {"unit", "port", "key"};

static enum bf_status take_header(const struct lines *in, const struct csv_cells *cells, size_t at[NAMED],
                                  struct bf_error *err)
{
    for (size_t k = 0; k < NAMED; k++) {
        at[k] = 0;
        while (at[k] < cells->n && strcmp(cells->text[at[k]], named[k]) != 0)
            at[k]++;
        if (at[k] == cells->n && k != KEY)
            return bf_fail_at(err, in->path, in->number,
                              "no column '%s'; the first line names the columns: unit,port and, where boards have keys "
                              "of their own, key",
                              named[k]);
    }
    return BF_OK;
}

static enum bf_status take_port(const struct lines *in, const struct csv_cells *cells, const size_t at[NAMED],
                                size_t n_cells, struct fleet_ports *out, struct bf_error *err)
{
    if (cells->n != n_cells)
        return bf_fail_at(err, in->path, in->number, "%zu cells where the header has %zu; quote a cell with a comma",
                          cells->n, n_cells);
    if (cells->text[at[UNIT]][0] == '\0' || cells->text[at[PORT]][0] == '\0')
        return bf_fail_at(err, in->path, in->number, "a unit and a port belong on each line");
    for (size_t i = 0; i < out->n; i++)
        if (strcmp(out->all[i].port, cells->text[at[PORT]]) == 0)
            return bf_fail_at(err, in->path, in->number, "port %.80s stands here twice; one board is at a port",
                              out->all[i].port);
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    out->all[out->n++] =
        (struct fleet_port){.unit = bf_strdup(cells->text[at[UNIT]]),
                            .port = bf_strdup(cells->text[at[PORT]]),
                            .key = at[KEY] < n_cells ? csv_place(in->path, cells->text[at[KEY]]) : bf_strdup("")};
    return BF_OK;
}

enum bf_status fleet_ports_read(const char *path, struct fleet_ports *out, struct bf_error *err)
{
    struct lines in;
    struct csv_cells cells = {0};
    bool more;
    size_t at[NAMED] = {0}, n_cells = 0;
    *out = (struct fleet_ports){0};
    if (lines_open(path, &in, err) != BF_OK)
        return err->status;
    outputs_note_input(path);
    enum bf_status status;
    while ((status = csv_next(&in, &cells, &more, err)) == BF_OK && more) {
        status = n_cells == 0 ? take_header(&in, &cells, at, err) : take_port(&in, &cells, at, n_cells, out, err);
        if (status != BF_OK)
            break;
        n_cells = n_cells == 0 ? cells.n : n_cells;
    }
    lines_close(&in);
    free(cells.buffer);
    if (status == BF_OK && out->n == 0)
        status = bf_fail_at(err, path, 0, "no port; write unit,port and a line for each board");
    if (status != BF_OK)
        fleet_ports_free(out);
    return status;
}

void fleet_ports_free(struct fleet_ports *ports)
{
    for (size_t i = 0; i < ports->n; i++)
        free(ports->all[i].unit), free(ports->all[i].port), free(ports->all[i].key);
    free(ports->all);
    *ports = (struct fleet_ports){0};
}
