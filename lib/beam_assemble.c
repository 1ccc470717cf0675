/* SPDX-License-Identifier: MIT */
/* M = Σ ρ_r M_r, K = Σ EI_r K_r, C = γ G + Σ cDI_r K_r (paper eq. 5, 12), and what the effects in use add. */
#include "beam_modal.h"
#include "beam_tables.h"

typedef const beam_real (*band)[BEAM_N][BEAM_DEGREE + 1];

/* out += Σ_r factor_r · form_r */
static void add_form(band form, const beam_real factor[BEAM_REGIONS], beam_real out[BEAM_N][BEAM_N])
{
    for (int r = 0; r < BEAM_REGIONS; r++)
        for (int i = 0; i < BEAM_N; i++)
            for (int d = 0; d <= BEAM_DEGREE && i + d < BEAM_N; d++) {
                const beam_real value = factor[r] * form[r][i][d];
                out[i][i + d] += value;
                if (d > 0)
                    out[i + d][i] += value;
            }
}

static void add_outer(beam_real factor, const beam_real g[BEAM_N], beam_real out[BEAM_N][BEAM_N])
{
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            out[i][j] += factor * g[i] * g[j];
}

const struct beam_effect *beam_effect_find(const char *id)
{
    for (int e = 0; e < beam_effects_count; e++) {
        const char *name = beam_effects[e]->id;
        int i = 0;
        while (name[i] != 0 && name[i] == id[i])
            i++;
        if (name[i] == id[i])
            return beam_effects[e];
    }
    return 0;
}

static enum beam_status check_parameters(const struct beam_parameters *p)
{
    const beam_real all[9] = {p->EI_beam_Nm2,    p->EI_patch_Nm2, p->rho_beam_kgpm, p->rho_patch_kgpm, p->cDI_beam_sNm2,
                              p->cDI_patch_sNm2, p->gamma_sNpm2,  p->Ks_V,          p->KB_NmpV};
    for (int i = 0; i < 9; i++)
        if (!beam_finite(all[i]))
            return BEAM_ERROR_NOT_FINITE;
    for (int i = 0; i < 4; i++)
        if (!beam_less(BEAM_K(0.0), all[i]))
            return BEAM_ERROR_PARAMETER;
    for (int i = 4; i < 7; i++)
        if (beam_less(all[i], BEAM_K(0.0)))
            return BEAM_ERROR_PARAMETER;
    return BEAM_OK;
}

/* φ' at both ends of a span, subtracted. */
static enum beam_status slope_difference(enum beam_basis basis, beam_real from_m, beam_real to_m, beam_real out[BEAM_N])
{
    beam_real from[BEAM_N];
    enum beam_status status = beam_shape(basis, from_m, 1, from);
    if (status == BEAM_OK)
        status = beam_shape(basis, to_m, 1, out);
    for (int i = 0; i < BEAM_N && status == BEAM_OK; i++)
        out[i] -= from[i];
    return status;
}

static enum beam_status patch_vector(enum beam_basis basis, beam_real factor, beam_real out[BEAM_N])
{
    const enum beam_status status =
        slope_difference(basis, beam_geometry_table.patch_from_m, beam_geometry_table.patch_to_m, out);
    for (int i = 0; i < BEAM_N && status == BEAM_OK; i++)
        out[i] *= factor;
    return status;
}

static enum beam_status add_channels(const struct beam_description *d, struct beam_model *out)
{
    enum beam_status status = BEAM_OK;
    if (d->n_inputs < 0 || d->n_inputs > BEAM_INPUTS || d->n_outputs < 0 || d->n_outputs > BEAM_OUTPUTS)
        return BEAM_ERROR_ARGUMENT;
    out->n_inputs = d->n_inputs;
    out->n_outputs = d->n_outputs;
    for (int i = 0; i < d->n_inputs && status == BEAM_OK; i++) {
        out->input[i].kind = d->input[i].kind;
        status = d->input[i].kind == BEAM_INPUT_PATCH_MOMENT
                     ? patch_vector(d->basis, d->parameters.KB_NmpV, out->input[i].vector)
                     : beam_shape(d->basis, d->input[i].at_m, 0, out->input[i].vector);
    }
    for (int o = 0; o < d->n_outputs && status == BEAM_OK; o++) {
        out->output[o].kind = d->output[o].kind;
        status = d->output[o].kind == BEAM_OUTPUT_PATCH_STRAIN
                     ? patch_vector(d->basis, d->parameters.Ks_V, out->output[o].vector)
                     : beam_shape(d->basis, d->output[o].at_m, 0, out->output[o].vector);
    }
    return status;
}

/* weight(x) of each region. */
static void region_weights(const struct beam_parameters *p, enum beam_weight weight, beam_real out[BEAM_REGIONS])
{
    const beam_real value[][BEAM_REGIONS] = {
        [BEAM_WEIGHT_ONE] = {BEAM_K(1.0), BEAM_K(1.0)},
        [BEAM_WEIGHT_RHO] = {p->rho_beam_kgpm, p->rho_patch_kgpm},
        [BEAM_WEIGHT_EI] = {p->EI_beam_Nm2, p->EI_patch_Nm2},
        [BEAM_WEIGHT_CDI] = {p->cDI_beam_sNm2, p->cDI_patch_sNm2},
        [BEAM_WEIGHT_PATCH] = {BEAM_K(0.0), BEAM_K(1.0)},
        [BEAM_WEIGHT_TURNING] = {p->EI_beam_Nm2, p->EI_beam_Nm2 / p->rho_beam_kgpm * p->rho_patch_kgpm},
    };
    for (int r = 0; r < BEAM_REGIONS; r++)
        out[r] = value[weight][r];
}

/* The operator's bilinear form; BEAM_OVER_MODES: X = M Ψ ω Ψᵀ M of the model as it is. */
static enum beam_status operator_form(const struct beam_description *d, const struct beam_operator *place,
                                      const struct beam_model *model, beam_real form[BEAM_N][BEAM_N])
{
    beam_real g[BEAM_N], weight[BEAM_REGIONS];
    enum beam_status status = BEAM_OK;
    region_weights(&d->parameters, place->weight, weight);
    switch (place->kind) {
    case BEAM_OVER_DEFLECTION:
        add_form(beam_tables[d->basis].mass, weight, form);
        return BEAM_OK;
    case BEAM_OVER_SLOPE:
        add_form(beam_tables[d->basis].slope, weight, form);
        return BEAM_OK;
    case BEAM_OVER_CURVATURE:
        add_form(beam_tables[d->basis].curvature, weight, form);
        return BEAM_OK;
    case BEAM_AT_POINT:
        status = beam_shape(d->basis, place->at_m, 0, g);
        break;
    case BEAM_AT_SLOPE:
        status = beam_shape(d->basis, place->at_m, 1, g);
        break;
    case BEAM_AT_SLOPE_DIFFERENCE:
        status = slope_difference(d->basis, place->from_m, place->to_m, g);
        break;
    case BEAM_AT_PATCH:
        status = patch_vector(d->basis, BEAM_K(1.0), g);
        break;
    case BEAM_AT_NOTHING:
        return BEAM_OK;
    case BEAM_AT_ROOT:
    case BEAM_AT_OWN:
    case BEAM_AT_POINT_TO_OWN:
        return BEAM_ERROR_NEEDS_HOST;
    case BEAM_OVER_MODES: {
        struct beam_modes modes;
        status = beam_find_modes(model, &modes);
        for (int k = 0; k < BEAM_N && status == BEAM_OK; k++) {
            for (int i = 0; i < BEAM_N; i++) {
                g[i] = BEAM_K(0.0);
                for (int j = 0; j < BEAM_N; j++)
                    g[i] += model->M[i][j] * modes.shape[j][k];
            }
            add_outer(modes.omega_radps[k], g, form);
        }
        return status;
    }
    default:
        return BEAM_ERROR_ARGUMENT;
    }
    if (status == BEAM_OK)
        add_outer(BEAM_K(1.0), g, form);
    return status;
}

static int is_zero(const struct beam_coefficients *c)
{
    const beam_real none = BEAM_K(0.0);
    return !beam_less(none, beam_fabs(c->mass)) && !beam_less(none, beam_fabs(c->damping)) &&
           !beam_less(none, beam_fabs(c->stiffness)) && !beam_less(none, beam_fabs(c->memory));
}

static enum beam_status add_term(const struct beam_description *d, const struct beam_term *term,
                                 struct beam_model *model)
{
    beam_real form[BEAM_N][BEAM_N] = {{BEAM_K(0.0)}};
    const struct beam_coefficients *c = &term->value;
    if (is_zero(c))
        return BEAM_OK;
    const enum beam_status status = operator_form(d, &term->place, model, form);
    if (status != BEAM_OK)
        return status;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++) {
            model->M[i][j] += c->mass * form[i][j];
            model->C[i][j] += c->damping * form[i][j];
            model->K[i][j] += c->stiffness * form[i][j];
        }
    if (!beam_less(BEAM_K(0.0), beam_fabs(c->memory)))
        return BEAM_OK;
    if (model->n_memories == BEAM_MEMORIES)
        return BEAM_ERROR_CAPACITY;
    struct beam_memory *memory = &model->memory[model->n_memories++];
    memory->relaxation_s = c->relaxation_s;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            memory->form[i][j] = c->memory * form[i][j];
    return BEAM_OK;
}

/* Terms of one effect; those over the modes in a second pass, when M and K are complete. */
static enum beam_status add_terms(const struct beam_description *d, const struct beam_use *use,
                                  const struct beam_place *place, int over_modes, struct beam_model *model)
{
    struct beam_term terms[BEAM_EFFECT_TERMS] = {{.place = {.kind = BEAM_AT_NOTHING}}};
    enum beam_status status = BEAM_OK;
    if (!use->effect->terms)
        return BEAM_OK;
    if (use->effect->terms(use->p, place, terms) != 0)
        return BEAM_ERROR_EFFECT_RANGE;
    for (int t = 0; t < use->effect->n_terms && status == BEAM_OK; t++)
        if ((terms[t].place.kind == BEAM_OVER_MODES) == over_modes)
            status = add_term(d, &terms[t], model);
    return status;
}

static enum beam_status add_port(int use, int coordinate, beam_real weight, const beam_real vector[BEAM_N],
                                 struct beam_model *model)
{
    if (model->n_ports == BEAM_PORTS)
        return BEAM_ERROR_CAPACITY;
    struct beam_port *port = &model->port[model->n_ports++];
    port->use = use;
    port->coordinate = coordinate;
    port->weight = weight;
    for (int i = 0; i < BEAM_N; i++)
        port->vector[i] = vector[i];
    return BEAM_OK;
}

/* Quadrature points of a law over the span. */
static enum beam_status add_span_ports(const struct beam_description *d, const struct beam_law_place *place, int use,
                                       struct beam_model *model)
{
    const struct beam_span *span = &beam_geometry_table;
    beam_real weight[BEAM_REGIONS], vector[BEAM_N];
    enum beam_status status = BEAM_OK;
    region_weights(&d->parameters, place->weight, weight);
    for (int q = 0; q < BEAM_SPAN_POINTS && status == BEAM_OK; q++) {
        const beam_real w = span->span_weight_m[q] * weight[span->span_region[q]];
        const int both = place->points == BEAM_LAW_OVER_SLOPE_AND_CURVATURE;
        const int derivative = place->points == BEAM_LAW_OVER_DEFLECTION ? 0 : both ? 1 : 2;
        status = beam_shape(d->basis, span->span_at_m[q], derivative, vector);
        if (status == BEAM_OK)
            status = add_port(use, 0, w, vector, model);
        if (status == BEAM_OK && both)
            status = beam_shape(d->basis, span->span_at_m[q], 2, vector);
        if (status == BEAM_OK && both)
            status = add_port(use, 1, w, vector, model);
    }
    return status;
}

static enum beam_status add_ports(const struct beam_description *d, const struct beam_place *beam, int use,
                                  struct beam_model *model)
{
    struct beam_law_place place = {.points = BEAM_LAW_NONE};
    const beam_real one = BEAM_K(1.0);
    beam_real vector[BEAM_N];
    enum beam_status status = BEAM_OK;
    if (!d->use[use].effect->law)
        return BEAM_OK;
    if (d->use[use].effect->law_place(d->use[use].p, beam, &place) != 0)
        return BEAM_ERROR_EFFECT_RANGE;
    switch (place.points) {
    case BEAM_LAW_NONE:
        return BEAM_OK;
    case BEAM_LAW_AT_POINT:
        status = beam_shape(d->basis, place.at_m, 0, vector);
        break;
    case BEAM_LAW_AT_PATCH:
        status = patch_vector(d->basis, one, vector);
        break;
    case BEAM_LAW_AT_SPAN:
        status = slope_difference(d->basis, place.at_m - BEAM_K(0.5) * place.width_m,
                                  place.at_m + BEAM_K(0.5) * place.width_m, vector);
        break;
    default:
        return add_span_ports(d, &place, use, model);
    }
    return status == BEAM_OK ? add_port(use, 0, one, vector, model) : status;
}

/* Finite, inside the catalogue's range (positions: shares of the length), and possible in this space. */
static enum beam_status check_use(const struct beam_use *use, beam_real length_m)
{
    const struct beam_effect *effect = use->effect;
    if (!effect)
        return BEAM_ERROR_EFFECT;
    if (effect->releases_root || effect->geometry)
        return BEAM_ERROR_NEEDS_HOST;
    for (int i = 0; i < effect->n_parameters; i++) {
        const struct beam_parameter_info *info = &effect->parameters[i];
        const beam_real unit = info->role == BEAM_ROLE_PLACE ? length_m : BEAM_K(1.0);
        const beam_real slack = BEAM_K(8.0) * BEAM_EPSILON;
        const beam_real least = (beam_real)info->minimum * unit, most = (beam_real)info->maximum * unit;
        if (beam_less(use->p[i], least - slack * beam_fabs(least)) ||
            beam_less(most + slack * beam_fabs(most), use->p[i]) || use->p[i] != use->p[i])
            return BEAM_ERROR_EFFECT_RANGE;
    }
    return BEAM_OK;
}

static enum beam_status add_effects(const struct beam_description *d, struct beam_model *out)
{
    const struct beam_span *span = &beam_geometry_table;
    const struct beam_place place = {span->length_m, span->patch_from_m, span->patch_to_m};
    enum beam_status status = BEAM_OK;
    if (d->n_uses < 0 || d->n_uses > BEAM_USES)
        return BEAM_ERROR_ARGUMENT;
    out->n_uses = d->n_uses;
    for (int u = 0; u < d->n_uses && status == BEAM_OK; u++) {
        out->use[u] = d->use[u];
        status = check_use(&d->use[u], span->length_m);
        if (status == BEAM_OK)
            status = add_terms(d, &d->use[u], &place, 0, out);
        if (status == BEAM_OK)
            status = add_ports(d, &place, u, out);
    }
    for (int u = 0; u < d->n_uses && status == BEAM_OK; u++)
        status = add_terms(d, &d->use[u], &place, 1, out);
    return status;
}

enum beam_status beam_assemble(const struct beam_description *description, struct beam_model *out)
{
    const struct beam_parameters *p = &description->parameters;
    const enum beam_basis basis = description->basis;
    if (basis != BEAM_BASIS_UNIFORM && basis != BEAM_BASIS_PATCH)
        return BEAM_ERROR_ARGUMENT;
    enum beam_status status = check_parameters(p);
    if (status != BEAM_OK)
        return status;
    const struct beam_table *table = &beam_tables[basis];
    const beam_real rho[] = {p->rho_beam_kgpm, p->rho_patch_kgpm}, EI[] = {p->EI_beam_Nm2, p->EI_patch_Nm2};
    const beam_real cDI[] = {p->cDI_beam_sNm2, p->cDI_patch_sNm2}, gamma[] = {p->gamma_sNpm2, p->gamma_sNpm2};
    *out = (struct beam_model){.n_inputs = 0};
    add_form(table->mass, rho, out->M);
    add_form(table->curvature, EI, out->K);
    add_form(table->curvature, cDI, out->C);
    add_form(table->mass, gamma, out->C);
    for (int r = 0; r < BEAM_REGIONS; r++)
        for (int i = 0; i < BEAM_N; i++)
            out->base_load[i] -= rho[r] * table->load[r][i];
    status = add_channels(description, out);
    return status == BEAM_OK ? add_effects(description, out) : status;
}
