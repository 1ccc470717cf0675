/* SPDX-License-Identifier: GPL-3.0-or-later */
/* effects_markdown.h — the catalogue of effects as a Markdown table, from the effects themselves. */
#ifndef EFFECTS_MARKDOWN_H
#define EFFECTS_MARKDOWN_H

#include <math.h>
#include <stdio.h>
#include "beam_effect.h"

#define EFFECTS_MARKDOWN_BEGIN "<!-- catalogue: made by tools/effects_docs.sh -->\n"
#define EFFECTS_MARKDOWN_END   "<!-- end of catalogue -->\n"

/* A cell: '|' would end it. */
static inline void effects_markdown_cell(FILE *out, const char *text)
{
    for (const char *c = text; *c; c++) {
        if (*c == '|')
            fputc('\\', out);
        fputc(*c, out);
    }
}

static inline void effects_markdown_parameters(FILE *out, const struct beam_effect *e)
{
    for (int j = 0; j < e->n_parameters; j++) {
        const struct beam_parameter_info *p = &e->parameters[j];
        fprintf(out, "%s`%s`", j ? ", " : "", p->name);
        if (!(p->flags & BEAM_PARAMETER_INNER))
            fprintf(out, isfinite(p->neutral) ? " (%g)" : " (∞)", p->neutral);
    }
}

/* Families in the order of the enumeration, effects in theirs. */
static inline void effects_markdown(FILE *out)
{
    static const char *const family[] = {"structure", "damping", "nonlinear stiffness and friction",
                                         "measurement chain", "environment"};
    fputs(EFFECTS_MARKDOWN_BEGIN, out);
    fputs("| effect | what it is | term | parameters (neutral value) | cost on the target |\n|---|---|---|---|---|\n",
          out);
    for (int f = 0; f <= (int)BEAM_FAMILY_ENVIRONMENT; f++) {
        fprintf(out, "| **%s** | | | | |\n", family[f]);
        for (int i = 0; i < beam_effects_count; i++) {
            const struct beam_effect *e = beam_effects[i];
            if ((int)e->family != f)
                continue;
            fprintf(out, "| `%s` | %s | ", e->id, e->title);
            effects_markdown_cell(out, e->form);
            fputs(" | ", out);
            effects_markdown_parameters(out, e);
            fprintf(out, " | %s |\n", e->target_cost);
        }
    }
    fputs(EFFECTS_MARKDOWN_END, out);
}

#endif
