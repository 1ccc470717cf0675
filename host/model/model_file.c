/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_file.c — the bytes of a model file: read whole and bounded, written atomically, with the line of descent. */
#include "model.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "ground/ground.h"
#include "model_check.h"
#include "model_yaml.h"

enum { MOST_ANCESTORS = 64 };

static enum bf_status read_bytes(const char *path, char **out, size_t *n, struct bf_error *err)
{
    struct stat info;
    FILE *f = fopen(path, "rb");
    if (!f || fstat(fileno(f), &info) != 0 || S_ISDIR(info.st_mode)) {
        int why = f ? EISDIR : errno;
        if (f)
            (void)fclose(f);
        return bf_fail_at(err, path, 0, "cannot be read (%s); give the path of a model file", strerror(why));
    }
    outputs_note_input(path);
    size_t room = (size_t)YAML_BYTES + 2; /* one more than allowed, to notice */
    *out = bf_alloc(room, 1);
    *n = fread(*out, 1, room - 1, f);
    int failed = ferror(f);
    (void)fclose(f);
    if (failed) {
        free(*out);
        return bf_fail_at(err, path, 0, "cannot be read to its end; check the disk");
    }
    return BF_OK;
}

enum bf_status model_read_text(const char *name, const char *bytes, size_t n, struct model *out, struct bf_error *err)
{
    bool byte_order_mark = n >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0; /* of some editors */
    const char *text = byte_order_mark ? bytes + 3 : bytes;
    size_t n_text = byte_order_mark ? n - 3 : n;
    struct yaml_node *root;
    *out = (struct model){0};
    enum bf_status status = yaml_parse(name, text, n_text, &root, err);
    if (status != BF_OK)
        return status;
    status = model_from_yaml(name, root, out, err);
    yaml_free(root);
    if (status != BF_OK) {
        model_free(out);
        return status;
    }
    char *document = bf_alloc(n_text + 1, 1);
    memcpy(document, text, n_text);
    out->document = document;
    out->path = bf_strdup(name);
    hash_sha256_hex(bytes, n, out->sha256);
    return BF_OK;
}

enum bf_status model_read(const char *path, struct model *out, struct bf_error *err)
{
    char *bytes = NULL;
    size_t n = 0;
    *out = (struct model){0};
    enum bf_status status = read_bytes(path, &bytes, &n, err);
    if (status != BF_OK)
        return status;
    status = model_read_text(path, bytes, n, out, err);
    free(bytes);
    if (status != BF_OK)
        return status;
    model_warning warning[16];
    size_t n_warnings = model_unit_warnings(out, warning, sizeof warning / sizeof *warning);
    for (size_t i = 0; i < n_warnings; i++)
        bf_warn("%s: %s", path, warning[i]);
    return BF_OK;
}

/* The file written descends from the file read. */
static void extend_lineage(struct model *model)
{
    struct fit_info *fit = &model->fit;
    if (!model->sha256[0])
        return;
    if (fit->parent_sha256[0] && strcmp(fit->parent_sha256, model->sha256) != 0) {
        size_t n = fit->n_ancestors < MOST_ANCESTORS ? fit->n_ancestors + 1 : MOST_ANCESTORS;
        fit->ancestors = bf_grow(fit->ancestors, n, sizeof *fit->ancestors);
        memmove(fit->ancestors + 1, fit->ancestors, (n - 1) * sizeof *fit->ancestors);
        memcpy(fit->ancestors[0], fit->parent_sha256, sizeof fit->parent_sha256);
        fit->n_ancestors = n;
    }
    memcpy(fit->parent_sha256, model->sha256, sizeof fit->parent_sha256);
    (void)snprintf(fit->version, sizeof fit->version, "%s", BEAMFIT_VERSION);
}

/* "-" is standard output. */
static enum bf_status write_text(const char *path, const char *text, struct bf_error *err)
{
    if (strcmp(path, "-") == 0) {
        if (fputs(text, stdout) == EOF || fflush(stdout) != 0)
            return bf_fail(err, BF_BAD_FILE, "standard output cannot be written (%s)", strerror(errno));
        return BF_OK;
    }
    struct atomic_file out;
    enum bf_status status = atomic_open(path, &out, err);
    if (status != BF_OK)
        return status;
    outputs_mark(&out, "# ", "\n");
    (void)fputs(text, out.f);
    return atomic_commit(&out, err);
}

/* Takes out the mark of the file that the text was read from. */
static void remove_mark(char *text)
{
    char *to = text;
    for (const char *line = text; *line != '\0';) {
        const size_t n = strcspn(line, "\n"), n_line = line[n] != '\0' ? n + 1 : n;
        if (*line != '#' || !outputs_is_mark(line, n)) {
            memmove(to, line, n_line);
            to += n_line;
        }
        line += n_line;
    }
    *to = '\0';
}

/* The sum of the file as it stands now: with its mark, where it is a file. */
static void sum_of_written(const char *path, const char *text, char sha256[65])
{
    struct stat info;
    struct bf_error unread;
    if (strcmp(path, "-") == 0 || stat(path, &info) != 0 || !S_ISREG(info.st_mode) ||
        hash_file(path, sha256, &unread) != BF_OK)
        hash_sha256_hex(text, strlen(text), sha256);
}

enum bf_status model_write_text(struct model *model, char **text, struct bf_error *err)
{
    struct model_where where;
    if (model_check_where(model, &where, err) != BF_OK)
        return bf_fail(err, BF_NUMERIC, "the model is not valid: %s", err->text);
    extend_lineage(model);
    *text = model->document ? model_edit_text(model->document, strlen(model->document), model) : NULL;
    if (!*text) {
        if (model->document)
            bf_warn("the comments of %s are left out: it has a layout that cannot be edited in place",
                    model->path ? model->path : "its source");
        *text = model_to_text(model);
    }
    remove_mark(*text);
    return BF_OK;
}

enum bf_status model_write(const char *path, struct model *model, struct bf_error *err)
{
    char *text;
    struct bf_error why;
    if (model_write_text(model, &text, &why) != BF_OK)
        return bf_fail(err, BF_NUMERIC, "%s: not written, %s", path, why.text);
    enum bf_status status = write_text(path, text, err);
    if (status == BF_OK) {
        free(model->document);
        model->document = text;
        sum_of_written(path, text, model->sha256);
    } else {
        free(text);
    }
    return status;
}
