/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fuzz_model.c — any bytes as a model file. What is refused has a message. What is accepted can be printed as a new file that
 * states the same model, and can be edited in place: if editing succeeds, the edited text states the changed model.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "model/model.h"
#include "add_effect.h"
#include "model/model_check.h"
#include "model/model_yaml.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

/* libfyaml 0.7.12 loses its table of pieces (1 KiB) when it returns a quoted scalar with more than 15 escapes. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:libfyaml.so\n";
}

static void must(int condition)
{
    if (!condition)
        abort();
}

/* The model that a text states, printed; NULL when it is refused. */
static char *stated(const char *text)
{
    struct model model;
    struct bf_error err;
    if (model_read_text("fuzz", text, strlen(text), &model, &err) != BF_OK)
        return NULL;
    char *printed = model_to_text(&model);
    model_free(&model);
    return printed;
}

static void change(struct model *model, unsigned seed)
{
    static const char *const records[] = {"a.csv", "b: c.csv"};
    struct parameter_ref *refs;
    size_t count = model_parameters(model, records, 2, &refs);
    double *value = bf_alloc(count, sizeof *value), *sd = bf_alloc(count, sizeof *sd);
    for (size_t i = 0; i < count; i++) {
        value[i] = seed >> (i % 8) & 1 ? refs[i].value * 0.99 : refs[i].value;
        sd[i] = seed >> (i % 5) & 1 ? 0.001 : 0.0;
    }
    model_set_parameters(model, refs, count, value, sd, records);
    free(refs);
    free(value);
    free(sd);
    struct bf_error err;
    if (seed & 1)
        (void)add_effect(model, "root_compliance", "", &err);
    if (seed & 2 && model->n_effects > 0)
        (void)model_drop_effect(model, model->effects[0].effect->id, &err);
    if (seed & 4)
        model->Ks.fixed = !model->Ks.fixed;
    memset(model->fit.parent_sha256, 'a', 64);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct model model;
    struct bf_error err = {0};
    char *bytes = bf_alloc(n + 1, 1);
    if (n > 0)
        memcpy(bytes, data, n);
    unsigned seed = 0;
    for (size_t i = 0; i < n; i++)
        seed = seed * 31 + data[i];
    if (model_read_text("fuzz", bytes, n, &model, &err) != BF_OK) {
        must(err.status == BF_BAD_FILE && err.text[0]);
        free(bytes);
        return 0;
    }
    char *printed = model_to_text(&model), *again = stated(printed);
    must(again && strcmp(printed, again) == 0);
    free(again);
    free(printed);
    model_warning warning[4];
    (void)model_unit_warnings(&model, warning, 4);
    change(&model, seed);
    struct model_where where;
    char *edited = model_check_where(&model, &where, &err) == BF_OK ? model_edit_text(bytes, n, &model) : NULL;
    if (edited) {
        printed = model_to_text(&model);
        again = stated(edited);
        must(again && strcmp(printed, again) == 0);
        free(printed);
        free(again);
    }
    free(edited);
    model_free(&model);
    free(bytes);
    return 0;
}
