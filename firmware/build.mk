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
FIRMWARE_BOARDS := stm32f405 mps2
FIRMWARE_SRC := $(wildcard firmware/*.c)
FIRMWARE_OBJ  = $(FIRMWARE_SRC:%.c=$(B)/arm/%.o) $(B)/arm/built_in_image.o
BOARD_OBJ     = $(patsubst %.c,$(B)/arm/%.o,$(wildcard firmware/board_$(1)/*.c))
FIRMWARE_ELF := $(FIRMWARE_BOARDS:%=$(B)/firmware_%.elf)
FIRMWARE_FLAGS = $(CROSS_FLAGS) -Ifirmware -isystem $(BEARSSL)/inc
$(B)/arm/firmware/%.o: firmware/%.c $(BEARSSL)/inc/bearssl_hash.h
	@mkdir -p $(@D)
	$(call say,$@)$(CROSS)gcc $(FIRMWARE_FLAGS) -fstack-usage -fcallgraph-info=su -MMD -MP -c $< -o $@
define firmware_elf
$(B)/firmware_$(1).elf: $(call BOARD_OBJ,$(1)) $(FIRMWARE_OBJ) $(BEARSSL_OBJ) $(B)/arm/libbeamt.a \
    firmware/board_$(1)/$(1).ld firmware/sections.ld
	$$(call say,$$@)$(CROSS)gcc $(CROSS_CPU) -nostartfiles --specs=nano.specs --specs=nosys.specs -Wl,--gc-sections \
	    -Wl,-Map=$$(@:.elf=.map) -Wl,--fatal-warnings -Tfirmware/board_$(1)/$(1).ld $$(filter %.o %.a,$$^) -lm -o $$@
endef
$(foreach board,$(FIRMWARE_BOARDS),$(eval $(call firmware_elf,$(board))))
firmware-elf: $(FIRMWARE_ELF)
firmware: ## build: cross-compile the firmware of every board; link maps beside the ELF files
	@tools/deps.sh build target
	$(SUBMAKE) firmware-elf
-include $(wildcard $(FIRMWARE_OBJ:.o=.d) $(foreach board,$(FIRMWARE_BOARDS),$(patsubst %.o,%.d,$(call BOARD_OBJ,$(board)))))
.PHONY: firmware firmware-elf
