/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The record as CSV. */
#include "truth_internal.h"

#include <math.h>

static void print_spec(const struct truth_record *record, const struct truth_spec *spec, FILE *stream)
{
    fprintf(stream,
            "# noise: white%s, rms relative to the channel's rms:", spec->noise_ar[0] != 0 ? " through AR(2)" : "");
    for (size_t c = 0; c < record->n_channels; c++)
        fprintf(stream, " %s %.9g", record->channel[c].name, record->channel[c].noise);
    fprintf(stream, "\n# adc bits: %u%s\n# seed: %llu\n", spec->adc_bits, spec->adc_inputs ? "" : " (outputs only)",
            (unsigned long long)spec->seed);
    const struct truth_region *beam = &spec->region[0], *patch = &spec->region[1];
    fprintf(stream, "# truth EI_beam_Nm2: %.9g\n# truth EI_patch_Nm2: %.9g\n", beam->EI_Nm2, patch->EI_Nm2);
    fprintf(stream, "# truth rho_beam_kgpm: %.9g\n# truth rho_patch_kgpm: %.9g\n", beam->rho_kgpm, patch->rho_kgpm);
    fprintf(stream, "# truth cDI_beam_sNm2: %.9g\n# truth cDI_patch_sNm2: %.9g\n", beam->cDI_sNm2, patch->cDI_sNm2);
    fprintf(stream, "# truth gamma_sNpm2: %.9g\n# truth Ks_V: %.9g\n# truth KB_NmpV: %.9g\n", spec->gamma_sNpm2,
            spec->Ks_V, spec->KB_NmpV);
    for (size_t e = 0; e < spec->n_effects; e++) {
        fprintf(stream, "# truth effect %zu: %s", e + 1, truth_effect_id(&spec->effect[e]));
        for (int k = 0; k < TRUTH_PARAMETERS && truth_effect_parameter(&spec->effect[e], k); k++)
            fprintf(stream, " %s=%.9g", truth_effect_parameter(&spec->effect[e], k), spec->effect[e].parameter[k]);
        if (spec->effect[e].output >= 0)
            fprintf(stream, " channel=%s", spec->output[spec->effect[e].output].name);
        fputc('\n', stream);
    }
}

int truth_record_print(const struct truth_record *record, const struct truth_spec *spec, const char *title,
                       FILE *stream)
{
    fprintf(stream, "# title: %s\n# provenance: simulated by tests/truth (finite elements, %zu modes), not measured\n",
            title, spec->modes);
    fprintf(stream, "# units: SI, in the column names\n# sample rate Hz: %.9g\n", record->rate_Hz);
    if (spec->filter_order > 0)
        fprintf(stream, "# anti-alias filter: Butterworth order %zu at %.9g Hz, %s, every channel\n",
                spec->filter_order, spec->filter_ratio * record->rate_Hz,
                spec->filter_causal ? "one pass" : "forward and backward (zero phase)");
    if (!spec->blind)
        print_spec(record, spec, stream);
    fputs("time_s", stream);
    for (size_t c = 0; c < record->n_channels; c++)
        fprintf(stream, ",%s", record->channel[c].name);
    fputc('\n', stream);
    for (size_t i = 0; i < record->n; i++) {
        fprintf(stream, "%.10g", record->t0_s + (double)i / record->rate_Hz);
        for (size_t c = 0; c < record->n_channels; c++)
            fprintf(stream, ",%.7g", record->channel[c].x[i]);
        fputc('\n', stream);
    }
    return ferror(stream) ? -1 : 0;
}
