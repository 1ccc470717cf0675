# SPDX-License-Identifier: GPL-3.0-or-later
# beamfit — `make help` lists the targets.
SHELL := /bin/bash
.DEFAULT_GOAL := all

B      ?= build
CC     ?= gcc
OPT    ?= -O2 -g
WARN   := -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wstrict-prototypes -Wmissing-prototypes
CFLAGS ?=
STD    := -std=c11 -D_GNU_SOURCE
PKGS   := nlopt libserialport libfyaml jansson matio fftw3 lapacke openblas sndfile
INC    := -Ilib -Ihost -I/usr/include/suitesparse -I/usr/include/arpack $(shell pkg-config --cflags $(PKGS) 2>/dev/null)
LIBS   := $(shell pkg-config --libs $(PKGS) 2>/dev/null) -lcholmod -larpack -lbearssl -lpthread -lm
ALLFLAGS = $(STD) $(OPT) $(WARN) $(INC) $(CFLAGS)

LIB_SRC  := $(wildcard lib/*.c) $(wildcard lib/effects/*.c)
HOST_SRC := $(filter-out host/main.c,$(wildcard host/*.c)) $(wildcard host/cmd/*.c)
GEN_SRC  := $(B)/gen/effects_table.c
LIB_OBJ   = $(LIB_SRC:%.c=$(B)/double/%.o) $(B)/double/effects_table.o
FLOAT_OBJ = $(LIB_SRC:%.c=$(B)/float/%.o) $(B)/float/effects_table.o
CPLX_OBJ  = $(patsubst %.c,$(B)/complex/%.o,$(wildcard lib/effects/*.c)) $(B)/complex/effects_table.o
HOST_OBJ  = $(HOST_SRC:%.c=$(B)/%.o)

all: $(B)/beamfit ## build the program and the libraries

$(B)/gen/effects_table.c: tools/effects_table.sh $(wildcard lib/effects/*.c)
	@mkdir -p $(@D)
	sh tools/effects_table.sh lib/effects > $@
$(B)/double/effects_table.o: $(GEN_SRC)
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -ffp-contract=off -c $< -o $@
$(B)/float/effects_table.o: $(GEN_SRC)
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -ffp-contract=off -DBEAM_FLOAT -c $< -o $@
$(B)/complex/effects_table.o: $(GEN_SRC)
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -DBEAM_COMPLEX -c $< -o $@
$(B)/double/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -ffp-contract=off -MMD -c $< -o $@
$(B)/float/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -ffp-contract=off -DBEAM_FLOAT -MMD -c $< -o $@
$(B)/complex/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -DBEAM_COMPLEX -MMD -c $< -o $@
$(B)/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -MMD -c $< -o $@

$(B)/libbeam.a: $(LIB_OBJ)
	ar rcs $@ $^
$(B)/libbeamf.a: $(FLOAT_OBJ)
	ar rcs $@ $^
$(B)/libbeamc.a: $(CPLX_OBJ)
	ar rcs $@ $^
$(B)/libhost.a: $(HOST_OBJ)
	rm -f $@; ar rcs $@ $^
$(B)/beamfit: $(B)/host/main.o $(B)/libhost.a $(B)/libbeam.a
	$(CC) $(OPT) $(CFLAGS) $^ $(LIBS) -o $@

# unit tests: tests/unit/test_x.c -> $(B)/tests/test_x
TESTS := $(patsubst tests/unit/%.c,$(B)/tests/%,$(wildcard tests/unit/test_*.c))
$(B)/tests/%: tests/unit/%.c $(B)/libhost.a $(B)/libbeam.a $(B)/libbeamf.a $(B)/libbeamc.a
	@mkdir -p $(@D)
	$(CC) $(ALLFLAGS) -Itests -MMD $< $(B)/libhost.a $(B)/libbeam.a $(B)/libbeamf.a $(B)/libbeamc.a $(LIBS) -lcmocka -o $@
unit: $(TESTS) ## build and run the unit tests
	@for t in $(TESTS); do $$t || exit 1; done

clean: ## remove everything built
	rm -rf build

-include $(shell find $(B) -name '*.d' 2>/dev/null)
.PHONY: all unit clean
