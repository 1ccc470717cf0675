/* SPDX-License-Identifier: GPL-3.0-or-later */
/* truth_rig.h — what the truth simulator's tests share: two beams, a run, two comparisons. */
#ifndef TRUTH_RIG_H
#define TRUTH_RIG_H

#include "truth/truth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double pi = 3.14159265358979323846;

static inline void say(struct truth_spec *spec, const char *line)
{
    char message[TRUTH_MESSAGE] = "";
    if (truth_spec_line(spec, line, message) != 0)
        fail_msg("%s: %s", line, message);
}

static inline struct truth_record run(const struct truth_spec *spec)
{
    char message[TRUTH_MESSAGE] = "";
    struct truth_record record;
    if (truth_simulate(spec, &record, message) != 0)
        fail_msg("%s", message);
    return record;
}

static inline double relative_rms(const struct truth_record *a, const struct truth_record *b, const char *name)
{
    const double *x = truth_record_channel(a, name), *y = truth_record_channel(b, name);
    double difference = 0, size = 0;
    assert_non_null(x);
    assert_non_null(y);
    for (size_t i = 0; i < a->n; i++) {
        difference += (x[i] - y[i]) * (x[i] - y[i]);
        size += x[i] * x[i];
    }
    return sqrt(difference / size);
}

/* EI = 1 N·m², ρ = 1 kg/m, ℓ = 1 m, no patch: ω = (βℓ)² */
static inline void unit_beam(struct truth_spec *spec)
{
    truth_spec_default(spec);
    say(spec, "length_m = 1");
    spec->n_regions = 1;
    spec->region[0] = (struct truth_region){0, 1, 1, 1, 0, 1e-4};
    spec->gamma_sNpm2 = 0;
}

static inline void near(double value, double wanted, double relative)
{
    if (!(fabs(value - wanted) <= relative * fabs(wanted)))
        fail_msg("%.10g is not %.10g within %g", value, wanted, relative);
}

/* The paper's beam, all kinds of channels. */
static inline void paper_rig(struct truth_spec *spec)
{
    truth_spec_default(spec);
    spec->duration_s = 0.4;
    spec->modes = 24;
    say(spec, "input hammer_N point_force at_m=0.0254");
    say(spec, "input drive_V patch_moment");
    say(spec, "output piezo_V patch_strain");
    say(spec, "output accel_mps2 acceleration at_m=0.0214");
    say(spec, "output tip_mps velocity at_m=0.44");
    say(spec, "output tip_m displacement at_m=0.44");
    say(spec, "signal hammer_N raised_cosine start_s=0.01 width_s=0.004 level=20");
    say(spec, "signal drive_V chirp start_s=0 width_s=0.35 from_Hz=5 to_Hz=300 level=10 taper_s=0.02");
}

#endif
