/* SPDX-License-Identifier: GPL-3.0-or-later */
/* watch_page.c — the page of `beamfit watch`: the scripts of the report's, and one that asks the server. */
#include "html.h"
#include "page_assets.h"
#include "show.h"

static const char *const scripts[] = {"dygraph.min.js", "chart.js", "curves.js", "explore.js", "watch.js", NULL};

void watch_page_policy(FILE *out)
{
    html_policy(out, scripts, true);
    (void)fputs("; frame-ancestors 'none'", out);
}

void watch_page_write(FILE *out, const char *title)
{
    html_begin(out, title, "beamfit " BEAMFIT_VERSION, scripts, true);
    (void)fputs("<header>\n<h1>", out);
    html_text(out, title);
    (void)fputs("</h1>\n<p class=\"verdict\" id=\"verdict\" role=\"status\">Asking …</p>\n</header>\n"
                "<noscript><p class=\"warning\">This page needs a browser that runs its scripts.</p></noscript>\n"
                "<div id=\"bench\"></div>\n<div id=\"explore\"></div>\n",
                out);
    page_scripts(out, scripts);
    html_end(out);
}
