// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/vdb_bytes.h"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kForgetEvery = std::size_t(1) << 24; // bytes

} // namespace

MappedFile::MappedFile(const fs::path& file) : m_path(file)
{
    std::error_code code;
    if (!fs::exists(file, code))
        throw fileError(file, "", "a VDB file", "no file",
                        "Check the path; the bake and compose tools make such files.");
    if (!fs::is_regular_file(file, code))
        throw fileError(file, "", "a VDB file", "a directory or device");
    const auto cannot = [&] {
        return fileError(file, "", "a file that can be read", std::strerror(errno));
    };
    const int handle = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (handle < 0) throw cannot();
    struct stat about { };
    if (::fstat(handle, &about) != 0) {
        ::close(handle);
        throw cannot();
    }
    m_size = static_cast<std::size_t>(about.st_size);
    if (m_size == 0) {
        ::close(handle);
        throw fileError(file, "", "a VDB file", "an empty file");
    }
    void* const data = ::mmap(nullptr, m_size, PROT_READ, MAP_SHARED, handle, 0);
    ::close(handle);
    if (data == MAP_FAILED) throw cannot();
    m_data = static_cast<std::byte*>(data);
}

MappedFile::~MappedFile() { ::munmap(m_data, m_size); }

void MappedFile::forget(std::size_t end) const
{
    end = end / kForgetEvery * kForgetEvery;
    if (end <= m_forgotten) return;
    ::madvise(m_data + m_forgotten, end - m_forgotten, MADV_DONTNEED);
    m_forgotten = end;
}

void VdbBytes::forget()
{
    m_file.forget(m_at);
    m_forget_at = m_at + kForgetEvery;
}

void VdbBytes::fail(const std::string& expected, const std::string& found) const
{
    const std::string place = m_grid.empty() ? "" : "grid '" + m_grid + "', ";
    throw fileError(m_file.path(), place + fmt::format("byte {}", m_at), expected, found,
                    "It may be damaged, truncated or of another format; make it again.");
}

void VdbBytes::failAtEnd(std::uint64_t bytes) const
{
    fail(fmt::format("{} more bytes", bytes),
         fmt::format("that the file ends after {} of them", left()));
}

} // namespace volcomp
