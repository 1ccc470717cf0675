/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_read.c — tree to model: the whole, beam, regions, parameters. */
#include "model_parts.h"
#include "model_check.h"
#include "model_yaml.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* ---- Regions ---- */

static enum bf_status region_name(const struct yaml_reader *r, const struct yaml_node *node, char name[MODEL_NAME])
{
    enum bf_status status = yaml_name(r, node, "a region's name", 33, name);
    for (const char *c = name; status == BF_OK && *c; c++)
        if (!(*c == '_' || (*c >= '0' && *c <= '9') || (*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z')))
            return yaml_fail(r, node, "region name '%s' cannot be part of EI_NAME_Nm2; use letters, digits and _ only",
                             name);
    return status;
}

static void add_region(struct model *m, const char *name, double from_m, double to_m)
{
    m->regions = bf_grow(m->regions, m->n_regions + 1, sizeof *m->regions);
    struct region *region = &m->regions[m->n_regions++];
    *region = (struct region){.from_m = from_m, .to_m = to_m};
    (void)snprintf(region->name, sizeof region->name, "%s", name);
}

static enum bf_status read_region(const struct yaml_reader *r, const struct yaml_node *node)
{
    static const char *const known[] = {"name", "from_m", "to_m"};
    enum bf_status status = yaml_expect(r, node, YAML_MAPPING, "a region");
    if (status == BF_OK)
        status = yaml_known_keys(r, node, "a region", known, 3);
    if (status != BF_OK)
        return status;
    const struct yaml_node *name = yaml_get(node, "name", NULL), *from = yaml_get(node, "from_m", NULL);
    const struct yaml_node *to = yaml_get(node, "to_m", NULL);
    if (!name || !from || !to)
        return yaml_fail(r, node,
                         "a region has name, from_m and to_m; write e.g. {name: patch, from_m: 0.02, to_m: 0.09}");
    char text[MODEL_NAME];
    double from_m = 0.0, to_m = 0.0;
    if ((status = region_name(r, name, text)) != BF_OK || (status = yaml_number(r, from, "from_m", &from_m)) != BF_OK ||
        (status = yaml_number(r, to, "to_m", &to_m)) != BF_OK)
        return status;
    double length = r->model->length_m;
    if (!(to_m > from_m))
        return yaml_fail(r, node, "region '%s' from %g to %g m is empty; from_m must be smaller than to_m", text,
                         from_m, to_m);
    char advice[PLACE_ADVICE];
    model_place_advice(to_m, length, advice);
    if (from_m < 0.0 || to_m > length)
        return yaml_fail(r, node, "region '%s' from %g to %g m lies outside the beam (0 … %g m); %s", text, from_m,
                         to_m, length, advice);
    for (size_t i = 0; i < r->model->n_regions; i++) {
        const struct region *other = &r->model->regions[i];
        if (from_m < other->to_m && other->from_m < to_m)
            return yaml_fail(r, node, "region '%s' from %g to %g m overlaps region '%s' from %g to %g m; let them meet",
                             text, from_m, to_m, other->name, other->from_m, other->to_m);
    }
    add_region(r->model, text, from_m, to_m);
    return BF_OK;
}

static int by_place(const void *a, const void *b)
{
    const struct region *p = a, *q = b;
    return p->from_m < q->from_m ? -1 : p->from_m > q->from_m;
}

/* What no region covers is region 'beam'. */
static void fill_gaps(struct model *m)
{
    size_t n = m->n_regions;
    double edge = 0.0;
    if (n > 0)
        qsort(m->regions, n, sizeof *m->regions, by_place);
    for (size_t i = 0; i < n; i++) {
        double from = m->regions[i].from_m, to = m->regions[i].to_m;
        if (from > edge)
            add_region(m, "beam", edge, from);
        edge = to;
    }
    if (edge < m->length_m)
        add_region(m, "beam", edge, m->length_m);
    qsort(m->regions, m->n_regions, sizeof *m->regions, by_place);
}

static enum bf_status read_regions(const struct yaml_reader *r, const struct yaml_node *beam)
{
    const struct yaml_node *patch = yaml_get(beam, "patch_m", NULL), *list = yaml_get(beam, "regions", NULL);
    enum bf_status status = BF_OK;
    if (patch && list)
        return yaml_fail(r, patch, "patch_m and regions together; write the patch as one of the regions");
    if (patch) {
        double from_m = 0.0, to_m = 0.0;
        status = yaml_read_patch(r, patch, &from_m, &to_m);
        if (status != BF_OK)
            return status;
        add_region(r->model, "patch", from_m, to_m);
    }
    if (list && !yaml_is_nothing(list)) {
        status = yaml_expect(r, list, YAML_SEQUENCE, "regions");
        if (status == BF_OK && list->n > 256)
            return yaml_fail(r, list, "more than 256 regions; merge some");
        for (size_t i = 0; status == BF_OK && i < list->n; i++)
            status = read_region(r, list->value[i]);
    }
    if (status == BF_OK)
        fill_gaps(r->model);
    return status;
}

static enum bf_status read_support(const struct yaml_reader *r, const struct yaml_node *node)
{
    const char *known[SUPPORT_FREE_FREE + 1];
    size_t n = 0;
    for (; n <= SUPPORT_FREE_FREE; n++) {
        known[n] = model_support_name((enum model_support)n);
        if (node->kind == YAML_SCALAR && strcmp(node->text, known[n]) == 0) {
            r->model->support = (enum model_support)n;
            return BF_OK;
        }
    }
    const char *closest = node->kind == YAML_SCALAR ? text_closest(node->text, known, n) : NULL;
    return yaml_fail(r, node, "unknown support; write clamped-free, clamped-clamped, pinned-pinned or free-free%s%s%s",
                     closest ? "; did you mean '" : "", closest ? closest : "", closest ? "'?" : "");
}

static enum bf_status read_beam(const struct yaml_reader *r, const struct yaml_node *beam)
{
    static const char *const known[] = {"length_m", "support", "patch_m", "regions"};
    enum bf_status status = yaml_expect(r, beam, YAML_MAPPING, "beam");
    if (status == BF_OK)
        status = yaml_known_keys(r, beam, "beam", known, 4);
    if (status != BF_OK)
        return status;
    const struct yaml_node *length = yaml_get(beam, "length_m", NULL), *support = yaml_get(beam, "support", NULL);
    if (!length)
        return yaml_fail(r, beam, "beam has no length_m; add the free length in metres");
    if ((status = yaml_read_length(r, length)) != BF_OK)
        return status;
    if (!(r->model->length_m > 0.0 && isfinite(r->model->length_m)))
        return yaml_fail(r, length, "length_m is %g; the free length in metres must be above 0", r->model->length_m);
    if (support && (status = read_support(r, support)) != BF_OK)
        return status;
    return read_regions(r, beam);
}

/* ---- Parameters ---- */

static void make_materials(struct model *m)
{
    for (size_t i = 0; i < m->n_regions; i++) {
        const char *name = m->regions[i].name;
        if (model_material(m, name))
            continue;
        m->materials = bf_grow(m->materials, m->n_materials + 1, sizeof *m->materials);
        struct material *material = &m->materials[m->n_materials++];
        char text[MODEL_NAME];
        (void)snprintf(material->name, sizeof material->name, "%s", name);
        (void)snprintf(text, sizeof text, "EI_%.32s_Nm2", name);
        model_parameter_init(&material->EI, text, "N·m²", false);
        (void)snprintf(text, sizeof text, "rho_%.32s_kgpm", name);
        model_parameter_init(&material->rho, text, "kg/m", false);
        (void)snprintf(text, sizeof text, "cDI_%.32s_sNm2", name);
        model_parameter_init(&material->cDI, text, "N·m²·s", false);
        material->cDI.fixed = true;
    }
    model_parameter_init(&m->gamma, "gamma_sNpm2", "N·s/m²", false);
    model_parameter_init(&m->Ks, "Ks_V", "V", true);
    model_parameter_init(&m->KB, "KB_NmpV", "N·m/V", true);
    m->gamma.fixed = m->Ks.fixed = m->KB.fixed = true;
}

static enum bf_status read_one(const struct yaml_reader *r, const struct yaml_node *parameters, struct parameter *p)
{
    const struct yaml_node *node = yaml_get(parameters, p->name, NULL);
    if (!node)
        return BF_OK; /* fixed at 0 */
    p->fixed = false;
    enum bf_status status = yaml_parameter(r, node, false, p);
    p->logarithmic = p->value > 0.0 && (p->min >= 0.0 || isinf(p->min));
    return status;
}

/* EI and rho of every region; cDI of all regions or of none (then the beam has no internal damping). */
static enum bf_status check_complete(const struct yaml_reader *r, const struct yaml_node *parameters)
{
    char missing[600] = "";
    const char *first = NULL;
    size_t n = 0, n_materials = r->model->n_materials;
    bool damped = false;
    for (size_t i = 0; i < n_materials; i++)
        damped = damped || yaml_get(parameters, r->model->materials[i].cDI.name, NULL);
    for (size_t i = 0; i < n_materials; i++) {
        const struct material *material = &r->model->materials[i];
        const struct parameter *const needed[] = {&material->EI, &material->rho, &material->cDI};
        for (size_t j = 0; j < (damped ? 3 : 2); j++) {
            if (yaml_get(parameters, needed[j]->name, NULL) || n > sizeof missing - 2 * MODEL_NAME)
                continue;
            n += (size_t)snprintf(missing + n, sizeof missing - n, "%s%s", n ? ", " : "", needed[j]->name);
            first = first ? first : needed[j]->name;
        }
    }
    if (!first)
        return BF_OK;
    return yaml_fail(r, parameters,
                     "parameters lacks %s (every region has its EI, rho and cDI); add `%s: {value: NUMBER}`", missing,
                     first);
}

static enum bf_status read_parameters(const struct yaml_reader *r, const struct yaml_node *parameters)
{
    struct model *m = r->model;
    enum bf_status status = yaml_expect(r, parameters, YAML_MAPPING, "parameters");
    if (status != BF_OK)
        return status;
    const char **known = bf_alloc(3 * m->n_materials + 3 + m->n_residuals, sizeof *known);
    size_t n = 0;
    for (size_t i = 0; i < m->n_materials; i++) {
        known[n++] = m->materials[i].EI.name;
        known[n++] = m->materials[i].rho.name;
        known[n++] = m->materials[i].cDI.name;
    }
    known[n++] = m->gamma.name;
    known[n++] = m->Ks.name;
    known[n++] = m->KB.name;
    for (size_t i = 0; i < m->n_residuals; i++)
        known[n++] = m->residuals[i].compliance.name;
    status = yaml_known_keys(r, parameters, "parameters (one EI, rho, cDI per region)", known, n);
    free(known);
    if (status == BF_OK)
        status = check_complete(r, parameters);
    for (size_t i = 0; i < m->n_materials && status == BF_OK; i++) {
        struct material *material = &m->materials[i];
        if ((status = read_one(r, parameters, &material->EI)) == BF_OK &&
            (status = read_one(r, parameters, &material->rho)) == BF_OK)
            status = read_one(r, parameters, &material->cDI);
    }
    if (status == BF_OK)
        status = read_one(r, parameters, &m->gamma);
    if (status == BF_OK)
        status = read_one(r, parameters, &m->Ks);
    if (status == BF_OK)
        status = read_one(r, parameters, &m->KB);
    for (size_t i = 0; i < m->n_residuals && status == BF_OK; i++) {
        status = read_one(r, parameters, &m->residuals[i].compliance);
        m->residuals[i].compliance.logarithmic = false; /* either sign */
    }
    return status;
}

/* ---- The whole ---- */

static enum bf_status check_format(const struct yaml_reader *r, const struct yaml_node *root)
{
    const struct yaml_node *format = yaml_get(root, "format", NULL);
    if (!format)
        return yaml_fail(r, root, "no `format: beamfit-model/1`; add it if this is a model file");
    if (format->kind == YAML_SCALAR && strcmp(format->text, "beamfit-model/1") == 0)
        return BF_OK;
    return yaml_fail(r, format, "format is '%.40s'; this program reads beamfit-model/1",
                     format->kind == YAML_SCALAR ? format->text : "not a word");
}

static enum bf_status read_steps(const struct yaml_reader *r, const struct yaml_node *node)
{
    double steps = 0.0;
    if (!node)
        return BF_OK;
    const enum bf_status status = yaml_number(r, node, "steps_per_sample", &steps);
    if (status == BF_OK && !(steps >= 1.0 && steps <= MODEL_STEPS_MOST && steps == floor(steps)))
        return yaml_fail(r, node, "steps_per_sample is %g; write a whole number from 1 to %d, or take the line out",
                         steps, MODEL_STEPS_MOST);
    r->model->steps_per_sample = (int)steps;
    return status;
}

/* Line of the deepest node on the way to where. */
static long line_of(const struct yaml_node *root, const struct model_where *where)
{
    const struct yaml_node *key = NULL;
    const struct yaml_node *node = where->section ? yaml_get(root, where->section, &key) : NULL;
    const struct yaml_node *found = key;
    if (node && node->kind == YAML_SEQUENCE && where->index < node->n)
        found = node = node->value[where->index];
    else if (node && where->item && (node = yaml_get(node, where->item, &key)))
        found = key;
    if (node && where->key && yaml_get(node, where->key, &key))
        found = key;
    return found ? found->line : 0;
}

enum bf_status model_from_yaml(const char *path, const struct yaml_node *root, struct model *model,
                               struct bf_error *err)
{
    static const char *const known[] = {"format",  "beam",  "parameters", "inputs", "outputs",
                                        "effects", "board", "fit",        "notes",  "steps_per_sample"};
    const struct yaml_reader r = {path, err, model};
    enum bf_status status;
    if (root->kind != YAML_MAPPING)
        return yaml_fail(&r, root, "not a model file; `beamfit init` writes one to start from");
    if ((status = check_format(&r, root)) != BF_OK ||
        (status = yaml_known_keys(&r, root, "the file", known, sizeof known / sizeof *known)) != BF_OK)
        return status;
    const struct yaml_node *beam = yaml_get(root, "beam", NULL), *parameters = yaml_get(root, "parameters", NULL);
    if (!beam)
        return yaml_fail(&r, root, "no `beam:`; `beamfit init` writes a complete model to copy from");
    if ((status = read_beam(&r, beam)) != BF_OK)
        return status;
    if (!parameters)
        return yaml_fail(&r, root, "no `parameters:`; `beamfit init` writes a complete model to copy from");
    make_materials(model);
    if ((status = yaml_read_inputs(&r, yaml_get(root, "inputs", NULL))) != BF_OK ||
        (status = yaml_read_outputs(&r, yaml_get(root, "outputs", NULL))) != BF_OK)
        return status;
    model_make_residuals(model); /* one for each pair of channels: their names are parameters */
    if ((status = read_parameters(&r, parameters)) != BF_OK ||
        (status = yaml_read_effects(&r, yaml_get(root, "effects", NULL))) != BF_OK ||
        (status = read_steps(&r, yaml_get(root, "steps_per_sample", NULL))) != BF_OK ||
        (status = yaml_read_board(&r, yaml_get(root, "board", NULL))) != BF_OK ||
        (status = yaml_read_fit(&r, yaml_get(root, "fit", NULL))) != BF_OK)
        return status;
    struct model_where where = {0};
    if (model_check_where(model, &where, err) != BF_OK)
        return bf_fail_at(err, path, line_of(root, &where), "%s", err->text);
    return BF_OK;
}
