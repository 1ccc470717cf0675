# SPDX-License-Identifier: MIT
# QEMU's mps2-an500, a Cortex-M7: the sources of board_mps2, its PSRAM elsewhere.
BOARD_FROM_an500  := mps2
BOARD_FLAGS_an500 := -DPSRAM=0x60000000u
