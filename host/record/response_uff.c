/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "record.h"

#include <complex.h>

enum { COMPLEX_DOUBLE = 6, EVEN = 1, FREQUENCY_RESPONSE = 4, DIRECTION = 3, A_LINE = 2 };

static void put_axis(FILE *out, enum uff_quantity quantity, const char *label, const char *unit)
{
    (void)fprintf(out, "%10d%5d%5d%5d %-20.20s %-20.20s\n", (int)quantity, 0, 0, 0, label, unit);
}

void response_write_uff(FILE *out, const struct uff_response *r, const char *comment)
{
    (void)fprintf(out, "%6d\n%6d\n", -1, 58);
    (void)fprintf(out, "%.39s/%.39s\n%.80s\nNONE\nNONE\nNONE\n", r->output, r->input, comment);
    (void)fprintf(out, "%5d%10d%5d%10d %-10.10s%10zu%4d %-10.10s%10zu%4d\n", FREQUENCY_RESPONSE, 0, 0, 0, r->output,
                  r->output_node, DIRECTION, r->input, r->input_node, DIRECTION);
    (void)fprintf(out, "%10d%10zu%10d%13.5E%13.5E%13.5E\n", COMPLEX_DOUBLE, r->n, EVEN, r->first_Hz, r->step_Hz, 0.0);
    put_axis(out, UFF_FREQUENCY, "Frequency", "Hz");
    put_axis(out, r->output_quantity, r->output, r->output_unit);
    put_axis(out, r->input_quantity, r->input, r->input_unit);
    put_axis(out, UFF_UNKNOWN, "NONE", "NONE");
    for (size_t k = 0; k < r->n; k++)
        (void)fprintf(out, "%20.11E%20.11E%s", creal(r->H[k]), cimag(r->H[k]),
                      (k + 1) % A_LINE == 0 || k + 1 == r->n ? "\n" : "");
    (void)fprintf(out, "%6d\n", -1);
}
