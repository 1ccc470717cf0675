/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A plan of this build in a controller's image: every number is there, the controller steps like it, and what has no room. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"
#include "beam_image_file.h"

static const double rate_Hz = 1000.0;
static struct beam_case c;
static struct beam_image_file file;

/* Patch to patch, as a controller is wired; narrowed, as an image is made. */
static void build(const char *const effects[], size_t n, enum beam_hold hold)
{
    memset(&file, 0, sizeof file);
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.n_inputs = c.description.n_outputs = 1;
    c.description.input[0].kind = BEAM_INPUT_PATCH_MOMENT;
    c.description.output[0].kind = BEAM_OUTPUT_PATCH_STRAIN;
    for (size_t i = 0; i < n; i++) {
        const struct beam_effect *effect = beam_effect_find(effects[i]);
        double p[3] = {0};
        for (int j = 0; j < effect->n_parameters; j++)
            p[j] = effect->parameters[j].start * (effect->parameters[j].role == BEAM_ROLE_PLACE ? beam_length() : 1.0);
        case_add_effect(&c.description, effect, 0, p[0], p[1], p[2]);
    }
    case_build(&c, 1.0 / rate_Hz, hold);
}

static void same_floats(size_t n, const double plan[], const float packed[])
{
    for (size_t i = 0; i < n; i++)
        assert_true((float)plan[i] == packed[i]);
}

static void every_number_is_in_the_file(void **state)
{
    static const char *const effects[] = {"sensor_delay", "sensor_highpass", "cubic_stiffness", "quadratic_drag"};
    (void)state;
    for (size_t n = 0; n <= 3; n++) {
        build(effects, n, BEAM_HOLD_ZERO_ORDER);
        assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_FINE);
        const struct beam_plan_counts *counts = &c.plan.n;
        assert_int_equal(file.counts.n_blocks, counts->n_blocks);
        assert_int_equal(file.counts.n_ports, n == 3);
        assert_int_equal(file.counts.n_uses, n);
        assert_int_equal(file.counts.latency, counts->latency);
        assert_int_equal(file.counts.n_links[0], n < 2 ? n : 2);
        assert_memory_equal(file.counts.link[0], counts->link[0], sizeof file.counts.link[0]);
        assert_memory_equal(&file.counts.output_ring[0], &counts->output_ring[0], sizeof counts->output_ring[0]);
        for (int b = 0; b < counts->n_blocks; b++)
            same_floats(4, c.plan.x.phi[b], file.numbers.phi[b]);
        same_floats(BEAM_STATES, c.plan.x.gamma[0], file.numbers.gamma[0]);
        for (int r = 0; r < 1 + 2 * counts->n_ports; r++) {
            same_floats(BEAM_STATES, c.plan.x.row[r], file.numbers.row[r]);
            same_floats((size_t)counts->n_ports, c.plan.x.compliance[r], file.numbers.compliance[r]);
        }
        for (int p = 0; p < counts->n_ports; p++)
            same_floats(BEAM_STATES, c.plan.x.gamma_port[p], file.numbers.gamma_port[p]);
        same_floats(BEAM_IMAGE_TAPS, c.plan.x.taps, file.numbers.taps);
        same_floats(BEAM_CHAIN, c.plan.x.link_phi[0], file.numbers.link_phi[0]);
        for (size_t u = 0; u < n; u++) {
            const uint8_t *id = (const uint8_t *)effects[u];
            assert_int_equal(file.front.use[u].effect, beam_crc32(0, (uint32_t)strlen(effects[u]), id));
            same_floats((size_t)c.plan.use[u].effect->n_parameters, c.plan.use[u].p, file.front.use[u].p);
        }
    }
}

static void the_controller_steps_like_the_plan(void **state)
{
    static const char *const effects[] = {"sensor_highpass", "cubic_stiffness"};
    enum { STEPS = 2000 };
    struct beam_image_run *run = malloc(beam_image_run_bytes());
    (void)state;
    assert_non_null(run);
    build(effects, 2, BEAM_HOLD_ZERO_ORDER);
    assert_int_equal(beam_narrow(&c.plan), BEAM_OK);
    assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_FINE);
    file.front.header =
        (struct beam_image_header){.magic = BEAM_IMAGE_MAGIC, .layout = BEAM_IMAGE_LAYOUT, .length = BEAM_IMAGE_BYTES};
    file.front.setup = (struct beam_image_setup){.sensor_V_per_code = 1e-3F,
                                                 .drive_V_per_code = 0.01F,
                                                 .noise_rms = 1e-3F,
                                                 .quiet_ratio = 0.2F,
                                                 .offset_ratio = 1.0F,
                                                 .alarm_ratio = 3.0F,
                                                 .clear_ratio = 2.0F,
                                                 .averaging_s = 1.0F,
                                                 .proof_steps = 256,
                                                 .proof_amplitude = 10.0F};
    assert_int_equal(beam_image_run_seal(run, &file, (float)(1.0 / rate_Hz)), BEAM_IMAGE_FINE);
    double off = 0.0, whole = 0.0;
    unsigned seed = 3;
    beam_reset(&c.plan, &c.state);
    beam_image_run_rest(run);
    for (int k = 0; k < STEPS; k++) {
        const float drive = (float)(20.0 * case_random(&seed));
        double u[BEAM_INPUTS] = {(double)drive}, y[BEAM_OUTPUTS];
        float packed = 0.0F;
        assert_int_equal(beam_step(&c.plan, &c.state, u, y), BEAM_OK);
        assert_int_equal(beam_image_run_step(run, drive, &packed), BEAM_OK);
        off += ((double)packed - y[0]) * ((double)packed - y[0]);
        whole += y[0] * y[0];
    }
    assert_true(whole > 0.0 && sqrt(off / whole) < 1e-5);
    free(run);
}

static void what_has_no_room_is_refused(void **state)
{
    static const char *const delay[] = {"sensor_delay"}, *const drag[] = {"quadratic_drag"};
    (void)state;
    build(NULL, 0, BEAM_HOLD_ZERO_ORDER);
    c.plan.n.n_inputs = 2;
    assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_BAD_PLAN);
    c.plan.n.n_inputs = 1;
    c.plan.n.n_outputs = 2;
    assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_BAD_PLAN);
    build(delay, 1, BEAM_HOLD_ZERO_ORDER);
    assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_FINE);
    c.plan.n.link[0][0].ring.length = BEAM_IMAGE_HISTORY + 1 - c.plan.n.link[0][0].ring.offset;
    assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_BAD_PLAN);
    build(drag, 1, BEAM_HOLD_ZERO_ORDER); /* 8 ports */
    assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_FINE);
    build(drag, 1, BEAM_HOLD_BAND_LIMITED); /* taps to each port's row, more than there is room for */
    assert_int_equal(beam_image_pack(&c.plan, &file), BEAM_IMAGE_BAD_PLAN);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_number_is_in_the_file),
        cmocka_unit_test(the_controller_steps_like_the_plan),
        cmocka_unit_test(what_has_no_room_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
