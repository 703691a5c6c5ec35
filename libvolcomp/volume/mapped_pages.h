// SPDX-License-Identifier: Apache-2.0
// Memory that a mapped file takes.
#pragma once

#include <filesystem>

namespace volcomp {

/// Takes the pages of a file that are mapped for reading out of this process's memory, wherever
/// they are mapped. They are read again when they are touched; the system's cache keeps them as
/// long as it has room. OpenVDB maps a file for delayed reading and does not say where, so this
/// looks into /proc/self/maps; where there is no such file, it does nothing.
void forgetMappedPages(const std::filesystem::path& file);

} // namespace volcomp
