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

static const char image_text[] = "#include <beam_image_file.h>\n"
                                 "#include <beam_wire.h>\n"
                                 "#include <cstdio>\n"
                                 "#include <vector>\n"
                                 "int main(int argc, char **argv)\n"
                                 "{\n"
                                 "    static beam_image_file file;\n"
                                 "    std::vector<double> memory(beam_image_run_bytes() / sizeof(double) + 1);\n"
                                 "    auto *run = reinterpret_cast<beam_image_run *>(memory.data());\n"
                                 "    std::FILE *f = std::fopen(argv[argc - 1], \"rb\");\n"
                                 "    if (!f || std::fread(&file, sizeof file, 1, f) != 1)\n"
                                 "        return 1;\n"
                                 "    beam_image_run_load(run, &file);\n"
                                 "    if (beam_image_run_check(run, nullptr, 0.0F) != BEAM_IMAGE_FINE)\n"
                                 "        return 2;\n"
                                 "    float y = 0.0F;\n"
                                 "    for (int k = 0; k < 100; k++)\n"
                                 "        beam_image_run_step(run, 1.0F, &y);\n"
                                 "    return y != 0.0F ? 0 : 3;\n"
                                 "}\n";

/* The shell sees: TOP (this tree), BUILD (its build directory), DIR (empty). */
static void shell(struct rig *rig, const char *script)
{
    char text[4096];
    snprintf(
        text, sizeof text,
        "set -e; DIR=$PWD; BUILD=$(dirname \"$BEAMFIT\"); unset MAKEFLAGS MAKELEVEL; ROOT=$DIR/root/opt/beamfit\n"
        "flags() { PKG_CONFIG_PATH=$ROOT/lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$DIR/root pkg-config --cflags --libs "
        "$1; }\n%s",
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
          "gcc try.c $(flags beamfit) -o try && ./try\n"
          "gcc try.c $(flags beamfit-float) -o tryf && ./tryf\n"
          "gcc try.c $(flags beamfit-target) -o tryt && ./tryt\n"
          "test -s $ROOT/share/man/man1/beamfit.1 && test -s $ROOT/share/man/man1/beamfit-fit.1\n"
          "test -s $ROOT/share/bash-completion/completions/beamfit && test -s $ROOT/share/zsh/site-functions/_beamfit\n"
          "make -C \"$TOP\" B=\"$BUILD\" DESTDIR=$DIR/root PREFIX=/opt/beamfit uninstall\n"
          "test -z \"$(find root -type f)\"\n");
}

/* Whoever builds firmware of one's own needs no more than what is installed: in C++, with CMake, with make for a bare Cortex-M4. */
static void the_library_alone(void **state)
{
    struct rig *rig = *state;
    const char *build = strrchr(getenv("BEAMFIT"), '/') - 3;
    if (strncmp(build, "san", 3) == 0) {
        print_message("SKIPPED: the sanitizers' build is not one to install\n");
        skip();
    }
    write_text(rig->dir, "try.c", program_text);
    write_text(rig->dir, "image.cc", image_text);
    shell(rig,
          "make -s -C \"$TOP\" B=\"$BUILD\" DESTDIR=$DIR/root PREFIX=/opt/beamfit install\n"
          "LIB=$ROOT/share/beamfit/lib EXAMPLE=$ROOT/share/beamfit/examples/cortex_m4\n"
          "$ROOT/bin/beamfit export \"$TOP\"/data/live/model.yaml -o model.bfi >/dev/null\n"
          "if command -v g++ >/dev/null; then for std in 11 20; do\n"
          "    g++ -std=c++$std -Wall -Wextra -Wpedantic -Werror image.cc $(flags beamfit-target) -o image\n"
          "    ./image model.bfi; done; else echo SKIPPED: no g++; fi\n"
          "if command -v cmake >/dev/null; then\n"
          "    printf '%s\\n' 'cmake_minimum_required(VERSION 3.16)' 'project(try C)' \"add_subdirectory($LIB beam)\" "
          "'add_executable(try try.c)' 'target_link_libraries(try beam)' >CMakeLists.txt\n"
          "    cmake -S . -B cmake >cmake.log && cmake --build cmake >>cmake.log && cmake/try; else echo SKIPPED: no "
          "cmake; fi\n"
          "if command -v arm-none-eabi-gcc >/dev/null; then\n"
          "    make -s -C $EXAMPLE BEAM=$LIB IMAGE=$DIR/model.bfi OUT=$DIR 2>&1\n"
          "    if command -v qemu-system-arm >/dev/null; then make -s -C $EXAMPLE BEAM=$LIB IMAGE=$DIR/model.bfi "
          "OUT=$DIR run;\n"
          "    else echo SKIPPED: no emulator; fi\n"
          "else echo SKIPPED: no compiler for a controller; fi\n");
    print_message("%s", rig->outcome.out);
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
    const struct CMUnitTest tests[] = {CASE(install_use_uninstall), CASE(the_library_alone),
                                       CASE(packages_install_and_go)};
    return cmocka_run_group_tests_name("install", tests, NULL, NULL);
}
