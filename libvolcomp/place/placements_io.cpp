#include "volcomp/place/placements_io.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

template <class V>
std::string listOf(const V& v)
{
    return fmt::format("[{}, {}, {}]", v[0], v[1], v[2]);
}

void writeJson(std::ostream& out, const std::vector<Placement>& placements,
               const std::vector<std::string>& boxes, const std::vector<std::string>& layers)
{
    const auto quoted = [](const std::string& s) { return nlohmann::json(s).dump(); };
    out << "[";
    const char* between = "\n";
    for (const Placement& p : placements) {
        out << between
            << fmt::format(
                   R"({{"box": {}, "layer": {}, "position": {}, "scale": {}, "x_axis": {}, "y_axis": {}, "z_axis": {}, "tint": {}, "uv": [{}, {}]}})",
                   quoted(boxes.at(p.box)), quoted(layers.at(p.layer)), listOf(p.position), p.scale,
                   listOf(p.x_axis), listOf(p.y_axis), listOf(p.z_axis), listOf(p.tint), p.uv[0],
                   p.uv[1]);
        between = ",\n";
    }
    out << "\n]\n";
}

void writePly(std::ostream& out, const std::vector<Placement>& placements,
              const std::vector<std::string>& boxes, const std::vector<std::string>& layers)
{
    out << "ply\nformat binary_little_endian 1.0\n";
    for (std::size_t i = 0; i < boxes.size(); ++i)
        out << "comment box " << i << ' ' << boxes[i] << '\n';
    for (std::size_t i = 0; i < layers.size(); ++i)
        out << "comment layer " << i << ' ' << layers[i] << '\n';
    out << "element vertex " << placements.size()
        << "\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float scale\nproperty int box\nproperty int layer\nend_header\n";
    for (const Placement& p : placements) {
        char record[24 + 12 + 3 + 4 + 8];
        char* at = record;
        const auto put = [&](const auto& value) {
            std::memcpy(at, &value, sizeof value);
            at += sizeof value;
        };
        for (int i = 0; i < 3; ++i) put(p.position[i]);
        for (int i = 0; i < 3; ++i) put(p.y_axis[i]);
        for (int i = 0; i < 3; ++i)
            put(static_cast<unsigned char>(std::lround(std::clamp(p.tint[i], 0.0f, 1.0f) * 255)));
        put(p.scale);
        put(p.box);
        put(p.layer);
        out.write(record, sizeof record);
    }
}

} // namespace

void writePlacements(const std::filesystem::path& file, const std::vector<Placement>& placements,
                     const std::vector<std::string>& boxes, const std::vector<std::string>& layers)
{
    const bool json = file.extension() == ".json";
    if (!json && file.extension() != ".ply")
        throw fileError(file, "", "a name that ends in .json or .ply",
                        "'" + file.extension().string() + "'");
    writeStreamAtomically(file, [&](std::ostream& stream) {
        (json ? writeJson : writePly)(stream, placements, boxes, layers);
    });
}

} // namespace volcomp
