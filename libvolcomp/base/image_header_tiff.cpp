// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include <fmt/format.h>

#include "volcomp/base/image_bytes.h"

namespace volcomp {
namespace {

/// The first directory of a TIFF or BigTIFF. libtiff gives strips that lie behind the file's end
/// without an error, so they are checked here.
class TiffDirectory {
public:
    explicit TiffDirectory(const ImageBytes& bytes)
        : m_bytes(bytes), m_big_endian(bytes.read(0, 1) == "M"),
          m_wide(bytes.number(2, 2, m_big_endian) == 43)
    {
        const std::int64_t at = m_wide ? number(8, 8) : number(4, 4);
        const std::int64_t count = m_wide ? number(at, 8) : number(at, 2);
        m_first = at + (m_wide ? 8 : 2);
        if (count < 1 || count > 65535 || m_first + count * entrySize() > m_bytes.size())
            throw m_bytes.damaged("a directory that lies outside of the file");
        m_count = count;
    }

    /// The numbers of an entry; none if the directory does not have it.
    std::vector<std::int64_t> values(std::uint32_t tag) const
    {
        for (std::int64_t i = 0; i < m_count; ++i) {
            const std::int64_t at = m_first + i * entrySize();
            if (m_bytes.number(at, 2, m_big_endian) != tag) continue;
            const std::uint32_t type = m_bytes.number(at + 2, 2, m_big_endian);
            const int size = type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : type == 1 ? 1 : 0;
            const std::int64_t count = number(at + 4, m_wide ? 8 : 4);
            if (size == 0 || count < 0 || count > m_bytes.size())
                throw m_bytes.damaged(fmt::format("an entry {} that is not numbers", tag));
            const std::int64_t inside = m_wide ? 8 : 4, place = at + 4 + inside;
            const std::int64_t from = size * count <= inside ? place : number(place, int(inside));
            return numbers(from, size, count);
        }
        return {};
    }

private:
    std::int64_t entrySize() const { return m_wide ? 20 : 12; }
    std::int64_t number(std::int64_t at, int size) const { return numbers(at, size, 1)[0]; }
    std::vector<std::int64_t> numbers(std::int64_t at, int size, std::int64_t count) const
    {
        if (at < 0 || at > m_bytes.size() || count * size > m_bytes.size() - at)
            throw m_bytes.damaged("an entry that lies outside of the file");
        const std::string bytes = m_bytes.read(at, count * size);
        std::vector<std::int64_t> result;
        for (std::size_t i = 0; i + std::size_t(size) <= bytes.size(); i += std::size_t(size)) {
            std::uint64_t value = 0;
            for (int k = 0; k < size; ++k)
                value = value << 8
                    | static_cast<unsigned char>(
                            bytes[i + std::size_t(m_big_endian ? k : size - 1 - k)]);
            result.push_back(static_cast<std::int64_t>(value));
        }
        if (std::int64_t(result.size()) != count) throw m_bytes.damaged("a shorter file");
        return result;
    }

    const ImageBytes& m_bytes;
    bool m_big_endian, m_wide;
    std::int64_t m_first = 0, m_count = 0;
};

} // namespace

bool checkTiff(const ImageBytes& bytes)
{
    constexpr std::uint32_t kFullWidth = 33300; // Pixar's PIXAR_IMAGEFULLWIDTH
    const TiffDirectory directory(bytes);
    const bool tiled = !directory.values(324).empty();
    const auto offsets = directory.values(tiled ? 324 : 273),
               sizes = directory.values(tiled ? 325 : 279);
    if (offsets.empty() || sizes.size() < offsets.size())
        throw bytes.damaged("a directory without the places of its pixels");
    const auto height = directory.values(257), rows = directory.values(278); // rows in a strip
    if (!tiled && !height.empty() && !rows.empty()
        && double(offsets.size()) * double(rows[0]) < double(height[0]))
        throw bytes.damaged("fewer strips than its rows need");
    for (std::size_t i = 0; i < offsets.size(); ++i)
        if (offsets[i] < 0 || sizes[i] < 0 || offsets[i] > bytes.size()
            || sizes[i] > bytes.size() - offsets[i])
            throw bytes.damaged(fmt::format(
                "piece {} of its {} pieces of pixels outside of the file", i + 1, offsets.size()));
    return !directory.values(kFullWidth).empty();
}

} // namespace volcomp
