/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report_verdict.h"
#include "explain/explain.h"
#include "ground/ground.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

/* ---- Records and the model's own fit ---- */

const struct fit_record *report_fit_record(const struct report *r, size_t record)
{
    const struct fit_info *fit = &r->model->fit;
    const char *sha256 = r->comparison->records[record].sha256;
    for (size_t i = 0; fit->present && i < fit->n_records; i++)
        if (sha256[0] && strcmp(fit->records[i].sha256, sha256) == 0)
            return &fit->records[i];
    return NULL;
}

const char *report_group(const struct report *r)
{
    const struct comparison *all = r->comparison;
    const size_t n = all->n_records - all->n_held_out;
    size_t fitted = 0;
    for (size_t i = 0; i < n; i++) {
        const struct fit_record *record = report_fit_record(r, i);
        fitted += record != NULL && !record->held_out;
    }
    return n > 0 && fitted == n ? "fitted" : "compared";
}

/* ---- What is left ---- */

static void say(char text[REPORT_TEXT], const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(char text[REPORT_TEXT], const char *format, ...)
{
    const size_t n = strlen(text);
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text + n, REPORT_TEXT - n, format, args);
    va_end(args);
}

static void say_total(char text[REPORT_TEXT], double ratio, double nrmse, size_t n, const char *group)
{
    const char *plural = n == 1 ? "" : "s";
    if (isfinite(ratio))
        say(text, "%.3g times the noise (%.3g %% of the signal) in %zu %s record%s", ratio, 100.0 * nrmse, n, group,
            plural);
    else
        say(text, "%.3g %% of the signal in %zu %s record%s, whose noise could not be told", 100.0 * nrmse, n, group,
            plural);
}

/* What can be told from the noise is worse than what cannot, whatever their ratios. */
static bool is_worse(const struct comparison_channel *a, const struct comparison_channel *b)
{
    const bool noise_a = compare_channel_is_noise(a), noise_b = compare_channel_is_noise(b);
    return noise_a != noise_b ? noise_b : a->noise_ratio > b->noise_ratio;
}

/* The channel with the largest noise ratio; NULL when no noise is known. unknown: channels without one. */
static const struct comparison_channel *worst_channel(const struct comparison *all, size_t *unknown)
{
    const struct comparison_channel *worst = NULL;
    *unknown = 0;
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        *unknown += isfinite(c->noise_ratio) ? 0 : 1;
        if (isfinite(c->noise_ratio) && (worst == NULL || is_worse(c, worst)))
            worst = c;
    }
    return worst;
}

bool report_leaves_more(const struct report *r)
{
    size_t unknown;
    const struct comparison_channel *worst = worst_channel(r->comparison, &unknown);
    return worst != NULL && !compare_channel_is_noise(worst);
}

void report_verdict(const struct report *r, char text[REPORT_TEXT])
{
    const struct comparison *all = r->comparison;
    const size_t n = all->n_records - all->n_held_out;
    size_t unknown;
    const struct comparison_channel *worst = worst_channel(all, &unknown);
    text[0] = '\0';
    say(text, "The model leaves ");
    if (n > 0)
        say_total(text, all->noise_ratio, all->nrmse, n, report_group(r));
    if (n > 0 && all->n_held_out > 0)
        say(text, ", and ");
    if (all->n_held_out > 0)
        say_total(text, all->check_noise_ratio, all->check_nrmse, all->n_held_out, "held-out");
    if (worst == NULL)
        say(text, ". The noise of no channel is known, so it is open whether more than noise is left.");
    else if (compare_channel_is_noise(worst))
        say(text, ": nothing that could be told from the noise is left to explain%s.",
            unknown > 0 ? ", in the channels whose noise is known" : "");
    else if (all->n_channels > 1)
        say(text, "; at most %.3g times, in %s of %.200s", worst->noise_ratio, worst->name,
            text_base_name(all->records[worst->record].path));
    if (report_leaves_more(r) && r->diagnosis != NULL)
        say(text, ". %s", r->diagnosis->text);
    else if (report_leaves_more(r))
        say(text, ". More than the noise is left: `beamfit diagnose` with the same records is the next step.");
}
