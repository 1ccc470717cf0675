/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "show.h"

static const char *kind_text(enum record_finding_kind kind)
{
    switch (kind) {
    case FINDING_OVERLOAD:
        return "overload";
    case FINDING_HITS:
        return "hits";
    case FINDING_OPEN_END:
        return "open_end";
    case FINDING_WINDOW:
        return "force_window";
    case FINDING_OPEN_BEGIN:
        return "open_begin";
    case FINDING_NO_ANSWER:
        return "no_answer";
    case FINDING_HUM:
        break;
    }
    return "hum";
}

const struct answer_field record_finding_fields[] = {
    ANSWER_ROW(TEXT, "file", "the record", .flags = ANSWER_BASE),
    ANSWER_ROW(TEXT, "column", "of it"),
    ANSWER_ROW(TEXT, "kind", "of the finding"),
    ANSWER_ROW(COUNT, "sample", "the first one, counted from 1"),
    ANSWER_ROW(COUNT, "n", "how many"),
    ANSWER_ROW(NUMBER, "value", "there"),
    ANSWER_ROW(TEXT, "text", "in a sentence"),
    ANSWER_SAY("- {file} {text}"),
    {0},
};

void record_findings_json(struct json *root, const struct record records[], const struct record_findings findings[],
                          size_t n)
{
    struct json *list = json_put(root, "record_findings", json_new_array());
    for (size_t r = 0; r < n; r++)
        for (size_t i = 0; i < findings[r].n; i++) {
            const struct record_finding *f = &findings[r].all[i];
            struct json *one = json_push(list, json_new_object());
            json_put_text(one, "file", records[r].path != NULL ? records[r].path : "");
            json_put_text(one, "column", records[r].columns[f->column].name);
            json_put_text(one, "kind", kind_text(f->kind));
            json_put_number(one, "sample", (double)(f->sample + 1));
            json_put_number(one, "n", (double)f->n);
            json_put_number(one, "value", f->value);
            json_put_text(one, "text", f->text);
        }
}
