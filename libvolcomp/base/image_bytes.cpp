// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/image_bytes.h"

#include <algorithm>

#include <sys/stat.h>
#include <unistd.h>

namespace volcomp {

ImageBytes::ImageBytes(const std::filesystem::path& file, std::FILE* stream)
    : m_file(file), m_handle(fileno(stream))
{
    struct stat about;
    if (fstat(m_handle, &about) != 0 || !S_ISREG(about.st_mode)) throw damaged("not a file");
    m_size = about.st_size;
}

std::string ImageBytes::read(std::int64_t at, std::int64_t count) const
{
    std::string bytes(std::size_t(std::clamp<std::int64_t>(m_size - at, 0, count)), '\0');
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t got =
            pread(m_handle, bytes.data() + done, bytes.size() - done, at + std::int64_t(done));
        if (got <= 0) break;
        done += std::size_t(got);
    }
    bytes.resize(done);
    return bytes;
}

std::uint32_t ImageBytes::number(std::int64_t at, int count, bool big_endian) const
{
    const std::string bytes = read(at, count);
    if (bytes.size() != std::size_t(count)) throw damaged("a header that ends too early");
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i)
        value = value << 8 | static_cast<unsigned char>(bytes[big_endian ? i : count - 1 - i]);
    return value;
}

Error ImageBytes::damaged(const std::string& found) const
{
    return fileError(m_file, "", "a complete image", found, "Is the file damaged?");
}

Error ImageBytes::refused(const std::string& expected, const std::string& found) const
{
    return fileError(m_file, "", expected, found, "Save it as another kind.");
}

} // namespace volcomp
