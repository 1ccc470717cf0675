/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A long record piece by piece is the record in one piece: values and derivatives, whole and windowed, with noise up to the Nyquist frequency. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "gradient_check.h"
#include "response/predictor.h"

enum { LONG = 262144 };
static const double damped = 0.5; /* gamma_sNpm2: the beam forgets within 12300 samples */

/* Reproducible noise in [−1, 1). */
static double draw(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 4503599627370496.0 - 1.0;
}

static struct record long_record(void)
{
    struct record record = case_record("long.csv", LONG, 1.0 / 1200.0, 1.0, true);
    uint64_t state = 7;
    for (size_t c = 0; c < 2; c++)
        for (size_t k = 0; k < LONG; k++)
            record.columns[c].x[k] = draw(&state);
    return record;
}

static double difference(size_t n, const double x[], const double y[])
{
    double square = 0.0, size = 0.0;
    for (size_t k = 0; k < n; k++) {
        square += (x[k] - y[k]) * (x[k] - y[k]);
        size += x[k] * x[k];
    }
    return size > 0.0 ? sqrt(square / size) : sqrt(square);
}

struct both {
    struct predictor *predictor[2]; /* in one piece, in pieces */
    struct prediction out[2];
    size_t n;
    double *theta;
    bool *want;
};

/* Blocks against the Jacobian that was kept: each row once, of each channel the last ones first. */
struct kept {
    const struct both *b;
    size_t rows, next[8]; /* taken; the first row taken of each channel */
};

static enum bf_status take(void *context, const struct predict_block *block, struct bf_error *err)
{
    struct kept *k = context;
    const struct prediction *out = &k->b->out[1];
    const struct predict_channel *channels;
    (void)err;
    assert_true(block->channel < predictor_channels(k->b->predictor[1], &channels));
    const struct predict_channel *channel = &channels[block->channel];
    assert_int_equal(block->row + block->n,
                     k->next[block->channel] > 0 ? k->next[block->channel] : channel->row + channel->n);
    k->next[block->channel] = block->row;
    k->rows += block->n;
    for (size_t j = 0; j < k->b->n; j++)
        assert_memory_equal(block->column[j], out->jacobian + j * out->n_rows + block->row, block->n * sizeof(double));
    assert_memory_equal(block->y, out->y + block->row, block->n * sizeof(double));
    return BF_OK;
}

static void check_blocks(const struct both *b)
{
    struct bf_error err;
    struct kept kept = {.b = b};
    struct prediction y;
    assert_false(predictor_is_long(b->predictor[0]));
    assert_true(predictor_is_long(b->predictor[1]));
    if (predictor_run_blocks(b->predictor[1], b->theta, b->want, &(struct predict_sink){take, &kept}, &y, &err) !=
        BF_OK)
        fail_msg("%s", err.text);
    assert_null(y.jacobian);
    assert_int_equal(kept.rows, b->out[1].n_rows);
}

static void run_both(struct both *b)
{
    struct bf_error err;
    for (int i = 0; i < 2; i++)
        if (predictor_run(b->predictor[i], b->theta, b->want, &b->out[i], &err) != BF_OK)
            fail_msg("%s", err.text);
    const size_t rows = b->out[0].n_rows;
    assert_int_equal(b->out[1].n_rows, rows);
    const struct predict_channel *channels;
    const size_t n_channels = predictor_channels(b->predictor[0], &channels);
    for (size_t c = 0; c < n_channels; c++) {
        const size_t row = channels[c].row, n = channels[c].n;
        assert_true(difference(n, b->out[0].y + row, b->out[1].y + row) < 1e-9);
        for (size_t j = 0; j < b->n; j++) {
            const double off = difference(n, b->out[0].jacobian + j * rows + row, b->out[1].jacobian + j * rows + row);
            if (!(off < 1e-9))
                fail_msg("channel %zu, parameter %zu: %.3g of rms", c, j, off);
        }
    }
    check_blocks(b);
}

static void check(const char *effects, enum intersample intersample, double t_end_s)
{
    struct bf_error err;
    struct model model;
    struct record record = long_record();
    struct both b = {0};
    struct parameter_ref *refs;
    const char *name = "long.csv";
    fixture_model(&model, effects);
    model.gamma.value = damped;
    if (intersample != INTERSAMPLE_BAND_LIMITED)
        model.n_residuals = 0;
    const struct predict_options how[2] = {{.intersample = intersample, .quiet = true},
                                           {.intersample = intersample, .quiet = true, .pieces = true}};
    for (int i = 0; i < 2; i++)
        if (predictor_new(&model, &record, 1, &how[i], &b.predictor[i], &err) != BF_OK ||
            predictor_window(b.predictor[i], t_end_s, &err) != BF_OK)
            fail_msg("%s", err.text);
    assert_false(b.predictor[0]->in_pieces);
    assert_true(b.predictor[1]->in_pieces);
    b.n = model_parameters(&model, &name, 1, &refs);
    b.theta = bf_alloc(b.n, sizeof *b.theta);
    b.want = bf_alloc(b.n, sizeof *b.want);
    for (size_t i = 0; i < b.n; i++) {
        b.want[i] = true;
        b.theta[i] = refs[i].role == ROLE_GAMMA ? damped : refs[i].value;
    }
    run_both(&b);
    for (size_t i = 0; i < b.n; i++) /* less damping: the pieces must begin earlier than at the base */
        b.theta[i] *= refs[i].role == ROLE_GAMMA ? 0.5 : 1.0;
    run_both(&b);
    for (int i = 0; i < 2; i++)
        predictor_free(b.predictor[i]);
    free(b.theta);
    free(b.want);
    free(refs);
    record_free(&record);
    model_free(&model);
}

static void test_whole_record(void **state)
{
    (void)state;
    check("", INTERSAMPLE_BAND_LIMITED, INFINITY);
}

static void test_held_inputs(void **state)
{
    (void)state;
    check("", INTERSAMPLE_FIRST_ORDER_HOLD, INFINITY);
}

static void test_window_with_filter(void **state)
{
    (void)state;
    check("  - {kind: sensor_highpass, tau_s: 0.5}\n  - {kind: sensor_delay, channel: tip_mps, delay_s: 0.0007}\n"
          "  - {kind: clock_error, relative: 0.001}\n  - {kind: point_mass, mass_kg: 0.004, at_m: 0.3}\n",
          INTERSAMPLE_BAND_LIMITED, 170.0);
}

/* Samples that a stream reads, and rows that it hands on. */
struct streamed {
    const struct record *record;
    double *y; /* [n_outputs][n] */
    size_t n, n_outputs, next;
};

static void read_samples(void *context, const char *column, size_t first, size_t n, double x[])
{
    const struct streamed *t = context;
    const double *from = record_column(t->record, column);
    assert_non_null(from);
    assert_true(first + n <= t->n);
    memcpy(x, from + first, n * sizeof *x);
}

static enum bf_status take_rows(void *context, size_t first, size_t n, const double *const y[], struct bf_error *err)
{
    struct streamed *t = context;
    (void)err;
    assert_int_equal(first, t->next);
    for (size_t o = 0; o < t->n_outputs; o++)
        memcpy(t->y + o * t->n + first, y[o], n * sizeof **y);
    t->next += n;
    return BF_OK;
}

/* What `simulate` writes is the prediction in one piece. */
static void test_streamed(void **state)
{
    (void)state;
    struct bf_error err;
    struct model model;
    struct record record = long_record();
    struct predictor *whole;
    struct prediction out;
    struct parameter_ref *refs;
    const char *name = "long.csv";
    bool done;
    fixture_model(&model, "  - {kind: sensor_highpass, tau_s: 0.5}\n");
    model.gamma.value = damped;
    const size_t n = model_parameters(&model, &name, 1, &refs);
    double *theta = bf_alloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    struct streamed t = {.record = &record, .n = LONG, .n_outputs = model.n_outputs};
    t.y = bf_alloc(t.n * t.n_outputs, sizeof *t.y);
    const struct predict_options how = {.quiet = true};
    const struct predict_stream stream = {.read = read_samples, .take = take_rows, .context = &t};
    if (predictor_new(&model, &record, 1, &how, &whole, &err) != BF_OK ||
        predictor_run(whole, theta, NULL, &out, &err) != BF_OK ||
        predict_streamed(&model, &record, &how, &stream, &done, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_true(done);
    assert_int_equal(t.next, LONG);
    for (size_t o = 0; o < t.n_outputs; o++)
        assert_true(difference(LONG, out.y + o * LONG, t.y + o * LONG) < 1e-9);
    record.n = 4096; /* too short to be worth it */
    t.next = 0, t.n = 4096;
    assert_int_equal(predict_streamed(&model, &record, &how, &stream, &done, &err), BF_OK);
    assert_false(done || t.next > 0);
    predictor_free(whole);
    free(t.y), free(theta), free(refs);
    record_free(&record);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_whole_record),
        cmocka_unit_test(test_held_inputs),
        cmocka_unit_test(test_streamed),
        cmocka_unit_test(test_window_with_filter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
