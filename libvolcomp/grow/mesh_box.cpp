// SPDX-License-Identifier: Apache-2.0
#include "volcomp/grow/mesh_box.h"

namespace volcomp {

bool matches(std::string_view pattern, std::string_view name)
{
    std::size_t p = 0, n = 0, star = pattern.npos, tried = 0;
    while (n < name.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++;
            tried = n;
        } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
            ++p, ++n;
        } else if (star != pattern.npos) {
            p = star + 1;
            n = ++tried;
        } else {
            return false;
        }
    }
    while (p < pattern.size() && pattern[p] == '*') ++p;
    return p == pattern.size();
}

} // namespace volcomp
