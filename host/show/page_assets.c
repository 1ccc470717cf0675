/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "page_assets.h"

#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "html.h"

static const struct page_asset *find(const char *name)
{
    for (int i = 0; i < page_assets_count; i++)
        if (strcmp(page_assets[i].name, name) == 0)
            return &page_assets[i];
    return NULL;
}

static bool is_style(const char *name)
{
    const char *dot = strrchr(name, '.');
    return dot != NULL && strcmp(dot, ".css") == 0;
}

void page_styles(FILE *out)
{
    for (int i = 0; i < page_assets_count; i++)
        if (is_style(page_assets[i].name))
            (void)fprintf(out, "%s\n", page_assets[i].text);
}

void page_policy(FILE *out, const char *const names[])
{
    enum { BYTES = 32 };
    (void)fputs("script-src", out);
    for (; *names != NULL; names++) {
        const struct page_asset *asset = find(*names);
        char hex[65], two[3] = "";
        unsigned char sum[BYTES];
        if (asset == NULL)
            continue;
        hash_sha256_hex(asset->text, asset->n, hex);
        for (size_t i = 0; i < BYTES; i++) {
            memcpy(two, hex + 2 * i, 2);
            sum[i] = (unsigned char)strtoul(two, NULL, 16);
        }
        (void)fputs(" 'sha256-", out);
        html_base64(out, sum, BYTES);
        (void)fputs("'", out);
    }
}

void page_scripts(FILE *out, const char *const names[])
{
    for (; *names != NULL; names++) {
        const struct page_asset *asset = find(*names);
        if (asset != NULL)
            (void)fprintf(out, "<script>%s</script>\n", asset->text);
    }
}
