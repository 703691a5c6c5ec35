// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/instruction_set.h"

namespace volcomp {

std::string instructionSet()
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f")) return "AVX-512";
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "AVX2";
    if (__builtin_cpu_supports("sse4.2")) return "SSE4.2";
    return "SSE2";
#else
    return "baseline";
#endif
}

} // namespace volcomp
