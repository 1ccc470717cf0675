/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `make install` into an empty directory: the program runs there, a stranger's file compiles with pkg-config, uninstall
 * leaves no file; `make deb` likewise. BEAMFIT's directory is the build that is installed. */
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
    shell(rig,
          "make -C \"$TOP\" B=\"$BUILD\" DESTDIR=$DIR/root PREFIX=/opt/beamfit install\n"
          "$ROOT/bin/beamfit modes model.yaml --json\n"
          "gcc try.c $(flags) -o try && ./try\n"
          "gcc -DBEAM_FLOAT try.c $(flags | sed s/-lbeam/-lbeamf/) -o tryf && ./tryf\n"
          "test -s $ROOT/share/man/man1/beamfit.1 && test -s $ROOT/share/man/man1/beamfit-fit.1\n"
          "test -s $ROOT/share/bash-completion/completions/beamfit && test -s $ROOT/share/zsh/site-functions/_beamfit\n"
          "make -C \"$TOP\" B=\"$BUILD\" DESTDIR=$DIR/root PREFIX=/opt/beamfit uninstall\n"
          "test -z \"$(find root -type f)\"\n");
}

/* `make deb`: dpkg installs both into an empty root against this machine's list of packages, so that every dependency is one of Debian's. */
static void packages_install_and_go(void **state)
{
    struct rig *rig = *state;
    const char *build = strrchr(getenv("BEAMFIT"), '/') - 3;
    run_program(rig->dir,
                (const char *[]){"sh", "-c",
                                 "command -v dpkg && command -v dpkg-shlibdeps && test -s /var/lib/dpkg/status", NULL},
                &rig->outcome);
    if (strncmp(build, "san", 3) == 0 || rig->outcome.status != 0) {
        print_message("SKIPPED: the sanitizers' build, or no dpkg here\n");
        skip();
    }
    write_text(rig->dir, "try.c", program_text);
    shell(rig, "export PATH=$PATH:/usr/sbin:/sbin ROOT=$DIR/root/usr\n"
               "make -s --no-print-directory -C \"$TOP\" B=\"$BUILD\" deb >debs\n"
               "mkdir -p root/var/lib/dpkg/info root/var/lib/dpkg/updates root/var/lib/dpkg/triggers\n"
               "cp /var/lib/dpkg/status root/var/lib/dpkg/\n"
               "package() { dpkg --root=$DIR/root --force-not-root --log=/dev/null \"$@\" >dpkg.log 2>&1 || { cat "
               "dpkg.log; exit 1; }; }\n"
               "package -i $(cat debs)\n"
               "test \"$($ROOT/bin/beamfit --version)\" = \"beamfit $(sed -n 's/^VERSION := //p' \"$TOP\"/Makefile)\"\n"
               "$ROOT/bin/beamfit modes model.yaml --json\n"
               "gcc try.c $(PKG_CONFIG_PATH=$ROOT/lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$DIR/root pkg-config --cflags "
               "--libs beamfit) -o try && ./try\n"
               "gzip -t $ROOT/share/man/man1/beamfit.1.gz $ROOT/share/man/man1/beamfit-fit.1.gz\n"
               "bash -n $ROOT/share/bash-completion/completions/beamfit\n"
               "test -s $ROOT/share/zsh/vendor-completions/_beamfit\n"
               "package -r beamfit libbeam-dev\n"
               "test -z \"$(find root/usr -type f)\"\n");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, rig_setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {CASE(install_use_uninstall), CASE(packages_install_and_go)};
    return cmocka_run_group_tests_name("install", tests, NULL, NULL);
}
