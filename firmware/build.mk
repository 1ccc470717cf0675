# SPDX-License-Identifier: MIT
# Cross builds: lib/ as a controller carries it, and the firmware of each board.
CROSS      ?= arm-none-eabi-
CROSS_CPU  := -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard
CROSS_STD  := -std=c11 -DBEAM_FLOAT -DBEAM_TARGET -O2 -g -ffp-contract=off -fno-math-errno -ffunction-sections -fdata-sections
CROSS_FLAGS = $(CROSS_CPU) $(CROSS_STD) $(WARN) -Ilib

CROSS_LIB_OBJ = $(LIB_SRC:%.c=$(B)/arm/%.o) $(B)/arm/effects_table.o $(B)/arm/galerkin_tables.o
$(B)/arm/%.o: $(B)/gen/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CROSS)gcc $(CROSS_FLAGS) -fstack-usage -fcallgraph-info -MMD -MP -c $< -o $@
$(B)/arm/lib/%.o: lib/%.c
	@mkdir -p $(@D)
	$(call say,$@)$(CROSS)gcc $(CROSS_FLAGS) -fstack-usage -fcallgraph-info -MMD -MP -c $< -o $@
$(B)/arm/libbeamt.a: $(CROSS_LIB_OBJ)
	$(call say,$@)rm -f $@; $(CROSS)ar rcs $@ $^

-include $(wildcard $(CROSS_LIB_OBJ:.o=.d))
