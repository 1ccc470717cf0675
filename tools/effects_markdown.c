/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effects_markdown.h"

int main(void)
{
    effects_markdown(stdout);
    return fflush(stdout) == 0 && !ferror(stdout) ? 0 : 1;
}
