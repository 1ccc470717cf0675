/* SPDX-License-Identifier: GPL-3.0-or-later */
/* discriminate_answer.c — experiments that would tell rivals apart, as an answer. */
#include "show.h"
#include "explain/explain.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

static const double same_evidence = 0.99; /* of the other: as good */

/* Another level of the same that brings as much as the largest allowed one is not worth a row. */
static bool is_repetition(const struct discrimination *d, const struct experiment *x)
{
    const struct drive *drive = &d->drives[x->drive];
    for (size_t i = 0; i < d->n && drive->relative != 1.0; i++) {
        const struct drive *other = &d->drives[d->experiments[i].drive];
        if (other->relative == 1.0 && other->kind == drive->kind && other->at_m == drive->at_m &&
            d->experiments[i].sensor == x->sensor && d->experiments[i].evidence >= same_evidence * x->evidence)
            return true;
    }
    return false;
}

/* Those worth a person's time: of each drive with the sensors that are there, and with the best one added. listed: [d->n] */
static void choose_rows(const struct discrimination *d, size_t most, bool listed[])
{
    bool *plain = bf_alloc(d->n_drives, sizeof *plain), *sensor = bf_alloc(d->n_drives, sizeof *sensor);
    for (size_t i = 0, n = 0; i < d->n && n < most; i++) {
        const struct experiment *x = &d->experiments[i];
        bool *seen = x->sensor == d->n_sensors ? &plain[x->drive] : &sensor[x->drive];
        if (*seen || is_repetition(d, x))
            continue;
        *seen = listed[i] = true;
        n++;
    }
    free(plain), free(sensor);
}

static const struct answer_field pair_fields[] = {
    ANSWER_ROW(TEXT, "a", "a rival"),
    ANSWER_ROW(TEXT, "b", "another"),
    ANSWER_ROW(NUMBER, "separation", "expected 2 log of the likelihood ratio; above 10 is decisive"),
    ANSWER_ROW(NUMBER, "wrong_choice", "probability to take the wrong one"),
    {0},
};

static const struct answer_field experiment_fields[] = {
    ANSWER_ROW(TEXT, "name", "in words"),
    ANSWER_ROW(TEXT, "kind", "of excitation"),
    ANSWER_ROW(NUMBER, "level", "of the excitation"),
    ANSWER_ROW(BOOL, "beyond_largest_level", "larger than any so far"),
    ANSWER_ROW(BOOL, "added_sensor", "it needs one more"),
    ANSWER_ROW(NUMBER, "separation", "of the worst pair", .digits = 4, .text = "evidence"),
    ANSWER_ROW(NUMBER, "rms_over_noise", "of the difference, a sample", .digits = 3, .text = "rms/noise"),
    ANSWER_ROW(NUMBER, "wrong_choice", "probability to take the wrong one", .digits = 2, .text = "P(wrong)"),
    ANSWER_ROW_OF(LIST, "pairs", "of rivals", pair_fields),
    ANSWER_ROW(TEXTS, "hardest", "pair to tell apart"),
    ANSWER_ROW(BOOL, "listed", "by the text: the best of each drive, without repetitions"),
    ANSWER_CELL("experiment", "{name}[ ({hardest})]"),
    {0},
};

static const struct answer_field rival_fields[] = {
    ANSWER_ROW(TEXT, "name", "as it was given"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over noise on the records so far; null: none"),
    ANSWER_ROW(NUMBER_MAP, "parameters", "of its effects"),
    {0},
};

const struct answer_field discriminate_fields[] = {
    ANSWER_ROW(NUMBER, "duration_s", "of an experiment", .digits = 3),
    ANSWER_SAY(
        "Experiments of {duration_s}, best first; evidence = expected 2 log of the likelihood ratio of the worst "
        "pair\n"),
    ANSWER_ROW_OF(LIST, "experiments", "best first", experiment_fields, .flags = ANSWER_TABLE, .row = "listed",
                  .text = ""),
    ANSWER_ROW(COUNT, "left_out", "drives in which some rival cannot be predicted"),
    ANSWER_SAY(
        "[{left_out?}{left_out} {left_out#drive is|drives are} left out: some rival cannot be predicted there.]"),
    ANSWER_ROW(TEXT, "best", "its name"),
    ANSWER_ROW(TEXT, "drive", "file of the signal; null: none was written", .flags = ANSWER_NULL),
    ANSWER_ROW_OF(LIST, "present", "what the records so far tell", pair_fields, .flags = ANSWER_MAYBE),
    ANSWER_ROW_OF(LIST, "rivals", "as they were fitted", rival_fields),
    ANSWER_ROW(TEXT, "text", "the answer in a paragraph"),
    ANSWER_SAY("\n{text}"),
    ANSWER_SAY("[Its drive signal: {drive}]"),
    ANSWER_ROW(TEXT, "warning", "on the answer", .flags = ANSWER_MAYBE),
    ANSWER_ROW(NUMBER, "seconds", "it took", .unit = "s"),
    {0},
};

static void put_pairs(struct json *parent, const char *key, const struct discrimination *d,
                      const struct discriminate_pair pairs[])
{
    struct json *list = json_put(parent, key, json_new_array());
    for (size_t p = 0; p < d->n_pairs; p++) {
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "a", d->names[pairs[p].a]);
        json_put_text(one, "b", d->names[pairs[p].b]);
        json_put_number(one, "separation", pairs[p].evidence);
        json_put_number(one, "wrong_choice", pairs[p].wrong_choice);
    }
}

static void put_rivals(struct json *root, const struct discrimination *d)
{
    struct json *list = json_put(root, "rivals", json_new_array());
    for (size_t i = 0; i < d->n_rivals; i++) {
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "name", d->names[i]);
        json_put_number(one, "noise_ratio", d->noise_ratio[i]);
        struct json *parameters = json_put(one, "parameters", json_new_object());
        const struct model *model = &d->models[i];
        for (size_t e = 0; e < model->n_effects; e++)
            for (int j = 0; j < model->effects[e].effect->n_parameters; j++) {
                char label[2 * MODEL_NAME];
                (void)snprintf(label, sizeof label, "%s.%s", model->effects[e].effect->id,
                               model->effects[e].parameters[j].name);
                json_put_number(parameters, label, model->effects[e].parameters[j].value);
            }
    }
}

struct json *discriminate_json(const struct discrimination *d, const char *drive, size_t most)
{
    bool *listed = bf_alloc(d->n, sizeof *listed);
    struct json *root = json_new_object();
    choose_rows(d, most, listed);
    struct json *list = json_put(root, "experiments", json_new_array());
    for (size_t i = 0; i < d->n; i++) {
        const struct experiment *x = &d->experiments[i];
        struct json *one = json_push(list, json_new_object());
        json_put_text(one, "name", x->name);
        json_put_text(one, "kind", drive_kind_name(d->drives[x->drive].kind));
        json_put_number(one, "level", d->drives[x->drive].level);
        json_put_bool(one, "beyond_largest_level", d->drives[x->drive].beyond);
        json_put_bool(one, "added_sensor", x->sensor < d->n_sensors);
        json_put_number(one, "separation", x->evidence);
        json_put_number(one, "rms_over_noise", x->per_sample);
        json_put_number(one, "wrong_choice", x->wrong_choice);
        put_pairs(one, "pairs", d, x->pairs);
        struct json *hardest = json_put(one, "hardest", json_new_array());
        const struct discriminate_pair *pair = discriminate_hardest(x->pairs, d->n_pairs);
        if (d->n_pairs > 1) {
            json_push_text(hardest, d->names[pair->a]);
            json_push_text(hardest, d->names[pair->b]);
        }
        json_put_bool(one, "listed", listed[i]);
    }
    free(listed);
    json_put_number(root, "left_out", (double)d->n_failed);
    json_put_text(root, "best", d->experiments[d->best].name);
    if (drive != NULL)
        json_put_text(root, "drive", drive);
    else
        json_put_number(root, "drive", (double)NAN);
    if (d->present != NULL)
        put_pairs(root, "present", d, d->present);
    put_rivals(root, d);
    json_put_number(root, "duration_s", d->duration_s);
    json_put_text(root, "text", d->text);
    if (d->warning != NULL)
        json_put_text(root, "warning", d->warning);
    json_put_number(root, "seconds", d->seconds);
    return root;
}
