/* SPDX-License-Identifier: GPL-3.0-or-later */
/* comma_locale.h — a locale whose decimal point is a comma, installed or made on the spot. Include after cmocka.h. */
#ifndef BEAMFIT_COMMA_LOCALE_H
#define BEAMFIT_COMMA_LOCALE_H

#include <locale.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

/* False, said aloud, when there is none and localedef cannot make one. Leave it with setlocale(LC_ALL, "C"). */
static inline bool comma_locale(void)
{
    char directory[] = "/tmp/beamfit-locale-XXXXXX", command[256];
    if (setlocale(LC_ALL, "de_DE.UTF-8"))
        return true;
    if (!mkdtemp(directory))
        return false;
    (void)snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 >%s/log 2>&1", directory,
                   directory);
    bool made = system(command) >= 0 && setenv("LOCPATH", directory, 1) == 0 && setlocale(LC_ALL, "de_DE.UTF-8");
    (void)unsetenv("LOCPATH");
    (void)snprintf(command, sizeof command, "rm -rf %s", directory);
    if (system(command) != 0 || !made)
        print_message("SKIPPED: no locale with a decimal comma (de_DE.UTF-8), and localedef makes none\n");
    return made;
}

#endif
