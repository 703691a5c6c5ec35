// SPDX-License-Identifier: Apache-2.0
// The instruction sets for which the march is compiled beside the architecture's baseline. Included
// before anything of Highway.
#pragma once

// Of x86's SSE4 and AVX2: vectors wider than four numbers have no use here. The others that are
// left out have vectors without a fixed size, of which no arrays can be made.
#define HWY_DISABLED_TARGETS                                                                       \
    (HWY_SSSE3 | HWY_AVX3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
