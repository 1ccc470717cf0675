/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "board_options.h"

#include <math.h>

enum { LEAST_BAUD = 300, MOST_BAUD = 12000000 };

enum bf_status board_take_option(int code, struct board_options *out, struct bf_error *err)
{
    if (code == 'b')
        return options_count("--baud", optarg, LEAST_BAUD, MOST_BAUD, &out->baud, err);
    if (code != 'p')
        return BF_USAGE;
    out->port = optarg;
    return BF_OK;
}

enum bf_status board_check_options(const struct board_options *options, const char *command, struct bf_error *err)
{
    char list[512];
    if (options->port != NULL)
        return BF_OK;
    port_list(sizeof list, list);
    return bf_fail(err, BF_USAGE, "%s needs the board's port: --port /dev/ttyUSB0%s", command, list);
}

enum bf_status board_open(const struct board_options *options, struct link *link, struct bf_error *err)
{
    return link_open(options->port, options->baud > 0 ? options->baud : PORT_BAUD, link, err);
}

enum bf_status board_prescale(const struct board_options *options, const struct link *link, long wanted,
                              unsigned *prescale, struct bf_error *err)
{
    const double sample_Hz = 1e-3 * (double)link->info.sample_mHz, line_Hz = link_rate_Hz(port_baud(link->port));
    const double least = options->baud == 0 && port_is_pty(link->port) ? 1.0 : ceil(sample_Hz / line_Hz);
    if (least > BOARD_MOST_PRESCALE)
        return bf_fail(err, BF_USAGE,
                       "%ld bit/s carries %.0f samples a second, the board takes %.0f; give a greater --baud",
                       port_baud(link->port), line_Hz, sample_Hz);
    if (wanted > 0 && (double)wanted < least)
        return bf_fail(
            err, BF_USAGE,
            "--prescale %ld: %ld bit/s carries %.0f samples a second and the board takes %.0f; give --prescale "
            "%.0f, or --baud %.0f or more",
            wanted, port_baud(link->port), line_Hz, sample_Hz, least,
            ceil(sample_Hz / (double)wanted / line_Hz * (double)port_baud(link->port)));
    *prescale = wanted > 0 ? (unsigned)wanted : least > 1.0 ? (unsigned)least : 1u;
    return BF_OK;
}
