// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/mapped_pages.h"

#include <cstdio>
#include <fstream>
#include <string>

#include <sys/mman.h>

namespace volcomp {

void forgetMappedPages(const std::filesystem::path& file)
{
    std::error_code code;
    const std::string name = std::filesystem::canonical(file, code).string();
    if (code) return;
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
        unsigned long from = 0, to = 0;
        if (line.size() < name.size()
            || line.compare(line.size() - name.size(), name.size(), name) != 0)
            continue;
        if (std::sscanf(line.c_str(), "%lx-%lx r--s", &from, &to) == 2)
            // The address was text. NOLINTNEXTLINE(performance-no-int-to-ptr)
            madvise(reinterpret_cast<void*>(from), to - from, MADV_DONTNEED);
    }
}

} // namespace volcomp
