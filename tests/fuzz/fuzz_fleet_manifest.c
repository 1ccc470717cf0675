/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Any bytes as a fleet's manifest: refused with one line of text, or units with names of their own. And as the rows of a unit's process. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "fleet/fleet.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct fleet_manifest m;
    struct fleet_value values[FLEET_COLUMNS];
    enum fleet_table table;
    struct bf_error err = {0};
    for (size_t at = 0; fleet_rows_next(data, n, &at, &table, values);)
        if (at > n || table >= FLEET_TABLES)
            abort();
    if (fleet_manifest_parse("units.csv", (const char *)data, n, &m, &err) != BF_OK) {
        if (err.status != BF_BAD_FILE || err.text[0] == '\0' || strchr(err.text, '\n') != NULL || m.units != NULL)
            abort();
        return 0;
    }
    for (size_t i = 0; i < m.n; i++)
        if (m.units[i].name[0] == '\0' || strlen(m.units[i].name) >= FLEET_NAME)
            abort();
    fleet_manifest_free(&m);
    return 0;
}
