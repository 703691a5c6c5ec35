// SPDX-License-Identifier: Apache-2.0
// The bytes of a scene file, which may come through a pipe. Private to the reader.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace volcomp {

/// Returns the number of the open stream that a path means: 0 for /dev/stdin, N for /dev/fd/N and
/// /proc/self/fd/N; -1 for every other path.
int streamOf(const std::filesystem::path& file);

/// Returns all bytes of a regular file, or of the stream that streamOf() names, which is read to
/// its end. It waits for no FIFO. Throws Error if the file cannot be read, is a directory, a FIFO
/// or a device, or holds more than `most` bytes.
std::string readSceneText(const std::filesystem::path& file, std::size_t most);

} // namespace volcomp
