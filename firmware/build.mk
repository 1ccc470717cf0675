# SPDX-License-Identifier: MIT
# Cross builds: lib/ as a controller carries it, and the firmware of each board.
CROSS      ?= arm-none-eabi-
CROSS_CPU  := -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard
CROSS_STD  := -std=c11 -DBEAM_FLOAT -DBEAM_TARGET -O2 -g -ffp-contract=off -fno-math-errno -ffunction-sections -fdata-sections
CROSS_FLAGS = $(CROSS_CPU) $(CROSS_STD) $(WARN) -Ilib

CROSS_LIB_OBJ = $(LIB_SRC:%.c=$(B)/arm/%.o) $(B)/arm/effects_table.o $(B)/arm/galerkin_tables.o
$(B)/arm/%.o: $(B)/gen/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CROSS)gcc $(CROSS_FLAGS) -fstack-usage -fcallgraph-info=su -MMD -MP -c $< -o $@
$(B)/arm/lib/%.o: lib/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CROSS)gcc $(CROSS_FLAGS) -fstack-usage -fcallgraph-info=su -MMD -MP -c $< -o $@
$(B)/arm/libbeamt.a: $(CROSS_LIB_OBJ)
	$(call say,$@)rm -f $@; $(CROSS)ar rcs $@ $^

-include $(wildcard $(CROSS_LIB_OBJ:.o=.d))

# ---- BearSSL's SHA-256 for the controller: fetched as source, not kept ----
BEARSSL     := $(B)/bearssl/bearssl-0.6
BEARSSL_SRC := hash/sha2small.c codec/dec32be.c codec/enc32be.c
BEARSSL_OBJ  = $(BEARSSL_SRC:%.c=$(B)/arm/bearssl/%.o)
$(BEARSSL)/inc/bearssl_hash.h: tools/bearssl.sh
	$(call say,$@)tools/bearssl.sh $(B)/bearssl && touch $@
$(BEARSSL_OBJ): $(B)/arm/bearssl/%.o: $(BEARSSL)/inc/bearssl_hash.h
	@mkdir -p $(@D)
	$(call say,$@)$(CROSS)gcc $(CROSS_CPU) -std=c99 -Os -ffunction-sections -fdata-sections -I$(BEARSSL)/inc -I$(BEARSSL)/src \
	    -fstack-usage -fcallgraph-info=su -c $(BEARSSL)/src/$*.c -o $@

# ---- Firmware: what every board shares, and each board's own ----
# Every folder firmware/board_NAME with a linker script NAME.ld is a controller's board; docs/porting.md.
FIRMWARE_BOARDS := $(filter-out template,$(patsubst %.ld,%,$(notdir $(wildcard firmware/board_*/*.ld))))
# A board may take the sources of another one, with flags of its own: BOARD_FROM_NAME, BOARD_FLAGS_NAME in its board.mk.
-include $(wildcard firmware/board_*/board.mk)
# Settings of a board for this build, e.g. BOARD_SETTINGS='-DBOARD_SAMPLE_HZ=2000' BUILT_IN_HZ=2000
BOARD_SETTINGS ?=
FIRMWARE_SRC := $(wildcard firmware/*.c)
FIRMWARE_OBJ  = $(FIRMWARE_SRC:%.c=$(B)/arm/%.o) $(B)/arm/built_in_image.o
BOARD_DIR     = firmware/board_$(or $(BOARD_FROM_$(1)),$(1))
BOARD_OBJ     = $(patsubst $(BOARD_DIR)/%.c,$(B)/arm/firmware/board_$(1)/%.o,$(wildcard $(BOARD_DIR)/*.c))
FIRMWARE_ELF := $(FIRMWARE_BOARDS:%=$(B)/firmware_%.elf)
FIRMWARE_FLAGS = $(CROSS_FLAGS) $(BOARD_SETTINGS) -Ifirmware -isystem $(BEARSSL)/inc
$(B)/arm/firmware/%.o: firmware/%.c $(BEARSSL)/inc/bearssl_hash.h
	@mkdir -p $(@D)
	$(call say,$@)$(CROSS)gcc $(FIRMWARE_FLAGS) -fstack-usage -fcallgraph-info=su -MMD -MP -c $< -o $@
define borrowed_objects
$(B)/arm/firmware/board_$(1)/%.o: firmware/board_$(BOARD_FROM_$(1))/%.c $(BEARSSL)/inc/bearssl_hash.h
	@mkdir -p $$(@D)
	$$(call say,$$@)$(CROSS)gcc $$(FIRMWARE_FLAGS) $(BOARD_FLAGS_$(1)) -fstack-usage -fcallgraph-info=su -MMD -MP -c $$< -o $$@
endef
$(foreach board,$(FIRMWARE_BOARDS),$(if $(BOARD_FROM_$(board)),$(eval $(call borrowed_objects,$(board)))))
define firmware_elf
$(B)/firmware_$(1).elf: $(call BOARD_OBJ,$(1)) $(FIRMWARE_OBJ) $(BEARSSL_OBJ) $(B)/arm/libbeamt.a \
    firmware/board_$(1)/$(1).ld firmware/sections.ld
	$$(call say,$$@)$(CROSS)gcc $(CROSS_CPU) -nostartfiles --specs=nano.specs --specs=nosys.specs -Wl,--gc-sections \
	    -Wl,-Map=$$(@:.elf=.map) -Wl,--fatal-warnings -Tfirmware/board_$(1)/$(1).ld $$(filter %.o %.a,$$^) -lm -o $$@
endef
$(foreach board,$(FIRMWARE_BOARDS),$(eval $(call firmware_elf,$(board))))
# The template of a board is compiled, and has no part to be linked with.
firmware-elf: $(FIRMWARE_ELF) $(patsubst %.c,$(B)/arm/%.o,$(wildcard firmware/board_template/*.c))
firmware: ## build: cross-compile the firmware of every board; link maps beside the ELF files
	@tools/deps.sh build target
	$(SUBMAKE) firmware-elf
-include $(wildcard $(FIRMWARE_OBJ:.o=.d) $(foreach board,$(FIRMWARE_BOARDS),$(patsubst %.o,%.d,$(call BOARD_OBJ,$(board)))))
.PHONY: firmware firmware-elf
