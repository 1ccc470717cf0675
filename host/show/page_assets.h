/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * page_assets.h — the scripts and styles of the page, which stand in the program: those of host/show/page/ and, of Debian's
 * libjs-dygraphs, the library that draws the curves. tools/embed.sh makes the table. Private to show/.
 */
#ifndef BEAMFIT_PAGE_ASSETS_H
#define BEAMFIT_PAGE_ASSETS_H

#include <stddef.h>
#include <stdio.h>

struct page_asset {
    const char *name; /* "explore.js" */
    const char *text; /* [n], and a NUL */
    size_t n;
};
extern const struct page_asset page_assets[];
extern const int page_assets_count;

enum { PAGE_SCRIPTS = 8 };

/* The style sheets of the page as one text, between <style> and </style>. */
void page_styles(FILE *out);
/*
 * Scripts, by their names and in this order, NULL at the end. page_policy(): what a Content-Security-Policy says of them: "script-src 'sha256-...' ..."
 * and nothing else may run; page_scripts(): the elements themselves.
 */
void page_policy(FILE *out, const char *const names[]);
void page_scripts(FILE *out, const char *const names[]);

#endif
