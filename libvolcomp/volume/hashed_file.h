// SPDX-License-Identifier: Apache-2.0
// A file to write, whose bytes are hashed on the way.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <streambuf>

namespace volcomp {

/// For a std::ostream. The hash is that of all that was written, in the order in which and in the
/// pieces by which it was written, so it is the same for the same calls.
class HashedFile : public std::streambuf {
public:
    /// Opens the file, or fails at the first byte written.
    explicit HashedFile(const std::filesystem::path& file);

    void startHash() { m_hash = kStart; } ///< forgets what was written so far
    std::array<std::uint64_t, 2> hash() const { return m_hash; }
    void close() { m_closed = m_file.close() != nullptr; }
    bool closed() const { return m_closed; } ///< without a failure

protected:
    int_type overflow(int_type c) override;
    std::streamsize xsputn(const char* bytes, std::streamsize count) override;
    pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode mode) override;
    pos_type seekpos(pos_type to, std::ios::openmode mode) override;
    int sync() override;

private:
    static constexpr std::array<std::uint64_t, 2> kStart{0x9e3779b97f4a7c15, 0xc2b2ae3d27d4eb4f};

    void add(const char* bytes, std::size_t count);

    std::filebuf m_file;
    std::array<std::uint64_t, 2> m_hash = kStart;
    bool m_closed = false;
};

} // namespace volcomp
