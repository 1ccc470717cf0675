/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `make install` into an empty directory: the program runs there, a stranger's file compiles with pkg-config, uninstall
 * leaves no file. BEAMFIT's directory is the build that is installed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "rig.h"

static const char program_text[] = "#include <stdio.h>\n"
                                   "#include <beam_effect.h>\n"
                                   "int main(void)\n"
                                   "{\n"
                                   "    printf(\"%d %s\\n\", beam_effects_count, beam_effects[0]->id);\n"
                                   "    return beam_effects_count > 0 ? 0 : 1;\n"
                                   "}\n";

/* The shell sees: TOP (this tree), BUILD (its build directory), DIR (empty). */
static void shell(struct rig *rig, const char *script)
{
    char text[4096];
    snprintf(
        text, sizeof text,
        "set -e; DIR=$PWD; BUILD=$(dirname \"$BEAMFIT\"); unset MAKEFLAGS MAKELEVEL; ROOT=$DIR/root/opt/beamfit\n"
        "flags() { PKG_CONFIG_PATH=$ROOT/lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$DIR/root pkg-config --cflags --libs "
        "beamfit; }\n%s",
        script);
    run_program(rig->dir, (const char *[]){"sh", "-c", text, NULL}, &rig->outcome);
    if (rig->outcome.status != 0)
        fail_msg("status %d\n%s%s", rig->outcome.status, rig->outcome.out, rig->outcome.err);
}

static void install_use_uninstall(void **state)
{
    struct rig *rig = *state;
    const char *build = strrchr(getenv("BEAMFIT"), '/') - 3;
    if (strncmp(build, "san", 3) == 0) {
        print_message("SKIPPED: the sanitizers' build is not one to install\n");
        skip();
    }
    write_text(rig->dir, "try.c", program_text);
    shell(rig, "make -C \"$TOP\" B=\"$BUILD\" DESTDIR=$DIR/root PREFIX=/opt/beamfit install\n"
               "$ROOT/bin/beamfit modes model.yaml --json\n"
               "gcc try.c $(flags) -o try && ./try\n"
               "gcc -DBEAM_FLOAT try.c $(flags | sed s/-lbeam/-lbeamf/) -o tryf && ./tryf\n"
               "test -s $ROOT/share/man/man1/beamfit.1\n"
               "make -C \"$TOP\" B=\"$BUILD\" DESTDIR=$DIR/root PREFIX=/opt/beamfit uninstall\n"
               "test -z \"$(find root -type f)\"\n");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {CASE(install_use_uninstall)};
    return cmocka_run_group_tests_name("install", tests, NULL, NULL);
}
