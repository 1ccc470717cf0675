/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnose_limits.h"

const struct search_limits search_limits = {.half = 0.5,
                                            .nearly_all = 0.9,
                                            .answer = 0.97,
                                            .fifth = 0.2,
                                            .tenth = 0.1,
                                            .hundredth = 0.01,
                                            .thousandth = 1e-3,
                                            .mate = 1.005,
                                            .same = 1.01,
                                            .alike = 1.05,
                                            .more = 1.5,
                                            .far = 3.0};
