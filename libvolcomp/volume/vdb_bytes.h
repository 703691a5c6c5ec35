// SPDX-License-Identifier: Apache-2.0
// The bytes of a VDB file, read with a check of every length (vdb_check.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>

namespace volcomp {

/// A file in memory as it is on the disk. Only what was looked at lately counts as memory.
class MappedFile {
public:
    /// Throws Error if the file is missing, empty, no regular file, or cannot be read.
    explicit MappedFile(const std::filesystem::path& file);
    ~MappedFile();
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;

    const std::filesystem::path& path() const { return m_path; }
    const std::byte* data() const { return m_data; }
    std::size_t size() const { return m_size; }
    /// Lets the pages before `end` go, which were looked at; they can be looked at again.
    void forget(std::size_t end) const;

private:
    std::filesystem::path m_path;
    std::byte* m_data = nullptr;
    std::size_t m_size = 0;
    mutable std::size_t m_forgotten = 0;
};

/// A place in the file that moves forward. What would go beyond the end is an Error that names the
/// file, the grid and the byte.
class VdbBytes {
public:
    explicit VdbBytes(const MappedFile& file, std::string grid = {})
        : m_file(file), m_grid(std::move(grid))
    {
    }

    std::size_t at() const { return m_at; }
    std::size_t left() const { return m_file.size() - m_at; }
    /// To any byte of the file, or to its end.
    void moveTo(std::int64_t at, const char* what)
    {
        if (at < 0 || static_cast<std::uint64_t>(at) > m_file.size())
            fail(std::string("the position of ") + what + " inside of the file",
                 std::to_string(at));
        m_at = static_cast<std::size_t>(at);
    }

    /// The place itself; `bytes` of them may be looked at. Moves on.
    const std::byte* skip(std::uint64_t bytes)
    {
        if (bytes > left()) failAtEnd(bytes);
        const std::byte* const here = m_file.data() + m_at;
        m_at += bytes;
        if (m_at >= m_forget_at) forget();
        return here;
    }
    template <class T>
    T take()
    {
        T value;
        std::memcpy(&value, skip(sizeof(T)), sizeof(T));
        return value;
    }
    /// A text behind its length.
    std::string text()
    {
        const auto length = take<std::uint32_t>();
        return {reinterpret_cast<const char*>(skip(length)), length};
    }
    /// What was gone over before.
    const std::byte* of(std::size_t at) const { return m_file.data() + at; }

    [[noreturn]] void fail(const std::string& expected, const std::string& found) const;

private:
    [[noreturn]] void failAtEnd(std::uint64_t bytes) const;
    void forget();

    const MappedFile& m_file;
    std::string m_grid; ///< for messages
    std::size_t m_at = 0, m_forget_at = 0;
};

} // namespace volcomp
