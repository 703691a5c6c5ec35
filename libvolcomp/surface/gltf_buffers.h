// SPDX-License-Identifier: Apache-2.0
// The numbers of a glTF file: its buffers, and the accessors into them. Private to its reader.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace volcomp {

/// The bytes behind a "data:" address of base64, or of the file that a relative address names.
/// Throws Error, naming `place`, if there are none.
std::string gltfBytes(const std::filesystem::path& file, const std::string& place,
                      const std::string& uri);

/// The file that a relative address means, its %20 and the like resolved.
std::filesystem::path gltfPath(const std::filesystem::path& file, const std::string& uri);

/// Reads accessors. Everything that the file says of offsets and counts is checked against the
/// bytes that are there; what does not fit is an Error. What `json` lacks or has of another type
/// throws nlohmann::json::exception.
class GltfBuffers {
public:
    /// `binary` is the GLB's own piece, empty if it has none. Keeps references to `json`, `binary`.
    GltfBuffers(const std::filesystem::path& file, const nlohmann::json& json,
                std::string_view binary);

    /// `width` numbers for each element; normalised integers become 0 ... 1 or -1 ... 1.
    std::vector<double> numbers(std::uint64_t accessor, std::size_t width);
    /// Whole numbers >= 0, one for each element.
    std::vector<std::uint32_t> indices(std::uint64_t accessor);
    /// The bytes of a buffer view.
    std::string_view view(std::uint64_t index);

private:
    struct Span {
        const char* first;
        std::size_t count, stride, width;
        int component;
        bool normalised;
    };
    Span span(std::uint64_t accessor, std::size_t width);
    std::string_view buffer(std::uint64_t index);

    const std::filesystem::path& m_file;
    const nlohmann::json& m_json;
    std::string_view m_binary;
    std::vector<std::string> m_read; ///< the buffers that were read, empty until then
};

} // namespace volcomp
