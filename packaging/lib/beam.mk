# SPDX-License-Identifier: MIT
# The library's sources for a makefile of your own, in a controller's sizes. Include it, compile BEAM_SRC with BEAM_FLAGS, and your own files that
# include beam.h or beam_image.h with BEAM_DEFINES and BEAM_INCLUDE. firmware/examples/cortex_m4 shows it.
BEAM_DIR     := $(patsubst %/,%,$(dir $(lastword $(MAKEFILE_LIST))))
BEAM_SRC     := $(wildcard $(BEAM_DIR)/*.c $(BEAM_DIR)/effects/*.c)
BEAM_INCLUDE := -I$(BEAM_DIR)
BEAM_DEFINES := -DBEAM_FLOAT -DBEAM_TARGET
# Contraction off, or the controller rounds otherwise than the host and refuses every image: it was proved with other bits.
BEAM_FLAGS   := -std=c11 -O2 -ffp-contract=off -fno-math-errno -ffunction-sections -fdata-sections $(BEAM_DEFINES) $(BEAM_INCLUDE)
