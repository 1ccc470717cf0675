/* SPDX-License-Identifier: GPL-3.0-or-later */
/* discriminate_work.h — what the discriminate*.c files share; for nobody else. See discriminate.h. */
#ifndef BEAMFIT_DISCRIMINATE_WORK_H
#define BEAMFIT_DISCRIMINATE_WORK_H

#include "explain.h"
#include "discriminate.h"
#include "noise/noise.h"

/*
 * Noise of one output in an experiment: the least that was seen, but not less of the signal than was ever reached, because
 * a recorder's range is set to the signal.
 */
struct expected_noise {
    struct whitener unit; /* colour, of rms 1 */
    double least;         /* rms, unit of the channel */
    double share;         /* of the signal's rms */
};

struct discriminate_work {
    struct discrimination *d;
    const struct discriminate_options *options;
    const struct model *baseline; /* as given */
    const struct record *records;
    size_t n_records;
    size_t n;                     /* samples of an experiment */
    double dt_s;                  /* of an experiment */
    size_t n_outputs;             /* of the baseline; the sensors that could be added follow them */
    struct expected_noise *noise; /* [n_outputs + n_sensors] */
    double *sigma;                /* per channel of the present records, in the order of predictor_channels() */
    double **information;         /* [n_rivals] of the present records, see present_information(); NULLs without */
    double *half_square;          /* [n_rivals] ½ χ² + ½ Σ priors of the refits */
};

/* What of one prediction enters: per channel (outputs, then sensors). */
struct forecast {
    struct model model;
    size_t n_parameters;
    struct parameter_ref *refs;
    double *y;        /* [n_channels][n] */
    double *jacobian; /* [n_parameters][n_channels][n]; NULL unless asked */
};

/* ---- discriminate_menu.c: drives, sensors, signals; no rival is looked at ---- */
enum bf_status menu_make(struct discriminate_work *w, struct bf_error *err);
/* What strengths without records refer to: the largest allowed hit nearest the end, else the first drive. */
const struct drive *reference_drive(const struct discriminate_work *w);
/* u[n], level included. */
void menu_signal(const struct discriminate_work *w, const struct drive *drive, double u[]);
/* The inputs of the baseline as columns; with_outputs: zeros for its outputs and the sensors, for a predictor to bind to. */
void menu_record(const struct discriminate_work *w, const struct drive *drive, bool with_outputs, struct record *out);
/* The rival's model with the input where the drive wants it and every sensor of the menu added. */
enum bf_status menu_model(const struct discriminate_work *w, const struct model *rival, const struct drive *drive,
                          struct model *out, struct bf_error *err);
bool record_has_known_inputs(const struct record *record);

/* ---- discriminate_predict.c ---- */
/* Noise of each output from the records; of others as of a sensor of their kind, or a share of the signal. */
enum bf_status noise_from_records(struct discriminate_work *w, struct bf_error *err);
/* Noise of an experiment that these forecasts (not whitened yet) are of: whiteners[n_outputs + n_sensors]. */
void noise_of_experiment(const struct discriminate_work *w, const struct forecast forecasts[], size_t n,
                         struct whitener whiteners[]);
enum bf_status forecast_make(const struct discriminate_work *w, const struct model *rival, const struct drive *drive,
                             bool with_jacobian, struct forecast *out, struct bf_error *err);
/* Prediction and derivatives in units of the noise, colour taken out. */
void forecast_whiten(const struct discriminate_work *w, const struct whitener whiteners[], struct forecast *forecast);
void forecast_free(struct forecast *forecast);
/*
 * JᵀJ/σ² of the present records at the rival's values, [n²] over the parameters that all records share, those of single
 * records and decays without a known input taken out. Caller frees *out.
 */
enum bf_status present_information(const struct discriminate_work *w, const struct model *model, double **out,
                                   struct bf_error *err);
/* H_b in the parameters of the forecast: present records where a parameter is the same one, and priors. [n²]. */
void forecast_information(const struct discriminate_work *w, const struct forecast *forecast, const double *present,
                          const struct drive *drive, double H[]);

/* ---- discriminate_pairs.c ---- */
/* evidence[n_sensors + 1]: a true, b refitted, with each sensor added; the last with none. */
enum bf_status pair_evidence(const struct discriminate_work *w, const struct forecast *a, const struct forecast *b,
                             const double H[], double evidence[], struct bf_error *err);
/* All experiments of one drive: [n_sensors + 1] with their pairs. */
enum bf_status drive_experiments(const struct discriminate_work *w, size_t drive, struct experiment out[],
                                 struct bf_error *err);

/* ---- discriminate_rivals.c ---- */
enum bf_status rivals_refit(struct discriminate_work *w, const struct discriminate_rival rivals[],
                            struct bf_error *err);
/* Without records: catalogue's starts, scaled to change the response to the reference drive alike. */
enum bf_status rivals_scaled(struct discriminate_work *w, const struct discriminate_rival rivals[],
                             struct bf_error *err);

/* ---- discriminate_words.c ---- */
char *discriminate_words(const struct discrimination *d, const struct discriminate_work *w);

#endif
