# SPDX-License-Identifier: GPL-3.0-or-later
# beamfit — `make help` lists the targets.
SHELL := /bin/bash
.DEFAULT_GOAL := all
VERSION := 0.2.0

# ---- What a caller may set ----
B       ?= build
ifeq ($(origin CC),default)
CC      := gcc
endif
OPT     ?= -O2 -g
CFLAGS  ?=
WERROR  ?=
PREFIX  ?= /usr/local
DESTDIR ?=
JOBS    ?= 2
FUZZ_SECONDS ?= 20

# ---- Flags ----
WARN  := -Wall -Wextra -Wpedantic -Wno-overlength-strings -Wconversion -Wdouble-promotion -Wshadow -Wstrict-prototypes -Wmissing-prototypes \
         $(if $(WERROR),-Werror)
STD   := -std=c11 -D_GNU_SOURCE -DBEAMFIT_VERSION='"$(VERSION)"'
PKGS  := libmicrohttpd nlopt libserialport libfyaml jansson matio fftw3 lapacke openblas sndfile sqlite3
INC   := -Ilib -Ihost -I/usr/include/suitesparse -I/usr/include/arpack $(shell pkg-config --cflags $(PKGS) 2>/dev/null)
LIBS  := $(shell pkg-config --libs $(PKGS) 2>/dev/null) -lcholmod -larpack -lbearssl -lpthread -lm
# Position independent, so that the objects of the program also make the shared library of the tests; calls bind as in a program.
PIC   := -fPIC -fno-semantic-interposition
ALLFLAGS = $(STD) $(OPT) $(WARN) $(PIC) $(INC) $(CFLAGS)
# The library sees its own headers only; no contraction, so that every target rounds alike.
LIBFLAGS = $(STD) $(OPT) $(WARN) $(PIC) -Ilib $(CFLAGS) -ffp-contract=off
SANITIZE := -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer

# Runs make with JOBS jobs; when it fails, the first error is said again at the end, below what the other jobs printed.
SUBMAKE = +@tools/first_error.sh $(B)/make.log $(MAKE) --no-print-directory -j$(JOBS)
say = $(if $(V),,@echo "  $1";) # V=1 prints whole commands

# ---- Sources: found, not listed ----
LIB_SRC    := $(wildcard lib/*.c) $(wildcard lib/effects/*.c)
HOST_SRC   := $(filter-out host/main.c host/cmd/fleet_mpi.c,$(wildcard host/*.c host/*/*.c host/*/*/*.c))
UNIT_SRC   := $(wildcard tests/unit/test_*.c)
SYSTEM_SRC := $(wildcard tests/system/test_*.c)
LIB_OBJ   = $(LIB_SRC:%.c=$(B)/double/%.o) $(B)/double/effects_table.o $(B)/double/galerkin_tables.o
FLOAT_OBJ = $(LIB_SRC:%.c=$(B)/float/%.o) $(B)/float/effects_table.o $(B)/float/galerkin_tables.o
TARGET_OBJ = $(LIB_SRC:%.c=$(B)/target/%.o) $(B)/target/effects_table.o $(B)/target/galerkin_tables.o
CPLX_OBJ  = $(patsubst %.c,$(B)/complex/%.o,$(wildcard lib/effects/*.c)) $(B)/complex/effects_table.o
HOST_OBJ  = $(HOST_SRC:%.c=$(B)/%.o) $(B)/host/commands_table.o $(B)/host/import_formats_table.o $(B)/host/page_assets_table.o
PAGES     = $(B)/man/done $(B)/completion/bash $(B)/completion/zsh
TESTED    = $(B)/libhost.a $(B)/libtruth.a $(B)/libbeam.a $(B)/libbeamf.a $(B)/libbeamt.a $(B)/libbeamc.a

# The same fleet on the ranks of MPI: a program of its own, so that beamfit needs no MPI. Only where the compiler of MPI is.
MPI       := $(if $(shell command -v mpicc 2>/dev/null),$(B)/beamfit-fleet)
MPI_INC    = $(patsubst -I%,-isystem %,$(filter -I%,$(shell mpicc --showme:compile 2>/dev/null)))

all: $(B)/beamfit $(MPI) $(PAGES) $(B)/libbeamf.a $(B)/libbeamt.a ## build: the program, its manual pages and the libraries

# ---- Objects ----
# Made every time and kept when it has not changed, so that a source that is taken away leaves the table, too.
$(B)/gen/effects_table.c: FORCE
	@mkdir -p $(@D)
	@sh tools/effects_table.sh lib/effects > $@.new
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi
$(B)/gen/commands_table.c: FORCE
	@mkdir -p $(@D)
	@sh tools/table.sh command cmd/commands.h $(wildcard host/cmd/*.c) > $@.new
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi
$(B)/gen/import_formats_table.c: FORCE
	@mkdir -p $(@D)
	@sh tools/table.sh import_format record/import/import_format.h $(wildcard host/record/import/*.c) > $@.new
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi
# Scripts and styles of the page: its own, and the library of curves that Debian's libjs-dygraphs installs.
DYGRAPHS ?= /usr/share/javascript/dygraphs
PAGE_ASSETS := $(DYGRAPHS)/dygraph.min.css $(addprefix host/show/page/,page.css explore.css theme.css) \
    $(DYGRAPHS)/dygraph.min.js $(sort $(wildcard host/show/page/*.js))
$(B)/gen/page_assets_table.c: tools/embed.sh $(PAGE_ASSETS)
	@mkdir -p $(@D)
	$(call say,$@)sh tools/embed.sh show/page_assets.h $(PAGE_ASSETS) > $@.new && mv $@.new $@
$(DYGRAPHS)/%:
	@echo "$@ is missing: apt-get install libjs-dygraphs, or make deps" >&2; exit 1
FORCE:
# The generator runs here, whatever CC compiles for. Its default geometry is the paper's.
HOSTCC ?= gcc
$(B)/gen/galerkin_tables.c: tools/galerkin_tables.c
	@mkdir -p $(@D)
	$(call say,$@)$(HOSTCC) $(STD) -O2 $(WARN) $< -lm -o $(@D)/galerkin_tables && $(@D)/galerkin_tables > $@.new && mv $@.new $@
$(B)/double/%.o: $(B)/gen/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -MMD -MP -c $< -o $@
$(B)/float/%.o: $(B)/gen/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT -MMD -MP -c $< -o $@
$(B)/target/%.o: $(B)/gen/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT -DBEAM_TARGET -MMD -MP -c $< -o $@
$(B)/complex/%.o: $(B)/gen/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_COMPLEX -MMD -MP -c $< -o $@
$(B)/double/%.o: %.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -MMD -MP -c $< -o $@
$(B)/float/%.o: %.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT -MMD -MP -c $< -o $@
$(B)/target/%.o: %.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT -DBEAM_TARGET -MMD -MP -c $< -o $@
$(B)/complex/%.o: %.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_COMPLEX -MMD -MP -c $< -o $@
# firmware/ as the host runs it: board_host, unit tests
FW_FLAGS = $(LIBFLAGS) -DBEAM_FLOAT -DBEAM_TARGET -Ifirmware
$(B)/firmware/%.o: firmware/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(FW_FLAGS) -MMD -MP -c $< -o $@
$(B)/firmware/board_host/main.o: firmware/main.c # the PC's main() reads the command line first
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(FW_FLAGS) -Dmain=firmware_main -Wno-missing-prototypes -MMD -MP -c $< -o $@
BUILT_IN_HZ ?= 1000
$(B)/gen/built_in_image: tools/built_in_image.c $(B)/libbeam.a $(B)/libbeamt.a
	$(call say,$@)$(CC) $(LIBFLAGS) $^ -lm -o $@
$(B)/gen/built_in_image.c: $(B)/gen/built_in_image
	$(call say,$@)$< $(BUILT_IN_HZ) > $@.new && mv $@.new $@
$(B)/host/%_table.o: $(B)/gen/%_table.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(ALLFLAGS) -MMD -MP -c $< -o $@
$(B)/host/%.o: host/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(ALLFLAGS) -MMD -MP -c $< -o $@

# What says the version is made anew when it changes.
$(patsubst %.c,$(B)/%.o,$(shell grep -rl --include=*.c BEAMFIT_VERSION host)): $(B)/version
$(B)/version: FORCE
	@mkdir -p $(@D)
	@echo $(VERSION) | cmp -s - $@ || echo $(VERSION) > $@

# ---- Archives and program ----
$(B)/libbeam.a: $(LIB_OBJ)
	$(call say,$@)rm -f $@; ar rcs $@ $^
$(B)/libbeamf.a: $(FLOAT_OBJ)
	$(call say,$@)rm -f $@; ar rcs $@ $^
# float in a controller's sizes: what the firmware runs, linked on the host to replay and to check it
$(B)/libbeamt.a: $(TARGET_OBJ)
	$(call say,$@)rm -f $@; ar rcs $@ $^
$(B)/libbeamc.a: $(CPLX_OBJ)
	$(call say,$@)rm -f $@; ar rcs $@ $^
$(B)/libhost.a: $(HOST_OBJ)
	$(call say,$@)rm -f $@; ar rcs $@ $^
FW_OBJ = $(patsubst %.c,$(B)/%.o,$(filter-out firmware/main.c,$(wildcard firmware/*.c))) $(B)/target/built_in_image.o
$(B)/libfirmware.a: $(FW_OBJ)
	$(call say,$@)rm -f $@; ar rcs $@ $^
BOARD_HOST_OBJ = $(patsubst %.c,$(B)/%.o,$(wildcard firmware/board_host/*.c)) $(B)/firmware/board_host/main.o
$(B)/board_host: $(BOARD_HOST_OBJ) $(B)/libfirmware.a $(B)/libbeamt.a
	$(call say,$@)$(CC) $(OPT) $(CFLAGS) $^ -lbearssl -lm -o $@
$(B)/beamfit: $(B)/host/main.o $(B)/libhost.a $(B)/libbeam.a $(B)/libbeamt.a
	$(call say,$@)$(CC) $(OPT) $(CFLAGS) $^ $(LIBS) -o $@

$(B)/host/cmd/fleet_mpi.o: private ALLFLAGS += $(MPI_INC)
$(B)/beamfit-fleet: $(B)/host/cmd/fleet_mpi.o $(B)/libhost.a $(B)/libbeam.a $(B)/libbeamt.a
	$(call say,$@)$(CC) $(OPT) $(CFLAGS) $^ $(LIBS) $(shell mpicc --showme:link) -o $@

# ---- Manual pages and completion, from the tables of the commands ----
$(B)/gen/manual $(B)/gen/completion: $(B)/gen/%: tools/%.c $(B)/libhost.a $(B)/libbeam.a $(B)/libbeamt.a
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(ALLFLAGS) $^ $(LIBS) -o $@
$(B)/man/done: $(B)/gen/manual # beamfit.1 and beamfit-COMMAND.1
	$(call say,$(@D))rm -rf $(@D) && mkdir -p $(@D) && $< > $(@D)/beamfit.1 && \
	    for command in $$($< names); do $< $$command > $(@D)/beamfit-$$command.1 || exit 1; done && touch $@
$(B)/completion/bash: $(B)/gen/completion tools/completion.bash
	@mkdir -p $(@D)
	$(call say,$@){ $< bash && cat tools/completion.bash; } > $@.new && mv $@.new $@
$(B)/completion/zsh: $(B)/gen/completion
	@mkdir -p $(@D)
	$(call say,$@)$< zsh > $@.new && mv $@.new $@

# ---- The independent truth simulator: sees neither lib/ nor host/ ----
TRUTH_SRC  := $(wildcard tests/truth/*.c)
TRUTH_OBJ   = $(TRUTH_SRC:tests/truth/%.c=$(B)/truth/%.o)
TRUTH_LIBS := -lsundials_cvode -lsundials_nvecserial -lsundials_sunmatrixdense -lsundials_sunlinsoldense \
              -llapacke -lopenblas -lm
$(B)/truth/%.o: tests/truth/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(STD) $(OPT) $(WARN) $(PIC) $(shell pkg-config --cflags lapacke openblas 2>/dev/null) $(CFLAGS) -MMD -MP -c $< -o $@
$(B)/libtruth.a: $(filter-out $(B)/truth/main.o,$(TRUTH_OBJ))
	$(call say,$@)rm -f $@; ar rcs $@ $^
$(B)/beam_truth: $(B)/truth/main.o $(B)/libtruth.a
	$(call say,$@)$(CC) $(OPT) $(CFLAGS) $^ $(TRUTH_LIBS) -o $@

include firmware/build.mk tests/target/build.mk

# ---- Tests: tests/unit/test_x.c -> $(B)/tests/test_x, tests/system/test_y.c -> $(B)/system/test_y ----
UNIT_TESTS   := $(UNIT_SRC:tests/unit/%.c=$(B)/tests/%)
SYSTEM_TESTS := $(SYSTEM_SRC:tests/system/%.c=$(B)/system/%)
# All that unit tests call stands in one shared library: a changed source links it anew, and no test. Inside it, names are
# bound to the library's own, as in an archive, even if a test uses one of them for something else.
$(B)/libtested.so: $(TESTED)
	$(call say,$@)$(CC) $(OPT) $(CFLAGS) -shared -Wl,-soname,$(@F) -Wl,-Bsymbolic -Wl,--whole-archive $(TESTED) -Wl,--no-whole-archive \
	    -Wl,--as-needed $(LIBS) $(TRUTH_LIBS) -o $@
$(B)/tests/%: tests/unit/%.c | $(B)/libtested.so
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(ALLFLAGS) -Itests -Itests/truth -MMD -MP $< $(filter %.o,$^) $(filter %.a,$^) $(B)/libtested.so \
	    -Wl,-rpath,'$$ORIGIN/..' -Wl,--as-needed $(LIBS) $(TRUTH_LIBS) -lcmocka -o $@
$(B)/system/%.o: tests/system/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(STD) $(OPT) $(WARN) $(CFLAGS) -MMD -MP -c $< -o $@
# tests of the firmware see lib/ in a controller's sizes, as it does, and are the board below it
$(filter $(B)/tests/test_firmware%,$(UNIT_TESTS)): $(B)/libfirmware.a
$(filter $(B)/tests/test_firmware%,$(UNIT_TESTS)): private ALLFLAGS += -DBEAM_FLOAT -DBEAM_TARGET -Ifirmware -ffp-contract=off
# tests of the effects run them in all three arithmetics at once
SHADOWS := $(B)/double/tests/effects_shadow.o $(B)/float/tests/effects_shadow.o $(B)/complex/tests/effects_shadow.o
$(filter $(B)/tests/test_effects%,$(UNIT_TESTS)): $(SHADOWS)
BEAM_SHADOWS := $(B)/double/tests/beam_case.o $(B)/double/tests/newmark.o $(B)/float/tests/beam_shadow.o
$(filter $(B)/tests/test_beam%,$(UNIT_TESTS)): $(BEAM_SHADOWS)
# images as `export` makes them, made in the host's arithmetic
$(B)/host/tests/observed_image.o: tests/observed_image.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(ALLFLAGS) -MMD -MP -c $< -o $@
$(B)/tests/test_firmware_observer $(B)/tests/test_firmware_track: $(B)/host/tests/observed_image.o
# main() of the firmware under the name that the PC's build gives it
$(B)/tests/test_firmware_main: $(B)/firmware/board_host/main.o
# the link's test starts a board and a bad line as the system tests do
$(B)/tests/test_link: $(B)/system/board.o $(B)/system/line.o $(B)/system/run_program.o
SYSTEM_COMMON := $(patsubst tests/system/%.c,$(B)/system/%.o,$(filter-out $(SYSTEM_SRC),$(wildcard tests/system/*.c)))
$(SYSTEM_TESTS): $(B)/system/%: $(B)/system/%.o $(SYSTEM_COMMON)
	$(call say,$@)$(CC) $(OPT) $(CFLAGS) $^ -lcmocka -ljansson -lm -o $@
.SECONDARY: $(SYSTEM_TESTS:%=%.o)

# lets the system tests run libserialport on a pseudo terminal
$(B)/shim/%.so: tests/shim/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(STD) -O2 $(WARN) -fPIC -shared $< -o $@

BESIDE_TESTS = all $(B)/beam_truth $(B)/board_host $(B)/shim/pty_serial.so # programs that tests start
tests: $(BESIDE_TESTS) $(UNIT_TESTS) $(SYSTEM_TESTS)
unit: $(BESIDE_TESTS) $(UNIT_TESTS) ## test: the unit tests of the plain build
	BEAMFIT_TESTS="/tests/$$BEAMFIT_TESTS" tests/run $(B)

test: ## test: install what is missing, build twice (sanitizers, plain), run all tests of both
	@tools/deps.sh build test
	@$(MAKE) --no-print-directory test-both
test-both: # -g1, lines without variables: a third less to compile, and all that a sanitizer prints
	$(SUBMAKE) B=$(B) tests
	$(SUBMAKE) B=$(B)/san OPT="-O1 -g1" CFLAGS="$(SANITIZE) $(CFLAGS)" tests
	tests/run $(B)/san $(B)

demo: ## test: fit the paper's two experiments, find a hidden effect, draw the pictures
	@tools/deps.sh build test
	$(SUBMAKE) all $(B)/beam_truth
	@tools/demo.sh $(B) $(B)/demo

deps: ## install: every Debian package that is missing (apt-get; sudo when not root)
	@tools/deps.sh build test check target

# ---- Checks ----
lint: export LINT_FLAGS = $(STD) $(INC) $(MPI_INC)
lint: ## check: clang-format, clang-tidy, cppcheck and shell syntax of every source
	+@JOBS='$(JOBS)' tools/lint.sh $(FILES)
layers: $(B)/libhost.a ## check: who includes whom, who calls whom, circles, which file sees which library
	@python3 -B tools/layers.py $(B)
size: ## check: sizes and stacks of functions; flash, RAM, stack, instructions of the firmware
	@tools/deps.sh build target
	$(SUBMAKE) firmware-elf target-counts
	@tools/size.sh $(B)/size
	@tools/firmware_size.sh $(B) $(FIRMWARE_BOARDS)
	@python3 -B tests/target/run.py --build $(B) counts
# Only lib/ and firmware/ are built anew; tests of images as the host makes them use the host as it is.
COVERAGE_TESTS := $(filter-out test_effects_docs,$(notdir $(basename $(wildcard $(addprefix tests/unit/test_,beam_*.c effects*.c firmware_*.c)))))
coverage: $(B)/libhost.a $(B)/libtruth.a ## check: lines of lib/ and firmware/ that their unit tests run; fails below 95 %
	@tools/deps.sh build test
	$(SUBMAKE) B=$(B)/coverage OPT=-O0 CFLAGS='--coverage $(CFLAGS)' \
	    TESTED='$(B)/libhost.a $(B)/libtruth.a $$(addprefix $$(B)/libbeam,.a f.a t.a c.a)' $(COVERAGE_TESTS:%=$(B)/coverage/tests/%)
	@tools/coverage.sh $(B)/coverage
BENCH := $(addprefix $(B)/bench/,reference_fit_24x16 reference_fit_40x64 reference_fit_60x128 simulate step_float step_double)
bench: all $(B)/beam_truth $(BENCH) ## measure: fit, diagnosis and one step beside plain references
	@tests/bench/run.sh $(B)
	@tests/bench/diagnose.sh $(B)
$(B)/bench/reference_fit_%: tests/bench/reference_fit.c tests/bench/reference_model.c tests/bench/reference_model.h
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(ALLFLAGS) -DREFERENCE_MODES=$(word 1,$(subst x, ,$*)) -DREFERENCE_OVERSAMPLE=$(word 2,$(subst x, ,$*)) \
	    $(filter %.c,$^) $(LIBS) -o $@
$(B)/bench/simulate: tests/bench/simulate.c tests/bench/reference_model.c $(B)/libhost.a $(B)/libbeam.a
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(ALLFLAGS) $^ $(LIBS) -o $@
$(B)/bench/step_double: tests/bench/step.c $(B)/libbeam.a
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) $^ -lm -o $@
$(B)/bench/step_float: tests/bench/step.c $(B)/libbeamf.a
	@mkdir -p $(@D)
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT $^ -lm -o $@
# Recordings are simulated once below HIDDEN and kept. CASES: names, strengths, effects, rigs, or options of tests/hidden/run.py.
HIDDEN ?= build/hidden
CASES  ?=
N      ?= 200
PAGE   ?=
hidden: $(B)/beamfit $(B)/beam_truth ## measure: diagnose the hidden cases and judge it [CASES='h08 subtle tip_mass --open' PAGE=]
	@tools/deps.sh build test
	@python3 -B tests/hidden/run.py --build $(B) --work $(HIDDEN) --jobs $(JOBS) $(CASES) $(PAGE:%=--page %)
SEED ?= 1
drawn: $(B)/beamfit $(B)/beam_truth ## measure: diagnose cases drawn at random, with and without the truth in the catalogue [SEED=1]
	@tools/deps.sh build test
	@python3 -B tests/hidden/draw.py --build $(B) --jobs $(JOBS) $(SEED) $(HIDDEN)/drawn$(SEED)
	-@python3 -B tests/hidden/run.py --build $(B) --work $(HIDDEN)/drawn$(SEED) --drawn $(HIDDEN)/drawn$(SEED) --jobs $(JOBS)
	@python3 -B tests/hidden/run.py --build $(B) --work $(HIDDEN)/drawn$(SEED) --drawn $(HIDDEN)/drawn$(SEED) --without-truth
false-alarms: $(B)/beamfit $(B)/beam_truth ## measure: diagnose sets that hide nothing under coloured noise [N=200 PAGE=]
	@python3 -B tests/hidden/false_alarms.py --build $(B) --work $(HIDDEN)/false_alarms --jobs $(JOBS) $(PAGE:%=--page %) $(N)
# Cases and answers are kept below CALIBRATE: the same command goes on where it was interrupted.
CALIBRATE ?= build/calibrate
calibrate: $(B)/beamfit $(B)/beam_truth ## measure: draw imperfect rigs, diagnose, fit the probabilities; table and page [SEED='1 2' N=200 JOBS=2 UPDATE=]
	@tools/deps.sh build test
	@python3 -B tests/calibrate/run.py --build $(B) --work $(CALIBRATE) --jobs $(JOBS) --number $(N) --seed $(SEED)
	@python3 -B tests/calibrate/perfect.py --build $(B) --work $(CALIBRATE) --records $(B)/hidden
	@python3 -B tests/calibrate/fit.py --work $(CALIBRATE) --seeds 0 $(SEED) $(UPDATE:%=--update)
drawn-imperfect: JUDGED = $(if $(filter file,$(origin SEED)),101,$(SEED))
drawn-imperfect: $(B)/beamfit $(B)/beam_truth ## measure: judge diagnose and its probabilities on imperfect rigs that calibrated nothing [SEED=101 N=200 JOBS=2]
	@tools/deps.sh build test
	@python3 -B tests/calibrate/run.py --build $(B) --work $(CALIBRATE) --jobs $(JOBS) --number $(N) --seed $(JUDGED)
	@python3 -B tests/calibrate/fit.py --judge --work $(CALIBRATE) --number $(N) --seeds $(JUDGED)
yardstick: $(B)/beamfit $(B)/beam_truth ## measure: the judged noise against what true models leave, on rigs whose force has noise [SEED=1 N=200 PAGE=]
	@tools/deps.sh build test
	@python3 -B tests/calibrate/yardstick.py --build $(B) --work $(B)/yardstick --jobs $(JOBS) --seed $(SEED) --number $(N) $(PAGE:%=--page %)
# Recordings of ../shared/data/real; answers are kept below MEASURED. SETS: names of tests/measured/sets.py.
MEASURED ?= build/measured
SETS ?=
measured: $(B)/beamfit ## measure: the bench of measured beams; its table becomes docs/results/measured.md [SETS='unb_2 strip']
	@tools/deps.sh build test
	@python3 -B tests/measured/run.py --build $(B) --work $(MEASURED) --page docs/results/measured.md $(SETS)
spectra: $(B)/beamfit $(B)/beam_truth ## measure: a beam from responses, spectra without phase, lists; coverage of intervals; docs/results/spectra.md [N=200]
	@tools/deps.sh build test
	@python3 -B tests/spectra/run.py --build $(B) --work $(B)/spectra --page docs/results/spectra.md $(N)
# Units, their records and the results are kept below FLEET.
FLEET ?= build/fleet
UNITS ?= 200
RANKS ?= 1 2
KILLS ?= 50
PARTS ?= ranks kills growth
fleet-bench: $(B)/beamfit $(MPI) $(B)/beam_truth ## measure: a drawn fleet on ranks of MPI; its page becomes docs/results/fleet.md [UNITS=200 RANKS='1 2' KILLS=50 PARTS='kills growth']
	@python3 -B tests/fleet/bench.py --build $(B) --work $(FLEET) --units $(UNITS) --ranks $(RANKS) --kills $(KILLS) --jobs $(JOBS) --parts $(PARTS) --page docs/results/fleet.md
RECORDS ?= 300 1200
many-bench: $(B)/beamfit $(MPI) $(B)/beam_truth ## measure: one model fitted to many records on ranks of MPI; its page becomes docs/results/many_records.md [RECORDS='300 1200' RANKS='1 2']
	@python3 -B tests/fleet/many.py --build $(B) --work $(B)/many --records $(RECORDS) --ranks $(RANKS) --page docs/results/many_records.md
SAMPLES ?= 100000 1000000 10000000
LONG_PAGE ?= $(B)/long_records.md
long-bench: $(B)/beamfit ## measure: time and memory of simulate, compare, fit on long recordings; its page is LONG_PAGE [SAMPLES='100000 1000000 10000000']
	@tests/bench/long.sh $(B) $(B)/long $(LONG_PAGE) $(SAMPLES)
own-effect: $(B)/beamfit $(B)/libbeamf.a $(B)/beam_truth ## test: a user's effect in a copy of the tree, built and diagnosed (docs/own_effect.md)
	@tools/own_effect.sh $(B)
BOARD  ?= host
HIDES  ?= mass
MOVING ?= 0
OFFSET_CODES ?= 0
LIVE_host := $(B)/board_host
LIVE_stm32f405 := $(B)/firmware_stm32f405.elf $(B)/stm32f405.so
live-demo: $(B)/beamfit $(B)/beam_truth $(LIVE_$(BOARD)) ## test: a board with a wrong model, from its alarm to the noise (docs/live_demo.md) [BOARD=stm32f405 HIDES=spring MOVING=1 OFFSET_CODES=6]
	@tools/live_demo.sh $(B) $(B)/live_demo $(BOARD) $(HIDES) $(MOVING) $(OFFSET_CODES)
LOAD ?= 0
conformance: $(B)/beamfit $(LIVE_$(BOARD)) ## test: pyxcp and pya2ldb (PyPI, pinned) on a board, pyuff on a frequency response [BOARD=stm32f405 LOAD=0.8]
	@tools/deps.sh build test
	@tests/conformance/run.sh $(B) $(BOARD) $(LOAD)
SHARE ?= 1
$(B)/survival_steps: tests/survival/steps.c $(B)/libbeamt.a
	$(call say,$@)$(CC) $(LIBFLAGS) $^ -lm -o $@
survival: $(B)/beamfit $(LIVE_$(BOARD)) $(B)/survival_steps ## test: what a board must survive [SHARE=0.02 CASES='kills noise' BOARD=stm32f405]
	@python3 -B tests/survival/run.py --build $(B) --board $(BOARD) --share $(SHARE) $(CASES)
WHAT ?=
results: ## documents: docs/results/NAME.md for each NAME of WHAT [WHAT='bench board_checks boards desk experiments fuzz journey live_demo survival survival_stm32f405 wrong_inputs']
	@tools/results_page.sh $(WHAT)
constants: ## documents: docs/constants.md from the sources of the host
	@tools/constants.py
docs: ## check: links of the pages, pages named in sources, docs/constants.md against the sources
	@tools/docs_check.sh
experiments: $(B)/beamfit $(B)/beam_truth ## documents: estimates against the dimension N, and EI(x) in pieces
	@tools/experiments.sh $(B) $(B)/experiments
data: $(B)/beam_truth ## documents: data/paper, simulated recordings with the paper's values
	$(B)/beam_truth data/paper/b1tapih.txt data/paper/b1taoiv.txt -o data/paper
	cd data && sha256sum paper/*.csv > SHA256SUMS
fuzz: ## test: hostile bytes for every reader, FUZZ_SECONDS=20 for each
	+@FUZZ_SECONDS=$(FUZZ_SECONDS) JOBS=$(JOBS) tools/fuzz.sh $(B)/fuzz

# ---- Installation ----
# Where Debian's shells look: zsh in vendor-completions for packages, in site-functions for what a person installs.
BASH_COMPLETIONS = $(PREFIX)/share/bash-completion/completions
ZSH_COMPLETIONS  = $(PREFIX)/share/zsh/$(if $(filter /usr,$(PREFIX)),vendor-completions,site-functions)
# Public headers; and the sources, to be compiled for a controller (packaging/lib).
PUBLIC_H := $(addprefix lib/beam,.h _effect.h _image.h _image_file.h _language.h _math.h _real.h _wire.h)
SHARED    = $(DESTDIR)$(PREFIX)/share/beamfit
PC        = sed -e 's|@PREFIX@|$(PREFIX)|; s|@VERSION@|$(VERSION)|; s|@NAME@|$(1)|; s|@LIB@|$(2)|; s|@DEFINES@|$(3)|; s|@WHAT@|$(4)|' \
    packaging/beamfit.pc.in > $(DESTDIR)$(PREFIX)/lib/pkgconfig/$(1).pc
install: all $(B)/gen/effects_table.c $(B)/gen/galerkin_tables.c ## install: program, libraries, headers, pkg-config files, sources for a controller, manual pages, completion under DESTDIR/PREFIX
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/include/beamfit \
	    $(DESTDIR)$(PREFIX)/share/man/man1 $(SHARED)/lib/effects $(SHARED)/examples/cortex_m4 \
	    $(DESTDIR)$(BASH_COMPLETIONS) $(DESTDIR)$(ZSH_COMPLETIONS)
	install -m 755 $(B)/beamfit $(MPI) $(DESTDIR)$(PREFIX)/bin/
	install -m 644 $(B)/libbeam.a $(B)/libbeamf.a $(B)/libbeamt.a $(DESTDIR)$(PREFIX)/lib/
	install -m 644 $(PUBLIC_H) $(DESTDIR)$(PREFIX)/include/beamfit/
	$(call PC,beamfit,-lbeam,,double precision)
	$(call PC,beamfit-float,-lbeamf, -DBEAM_FLOAT,single precision)
	$(call PC,beamfit-target,-lbeamt, -DBEAM_FLOAT -DBEAM_TARGET,as a controller computes it)
	install -m 644 lib/*.c lib/*.h lib/LICENSE packaging/lib/* $(B)/gen/effects_table.c $(B)/gen/galerkin_tables.c $(SHARED)/lib/
	install -m 644 lib/effects/*.c $(SHARED)/lib/effects/
	install -m 644 firmware/examples/cortex_m4/* $(SHARED)/examples/cortex_m4/
	install -m 644 $(B)/man/*.1 $(DESTDIR)$(PREFIX)/share/man/man1/
	install -m 644 $(B)/completion/bash $(DESTDIR)$(BASH_COMPLETIONS)/beamfit
	install -m 644 $(B)/completion/zsh $(DESTDIR)$(ZSH_COMPLETIONS)/_beamfit
deb: all ## install: Debian packages beamfit and libbeam-dev, in build/
	@tools/deb.sh $(B) $(VERSION)
# The system that is made once stays below DEB_ROOT; the packages go into a copy of it.
DEB_ROOT ?= $(B)/deb_root
deb-root: deb ## test: both packages in a Debian of its own (debootstrap; root): doctor, a fit, a program, man pages [MIRROR=]
	@tools/deb_root.sh $(B) $(DEB_ROOT) $(VERSION)
uninstall: ## install: remove what install put there
	rm -f $(DESTDIR)$(PREFIX)/bin/beamfit $(DESTDIR)$(PREFIX)/bin/beamfit-fleet $(addprefix $(DESTDIR)$(PREFIX)/lib/,libbeam.a libbeamf.a libbeamt.a) \
	    $(addprefix $(DESTDIR)$(PREFIX)/lib/pkgconfig/,beamfit.pc beamfit-float.pc beamfit-target.pc) $(DESTDIR)$(PREFIX)/share/man/man1/beamfit.1 \
	    $(DESTDIR)$(PREFIX)/share/man/man1/beamfit-*.1 $(DESTDIR)$(BASH_COMPLETIONS)/beamfit $(DESTDIR)$(ZSH_COMPLETIONS)/_beamfit
	rm -rf $(DESTDIR)$(PREFIX)/include/beamfit $(SHARED)

clean: ## build: remove everything built
	rm -rf build

help: ## build: this list
	@tools/help.sh $(MAKEFILE_LIST)

DEPFILES = $(FW_OBJ:.o=.d) $(BOARD_HOST_OBJ:.o=.d) $(SHADOWS:.o=.d) $(BEAM_SHADOWS:.o=.d) $(LIB_OBJ:.o=.d) $(FLOAT_OBJ:.o=.d) $(TARGET_OBJ:.o=.d) $(CPLX_OBJ:.o=.d) $(HOST_OBJ:.o=.d) $(B)/host/main.d $(B)/host/cmd/fleet_mpi.d \
           $(UNIT_TESTS:%=%.d) $(SYSTEM_TESTS:%=%.d) $(SYSTEM_COMMON:.o=.d) $(TRUTH_OBJ:.o=.d)
-include $(wildcard $(DEPFILES))
.PHONY: fleet-bench many-bench long-bench calibrate drawn-imperfect yardstick measured spectra live-demo conformance survival results constants docs
.PHONY: FORCE all tests unit test test-both demo deps lint layers size coverage bench hidden drawn false-alarms own-effect experiments data fuzz install deb deb-root uninstall clean help
