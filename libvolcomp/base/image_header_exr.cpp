// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "volcomp/base/image_bytes.h"

namespace volcomp {
namespace {

constexpr std::int64_t kMostTile = 1 << 24;

/// What the attributes of one part of an EXR say.
struct ExrPart {
    std::int64_t width = 0, height = 0, tile_width = 0, tile_height = 0;
    int compression = -1, tile_mode = 0;
    double pixel_bytes = 0;
    int channels = 0;
};

class ExrHeader {
public:
    explicit ExrHeader(const ImageBytes& bytes) : m_bytes(bytes) { }

    void check(const std::filesystem::path& file, const ImageHeader& header)
    {
        const std::uint32_t flags = m_bytes.number(4, 4, false);
        if ((flags & 0xff) > 2) throw m_bytes.refused("EXR of version 2", "a later one");
        if (flags & 0x800) throw m_bytes.refused("a flat image", "a deep EXR");
        const bool several = flags & 0x1000;
        do {
            const ExrPart part = readPart();
            checkImageSize(file, header, part.width, part.height, part.channels,
                           part.pixel_bytes / std::max(1, part.channels),
                           part.compression >= 8 ? "dwaa" : "zip");
            checkChunks(part, (flags & 0x200) != 0);
        } while (several && m_bytes.number(m_at, 1, false) != 0);
    }

private:
    /// The text at the present place, without its final zero.
    std::string text()
    {
        const std::string bytes = m_bytes.read(m_at, 256);
        const std::size_t end = bytes.find('\0');
        if (end == std::string::npos) throw m_bytes.damaged("a name without an end");
        m_at += std::int64_t(end) + 1;
        return bytes.substr(0, end);
    }
    std::int64_t signedNumber(std::int64_t at) const
    {
        return static_cast<std::int32_t>(m_bytes.number(at, 4, false));
    }

    ExrPart readPart()
    {
        ExrPart part;
        for (std::string name = text(); !name.empty(); name = text()) {
            const std::string type = text();
            const std::int64_t size = m_bytes.number(m_at, 4, false);
            const std::int64_t end = m_at + 4 + size;
            if (end > m_bytes.size())
                throw m_bytes.damaged("the attribute '" + name + "' longer than the file");
            m_at += 4;
            readAttribute(name, type, size, part);
            m_at = end;
        }
        if (part.width < 1 || part.channels < 1 || part.compression < 0)
            throw m_bytes.damaged("a header without its data window, channels or compression");
        return part;
    }

    void readAttribute(const std::string& name, const std::string& type, std::int64_t size,
                       ExrPart& part)
    {
        if (name == "dataWindow") {
            part.width = signedNumber(m_at + 8) - signedNumber(m_at) + 1;
            part.height = signedNumber(m_at + 12) - signedNumber(m_at + 4) + 1;
            if (part.width < 1 || part.height < 1) throw m_bytes.damaged("no pixels");
        } else if (name == "compression") {
            part.compression = int(m_bytes.number(m_at, 1, false));
        } else if (name == "tiles") {
            part.tile_width = m_bytes.number(m_at, 4, false);
            part.tile_height = m_bytes.number(m_at + 4, 4, false);
            part.tile_mode = int(m_bytes.number(m_at + 8, 1, false) & 15);
        } else if (name == "channels") {
            readChannels(size, part);
        } else if (type == "preview") {
            const double pixels =
                double(m_bytes.number(m_at, 4, false)) * m_bytes.number(m_at + 4, 4, false);
            if (pixels * 4 + 8 != double(size)) throw m_bytes.damaged("a wrong preview");
        }
    }

    void readChannels(std::int64_t size, ExrPart& part)
    {
        const std::int64_t end = m_at + size;
        while (m_at < end && m_bytes.number(m_at, 1, false) != 0) {
            text();
            const std::uint32_t type = m_bytes.number(m_at, 4, false);
            const std::int64_t across = signedNumber(m_at + 8), down = signedNumber(m_at + 12);
            if (type > 2 || across < 1 || down < 1 || across > 64 || down > 64)
                throw m_bytes.damaged("a channel of an unknown type or sampling");
            part.pixel_bytes += type == 1 ? 2 : 4;
            m_at += 16;
            if (++part.channels > kMostImageChannels) throw m_bytes.damaged("too many channels");
        }
    }

    /// Each chunk of rows, and each tile, has an offset of 8 bytes in the file.
    void checkChunks(const ExrPart& part, bool tiled) const
    {
        static constexpr std::array<int, 10> kRows{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
        if (part.compression >= int(kRows.size()))
            throw m_bytes.refused("a compression that OpenEXR 3.1 knows", "another one");
        double chunks = double(part.height) / kRows[std::size_t(part.compression)];
        if (tiled || part.tile_width > 0) {
            if (part.tile_width < 1 || part.tile_height < 1
                || part.tile_width > kMostTile / part.tile_height)
                throw m_bytes.refused(fmt::format("tiles of at most {} pixels", kMostTile),
                                      fmt::format("{} x {}", part.tile_width, part.tile_height));
            chunks = (double(part.width) / double(part.tile_width))
                * (double(part.height) / double(part.tile_height));
        }
        if (std::max(1.0, chunks) * 8 > double(m_bytes.size()))
            throw m_bytes.damaged("fewer pieces than its header promises");
    }

    const ImageBytes& m_bytes;
    std::int64_t m_at = 8;
};

} // namespace

void checkExr(const std::filesystem::path& file, const ImageHeader& header, const ImageBytes& bytes)
{
    ExrHeader(bytes).check(file, header);
}

} // namespace volcomp
