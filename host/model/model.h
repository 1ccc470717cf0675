/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * model.h — what is believed about a beam, as a struct and as a file.
 *
 *     model_read()             the file, checked
 *     model_append_effect()    changes; model_check() afterwards says whether they fit the rest
 *     model_parameters()       the parameters as one vector; model_set_parameters() writes it back
 *     model_write()            the same file with what changed, comments kept
 *     model_free()
 *     starting_model_text()    a first file, from a ruler and a handbook
 */
#ifndef BEAMFIT_MODEL_H
#define BEAMFIT_MODEL_H

#include <stdbool.h>

#include "beam_effect.h"
#include "ground/ground.h"

/*
 * MODEL — geometry, parameters, channels, effects. Plain data; no numerics. The YAML form is beamfit-model/1
 * (docs/model_file.md); only model_*.c know it.
 */

enum { MODEL_NAME = 64, MODEL_STEPS_MOST = 64 };

enum model_support { SUPPORT_CLAMPED_FREE, SUPPORT_CLAMPED_CLAMPED, SUPPORT_PINNED_PINNED, SUPPORT_FREE_FREE };

/* One unknown or known number. */
struct parameter {
    char name[MODEL_NAME]; /* "EI_beam_Nm2"; an effect's parameter has its catalogue name */
    char unit[24];
    double value;
    double prior;       /* relative standard deviation of a prior around prior_value; 0: no prior */
    double prior_value; /* the value the file gave when the prior was stated; kept through fits */
    double start;       /* the value before the first fit, kept through fits; 0: not known */
    double sd;          /* one standard error of the last fit; 0: none */
    double min, max;    /* bounds, −INFINITY/INFINITY when absent */
    bool fixed;
    bool logarithmic; /* positive: estimated as its logarithm */
};

/* A named piece of the span. Several pieces may share a name, and then share EI, ρ and cDI. */
struct region {
    char name[MODEL_NAME];
    double from_m, to_m;
};

/* EI, ρ, cDI of one region name. */
struct material {
    char name[MODEL_NAME]; /* region name */
    struct parameter EI, rho, cDI;
};

enum input_kind { INPUT_POINT_FORCE, INPUT_PATCH_MOMENT };
enum output_kind { OUTPUT_DISPLACEMENT, OUTPUT_VELOCITY, OUTPUT_ACCELERATION, OUTPUT_PATCH_STRAIN };

/*
 * Where a point force or a point sensor is and what its column's numbers are worth, as parameters: held at what the file says unless it frees
 * them, with a prior or without. Beam = gain × column for an input, column = gain × beam for an output; those of a patch are KB and Ks.
 */
struct channel_parameters {
    struct parameter at; /* "at_m"; its value stands in at_m of the channel too, which is the one to read */
    struct parameter gain;
    bool lists_at, lists_gain; /* among model_parameters(): the file writes {value: …} */
};

/* The free length and the edges of the patch as parameters; their values stand in length_m and in the regions too, which are the ones to read. */
struct geometry_parameters {
    struct parameter length, from, to; /* "length_m", "patch_from_m", "patch_to_m" */
    bool lists_length, lists_from, lists_to;
};

struct model_input {
    char name[MODEL_NAME]; /* column of the record */
    enum input_kind kind;
    double at_m; /* INPUT_POINT_FORCE */
    struct channel_parameters own;
    double from_m, to_m;   /* INPUT_PATCH_MOMENT: the patch (default: region 'patch') */
    bool level_per_record; /* `level: per_record`: an unknown factor for each record */
};

struct model_output {
    char name[MODEL_NAME];
    enum output_kind kind;
    double at_m;    /* all but OUTPUT_PATCH_STRAIN */
    double mass_kg; /* of the sensor, which the beam carries at at_m; 0: none is stated. Held */
    struct channel_parameters own;
    double from_m, to_m; /* OUTPUT_PATCH_STRAIN: the patch (default: region 'patch') */
};

/* Where a point channel was in one record (`at_m: {value: …, per_record: {FILE: 0.12}}`): held there, whatever the channel's own place is. */
struct stated_place {
    char channel[MODEL_NAME];
    char record[256]; /* base name of the record's file */
    double at_m;
};

/* A parameter's value in one record (effect_per_record()). */
struct per_record_value {
    char record[256]; /* base name of the record's file */
    int parameter;    /* index into parameters[] */
    double value, sd;
};

/*
 * A direct quasi-static path from an input to an output near it: y += c · input (displacement; its derivatives for
 * velocity and acceleration). What the modes above the model and local deformation do there (the 'upper residual' of
 * modal testing, Ewins, Modal Testing); parameter "residual_<output>_<input>" (m/N, m/V, V/N …), free, 0 to begin with.
 * Every acceleration output has one for each input, every patch_strain output one for each point force.
 */
struct model_residual {
    size_t output, input;
    struct parameter compliance;
};

/* An effect in use. */
struct model_effect {
    const struct beam_effect *effect;
    struct parameter parameters[BEAM_EFFECT_PARAMETERS];
    char channel[MODEL_NAME]; /* the channel a measurement-chain effect sits on; "" = the effect's default channels */
    bool
        by_record[BEAM_EFFECT_PARAMETERS]; /* the file says that it differs from record to record (`per_record: {…}`) */
    size_t n_per_record;
    struct per_record_value *per_record;
};

/* What the last fit left behind (the file's `fit:` block). */
struct fit_channel {
    char name[MODEL_NAME];
    double nrmse, noise_ratio;
    double noise_rms; /* of the channel's noise, in its unit; 0: not known */
};
struct fit_record {
    char *file;
    char sha256[65];
    bool held_out; /* a --check record: compared, never fitted */
    size_t n_channels;
    struct fit_channel *channels;
};
struct fit_info {
    bool present;
    char parent_sha256[65]; /* of the model file this one was made from; "" none. Set by model_write() */
    size_t n_ancestors;     /* parents of the parent, nearest first: a history may skip files that are gone */
    char (*ancestors)[65];
    char version[32];                                          /* of the program */
    double nrmse, noise_ratio, check_nrmse, check_noise_ratio; /* 0: none */
    bool converged;
    size_t n_records;
    struct fit_record *records;
};

/*
 * What a controller that runs the model is wired to (the file's `board:` block): one output of the model at its A/D, one
 * input at its D/A, value [channel's unit] = (code − zero_code) × per_code. 0 and "" stand for what is not said.
 */
struct model_board {
    bool present;
    double sample_Hz;
    double core_MHz;                            /* clock of the processor */
    char sensor[MODEL_NAME], drive[MODEL_NAME]; /* names of the output and the input */
    double sensor_per_code, sensor_zero_code, drive_per_code, drive_zero_code;
    double noise_rms; /* expected residual, sensor's unit */
    double alarm_ratio, clear_ratio, averaging_s;
    double quiet_ratio, offset_ratio; /* of the sensor's health: share of the noise, multiple of it */
};

struct model {
    char *path;      /* as read; NULL when made in memory */
    char sha256[65]; /* of the file */
    double length_m;
    struct geometry_parameters own;
    enum model_support support;
    size_t n_regions; /* in order of x, covering [0, length] without gap or overlap */
    struct region *regions;
    size_t n_materials;
    struct material *materials;
    struct parameter gamma, Ks, KB; /* N·s/m², V, N·m/V; a parameter that the file lacks is fixed at 0 */
    size_t n_inputs;
    struct model_input *inputs;
    size_t n_outputs;
    struct model_output *outputs;
    size_t n_stated;
    struct stated_place *stated;
    size_t n_residuals; /* in order of outputs, then inputs */
    struct model_residual *residuals;
    size_t n_effects;
    struct model_effect *effects;
    int steps_per_sample; /* of a law's step through time, 1 … MODEL_STEPS_MOST; 0: as many as the laws usually need */
    struct fit_info fit;
    struct model_board board;
    void *document; /* owned: the file's text with comments, for saving (model_file.c) */
};

/* FILE — reading, writing, copying, checking. */

/* As the file spells them; NULL outside the enumeration. */
const char *model_support_name(enum model_support support);
const char *model_input_kind_name(enum input_kind kind);
const char *model_output_kind_name(enum output_kind kind);

/*
 * BF_BAD_FILE: "file:line: …" not readable, not YAML, a key that is not known, a fault that model_check() finds. *out is empty then and
 * needs no free. Prints the unit warnings.
 */
enum bf_status model_read(const char *path, struct model *out, struct bf_error *err);

/* The same from memory, without warnings; `name` stands for the file in messages. */
enum bf_status model_read_text(const char *name, const char *text, size_t n, struct model *out, struct bf_error *err);

/*
 * Keeps comments, order and unknown keys of the document the model was read from; written as an ATOMIC FILE (ground.h),
 * "-" is standard output. The fit block gets the parent's digest. BF_NUMERIC when the model has a fault, BF_BAD_FILE.
 */
enum bf_status model_write(const char *path, struct model *model, struct bf_error *err);

/* The text that model_write() would write, without its mark; the caller frees *text. BF_NUMERIC: the model has a fault. */
enum bf_status model_write_text(struct model *model, char **text, struct bf_error *err);
enum bf_status model_copy(const struct model *from, struct model *out, struct bf_error *err);
void model_free(struct model *model);

/* Checks everything that can be checked without data: ranges, places, names. */
enum bf_status model_check(const struct model *model, struct bf_error *err);

/*
 * Values that look wrong by a unit (mm, N·mm², g/m, …), one sentence each, at most `room`; returns how many.
 * model_read() prints them as warnings.
 */
typedef char model_warning[320];
size_t model_unit_warnings(const struct model *model, model_warning text[], size_t room);

/* PLACES — what the model has at a place of the span. */

/* What a channel's numbers are worth: KB or Ks of a patch, else the channel's gain, 1 when none is stated. */
double model_input_gain(const struct model *model, size_t input);
double model_output_gain(const struct model *model, size_t output);

/* First patch of the model: the region(s) named "patch", else the first patch channel; false when there is none. */
bool model_patch(const struct model *model, double *from_m, double *to_m);
const struct material *model_material(const struct model *model, const char *region);
/* Of all regions, kg; what an effect adds is not counted. */
double model_mass_kg(const struct model *model);
size_t model_plain_material(const struct model *model); /* 'beam', or the first that is not 'patch' */

/* weight(x) of a form over a region of this material. */
double model_weight(const struct model *model, const struct material *material, enum beam_weight weight);
struct beam_place model_place(const struct model *model);
/* The last place an effect can have, m: the end of the beam, or 1 % of the length before it when the length is a parameter, which moves the end. */
double model_last_place_m(const struct model *model);

/*
 * GEOMETRY — the beam with its patch elsewhere, of another length. Metres that are added to what the model says: a shift of the whole patch, the
 * free length, each edge of the patch. Point channels that are held at the free end stay there; all other places keep their distance from the clamp.
 */
enum model_move { MOVE_SHIFT, MOVE_LENGTH, MOVE_FROM, MOVE_TO, MODEL_MOVES };

/*
 * Patch regions and patch channels of `fixed` moved; *out is a copy of it whose places are overwritten. BF_BAD_FILE: a patch is to move, and there
 * is none. BF_NUMERIC: a region would vanish, the patch would leave the beam, or a point channel would.
 */
enum bf_status model_move(const struct model *fixed, const double by_m[MODEL_MOVES], struct model *out,
                          struct bf_error *err);

/* EFFECTS — of the catalogue, in a model. */

const struct beam_effect *effect_by_id(const char *id); /* NULL when unknown */

/* The parameter has a value of its own in each record: always (a phase), or because the file says so. */
bool effect_per_record(const struct model_effect *effect, int slot);
/* The value in a record that has one; NULL: it has none. */
const struct per_record_value *effect_record_value(const struct model_effect *effect, int slot, const char *record);
/* Sets that value. record: as long as a name of per_record_value may be, or it is cut there. sd 0: not known. */
void effect_set_record_value(struct model_effect *effect, int slot, const char *record, double value, double sd);

/* The same with a message that proposes the closest id; BF_USAGE when NULL. */
const struct beam_effect *effect_find(const char *id, struct bf_error *err);

/*
 * Adds an effect with the start values of the catalogue. channel "": the effect's default channels. The result is not
 * checked: set the effect's values, then call model_check(). BF_USAGE: no such effect. The last fit is forgotten.
 */
enum bf_status model_append_effect(struct model *model, const char *id, const char *channel, struct bf_error *err);

/* Adds a copy of another model's effect, with its values. The result is not checked; the last fit is forgotten. */
void model_take_effect(struct model *model, const struct model_effect *effect);
/* Where a channel is, or what its numbers are worth, becomes a free parameter with a prior of sd_m (m) or relative_sd (of its value) around at_m > 0 or the present gain. */
void model_channel_open_place(struct channel_parameters *own, double at_m, double sd_m);
void model_channel_open_gain(struct channel_parameters *own, double relative_sd);

/* Every use of it. BF_USAGE: the model has none. */
enum bf_status model_drop_effect(struct model *model, const char *id, struct bf_error *err);

/* A parameter of an added effect is held in fits until it is freed. */
bool effect_parameter_is_held(const struct beam_parameter_info *info);
/* The model has this effect, whatever it acts on. */
bool model_has_effect(const struct model *model, const struct beam_effect *effect);
/* The beam is clamped at x = 0. */
bool model_is_clamped(const struct model *model);
/* Some effect of the model is a law, so that its prediction steps through time. */
bool model_has_law(const struct model *model);
/* Some effect is a law, or bends a drive or a sensor's line: what comes of it felt the input before the recorder's filter. */
bool model_bends(const struct model *model);

/*
 * PARAMETERS — as one vector: materials (EI, rho, cDI of each, in order), gamma, Ks, KB, residuals, channels', the beam's geometry, each effect's.
 * A per-record parameter appears once per record name. Order is stable for a given model and list of records.
 */
enum parameter_role {
    ROLE_EI,
    ROLE_RHO,
    ROLE_CDI,
    ROLE_GAMMA,
    ROLE_KS,
    ROLE_KB,
    ROLE_RESIDUAL,
    ROLE_INPUT_PLACE, /* places and gains of channels are parameters only where the model frees them */
    ROLE_INPUT_GAIN,
    ROLE_OUTPUT_PLACE,
    ROLE_OUTPUT_GAIN,
    ROLE_LENGTH, /* likewise */
    ROLE_PATCH_FROM,
    ROLE_PATCH_TO,
    ROLE_EFFECT
};
struct parameter_ref {
    enum parameter_role role;
    size_t owner;                 /* material, residual, channel or effect index */
    int slot;                     /* parameter index inside the effect */
    int record;                   /* index into the record list for a per-record parameter, else −1 */
    char label[MODEL_NAME + 64];  /* unique for people and JSON: the bare name where unique, "effect.name" where not,
                                    "name@record" for a per-record one */
    const struct parameter *info; /* name, unit, bounds, prior, fixed; its value is overridden for per-record ones */
    double value;
};

/* Caller frees *out with free(). */
size_t model_parameters(const struct model *model, const char *const record_names[], size_t n_records,
                        struct parameter_ref **out);

/* Writes values (and standard errors, sd may be NULL) back; refs as returned for the same model. */
void model_set_parameters(struct model *model, const struct parameter_ref refs[], size_t n, const double value[],
                          const double sd[], const char *const record_names[]);

/* DAMPING — how much of it a beam can have that swings. */

/* Of the uniform beam of the plain material on the model's support, rad/s; for the size of things. */
double model_first_mode_radps(const struct model *model);
/*
 * The cDI or γ whose forces are as large as those of stiffness or mass in the first mode (a loss factor of 1, half of critical); beyond it nothing swings. Infinite for any
 * other parameter.
 */
double model_most_damping(const struct model *model, const struct parameter_ref *ref);

/* STARTING MODEL — a commented model file from a ruler and a handbook. */

/* Handbook values. */
struct handbook_material {
    const char *name;
    double E_Pa, density_kgpm3;
};
extern const struct handbook_material handbook_materials[];
extern const size_t handbook_materials_count;

/* One layer of a rectangular cross-section. */
struct layer {
    double E_Pa, density_kgpm3, width_m, thickness_m;
};

enum { STARTING_PATCHES = 8 };

/* What a person knows before measuring. */
struct starting_beam {
    double length_m;
    enum model_support support;
    struct layer beam, patch;
    const char *beam_material, *patch_material; /* names for the comments */
    size_t n_patches; /* alike: they share EI, ρ, cDI, and what they are worth as sensor and actuator */
    double patch_m[STARTING_PATCHES][2];
    int patch_sides; /* 1: on one face, 2: on both */
    double mass_kg;  /* of the bare beam, weighed; 0: not weighed */
    size_t n_inputs, n_outputs;
    const struct model_input *inputs; /* from_m, to_m of those on a patch: its ends; read when there are several */
    const struct model_output *outputs;
};

/* The text of the model file; caller frees. It reads back as a model without faults when the beam has none. */
char *starting_model_text(const struct starting_beam *beam);

#endif
