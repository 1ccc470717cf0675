# SPDX-License-Identifier: GPL-3.0-or-later
# Tests on emulated boards: tests/target/run.py drives them.
TARGET_BOARDS := netduinoplus2 mps2-an386
TARGET_FLAGS_netduinoplus2 := -DTARGET_COUNTS
TARGET_LINK = $(CROSS_CPU) -Wl,--gc-sections -nostartfiles --specs=rdimon.specs -Ltests/target

$(B)/replay_cases: tests/target/replay_cases.c tests/target/replay_case.h $(B)/libbeamt.a
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT -DBEAM_TARGET $(filter %.c %.a,$^) -lm -o $@
$(B)/replay_run: tests/target/replay_run.c tests/target/replay_case.h $(B)/libbeamt.a
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT -DBEAM_TARGET $(filter %.c %.a,$^) -lm -o $@
$(TARGET_BOARDS:%=$(B)/target_%_replay.elf): $(B)/target_%_replay.elf: tests/target/replay_run.c tests/target/start.c \
    tests/target/replay_case.h tests/target/%.ld tests/target/sections.ld $(B)/arm/libbeamt.a
	$(call say,$@)$(CROSS)gcc $(CROSS_FLAGS) $(TARGET_FLAGS_$*) $(TARGET_LINK) -Ttests/target/$*.ld $(filter %.c %.a,$^) -lm -o $@

$(B)/target_costs.elf: tests/target/cost_run.c $(B)/arm/firmware/track.o tests/target/start.c tests/target/netduinoplus2.ld tests/target/sections.ld $(B)/arm/libbeamt.a
	$(call say,$@)$(CROSS)gcc $(CROSS_FLAGS) $(TARGET_FLAGS_netduinoplus2) -Ifirmware $(TARGET_LINK) -Ttests/target/netduinoplus2.ld $(filter %.c %.o %.a,$^) -lm -o $@

# The devices that QEMU's netduinoplus2 lacks, as a plugin of QEMU 7.2
$(B)/stm32f405.so: $(wildcard tests/target/plugin/*.c) $(wildcard tests/target/plugin/*.h)
	$(call say,$@)$(CC) $(STD) $(OPT) $(filter-out -Wpedantic,$(WARN)) -fPIC -fvisibility=hidden -shared $(filter %.c,$^) -ldl -o $@

# The firmware's store on the board's own driver, without the rest
$(B)/target_store_%.elf: tests/target/store_run.c tests/target/semihost.h $(B)/arm/firmware/store.o $(B)/arm/libbeamt.a \
    firmware/sections.ld
	$(call say,$@)$(CROSS)gcc $(FIRMWARE_FLAGS) -nostartfiles --specs=nano.specs --specs=nosys.specs -Wl,--gc-sections \
	    -Tfirmware/board_$*/$*.ld $(filter %.c %.o %.a,$^) -o $@
$(foreach board,$(FIRMWARE_BOARDS),$(eval $(B)/target_store_$(board).elf: $(call BOARD_OBJ,$(board)) firmware/board_$(board)/$(board).ld))

# A board's driver alone: on each board, on the PC's, and the template's on a part of the PC
$(B)/target_driver_%.elf: tests/driver/driver_run.c tests/target/semihost.h firmware/sections.ld
	$(call say,$@)$(CROSS)gcc $(FIRMWARE_FLAGS) -Itests/target -nostartfiles --specs=nano.specs --specs=nosys.specs -Wl,--gc-sections \
	    -Tfirmware/board_$*/$*.ld $(filter %.c %.o %.a,$^) -o $@
$(foreach board,$(FIRMWARE_BOARDS),$(eval $(B)/target_driver_$(board).elf: $(call BOARD_OBJ,$(board)) firmware/board_$(board)/$(board).ld))
$(B)/driver_host: tests/driver/driver_run.c $(patsubst %.c,$(B)/%.o,$(wildcard firmware/board_host/*.c))
	$(call say,$@)$(CC) $(FW_FLAGS) -DDRIVER_ON_PC -Dmain=firmware_main -Wno-missing-prototypes $^ -o $@
$(B)/driver_template: tests/driver/driver_run.c tests/driver/part_pc.c $(filter-out %/start.c,$(wildcard firmware/board_template/*.c))
	@mkdir -p $(B)/driver
	$(call say,$@)$(CC) $(FW_FLAGS) -Ifirmware/board_template -DDRIVER_ON_PC -Dmain=driver_main -Wno-missing-prototypes -c $< -o $(B)/driver/run.o && \
	    $(CC) $(FW_FLAGS) -Ifirmware/board_template $(B)/driver/run.o $(filter-out $<,$^) -o $@

# The firmware's sampler on this machine, and where the board keeps what it computed
$(B)/replay_live: tests/target/replay_live.c $(B)/firmware/sampler.o $(B)/firmware/health.o $(B)/firmware/track.o $(B)/libbeamt.a
	$(call say,$@)$(CC) $(LIBFLAGS) -DBEAM_FLOAT -DBEAM_TARGET -Ifirmware $^ -lm -o $@
$(B)/arm/layout.o: tests/target/layout.c $(wildcard lib/*.h) firmware/board.h firmware/app.h firmware/pages.h firmware/sampler.h firmware/daq.h firmware/xcp.h firmware/sxi.h
	$(call say,$@)$(CROSS)gcc $(FIRMWARE_FLAGS) -c $< -o $@

# Unit tests of lib/ on an emulated board: the tests of tests/unit as they are, a small cmocka, the library in every arithmetic
UNIT_ON_TARGET := $(filter-out test_effects_docs test_effects_derivatives test_beam_factor,$(notdir $(basename $(wildcard tests/unit/test_beam_*.c tests/unit/test_effects*.c))))
# newlib's complex.h lacks CMPLX
UNIT_FLAGS = $(CROSS_CPU) -std=gnu11 -O2 -ffp-contract=off -ffunction-sections -fdata-sections -Ilib -Itests -Itests/target/shim \
    '-DCMPLX(re,im)=__builtin_complex((double)(re),(double)(im))'
UNIT_double := $(UNIT_FLAGS)
UNIT_float = $(UNIT_FLAGS) -DBEAM_FLOAT
UNIT_complex = $(UNIT_FLAGS) -DBEAM_COMPLEX
define unit_objects
$(B)/arm/$(1)/%.o: %.c
	@mkdir -p $$(@D)
	$$(call say,$$@)$(CROSS)gcc $$(UNIT_$(1)) -MMD -MP -c $$< -o $$@
$(B)/arm/$(1)/%.o: $(B)/gen/%.c
	@mkdir -p $$(@D)
	$$(call say,$$@)$(CROSS)gcc $$(UNIT_$(1)) -MMD -MP -c $$< -o $$@
endef
$(foreach kind,double float complex,$(eval $(call unit_objects,$(kind))))
UNIT_OBJ := $(patsubst $(B)/double/%,$(B)/arm/double/%,$(LIB_OBJ) $(B)/double/tests/beam_case.o $(B)/double/tests/newmark.o $(B)/double/tests/effects_shadow.o) \
    $(patsubst $(B)/float/%,$(B)/arm/float/%,$(FLOAT_OBJ) $(B)/float/tests/beam_shadow.o $(B)/float/tests/effects_shadow.o) \
    $(patsubst $(B)/complex/%,$(B)/arm/complex/%,$(CPLX_OBJ) $(B)/complex/tests/effects_shadow.o) \
    $(B)/arm/double/tests/target/shim/cmocka.o
$(B)/arm/libunit.a: $(UNIT_OBJ)
	$(call say,$@)rm -f $@; $(CROSS)ar rcs $@ $^
$(B)/target_unit_%.elf: $(B)/arm/double/tests/unit/%.o $(B)/arm/libunit.a $(B)/arm/libbeamt.a tests/target/start.c tests/target/mps2-an386.ld tests/target/sections.ld
	$(call say,$@)$(CROSS)gcc $(UNIT_FLAGS) $(TARGET_LINK) -Ttests/target/mps2-an386.ld $(filter %.c %.o %.a,$^) -lm -o $@

TARGET_PROGRAMS := $(FIRMWARE_ELF) $(B)/arm/layout.o $(B)/replay_live $(B)/beamfit $(B)/beam_truth $(B)/replay_cases \
    $(B)/replay_run $(B)/stm32f405.so $(TARGET_BOARDS:%=$(B)/target_%_replay.elf) $(B)/target_costs.elf $(FIRMWARE_BOARDS:%=$(B)/target_store_%.elf) $(FIRMWARE_BOARDS:%=$(B)/target_driver_%.elf) $(B)/driver_host $(B)/driver_template \
    $(UNIT_ON_TARGET:%=$(B)/target_unit_%.elf)
target: ## test: emulated boards: bits, instructions, power cuts, kills, the product [NAMES='bits counts']
	@tools/deps.sh build test target
	$(SUBMAKE) target-programs
	@python3 -B tests/target/run.py --build $(B) $(NAMES)
target-programs: $(TARGET_PROGRAMS)
target-counts: $(B)/replay_cases $(B)/replay_run $(TARGET_BOARDS:%=$(B)/target_%_replay.elf)
-include $(wildcard $(UNIT_OBJ:.o=.d) $(UNIT_ON_TARGET:%=$(B)/arm/double/tests/unit/%.d))
.PHONY: target target-programs target-counts
