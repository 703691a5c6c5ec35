// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <fstream>
#include <new>
#include <optional>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/curves/curve_readers.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

const char* const kExpected = "strands (HAIR, TFX, or lines of a PLY or OBJ)";

using Reader = ReadStrands (*)(const fs::path&, std::string_view);

Reader readerFor(const fs::path& file)
{
    std::error_code code;
    if (!fs::is_regular_file(file, code))
        throw fileError(file, "", kExpected,
                        fs::exists(file, code) ? "something that is not a file" : "no file",
                        "Check the path.");
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (ending == ".hair") return readHair;
    if (ending == ".tfx") return readTressFx;
    if (ending == ".ply") return readPlyLines;
    if (ending == ".obj") return readObjLines;
    throw fileError(file, "", kExpected, "a name that ends in '" + ending + "'",
                    "volcomp-import makes a .hair of Alembic and USD files.");
}

std::string contentOf(const fs::path& file)
{
    std::ifstream in(file, std::ios::binary);
    std::string content(fs::file_size(file), '\0');
    in.read(content.data(), static_cast<std::streamsize>(content.size()));
    if (!in) throw fileError(file, "", kExpected, "a file that cannot be read");
    return content;
}

/// The content of the sidecar; nothing if there is none.
std::optional<std::string> sidecarContent(const fs::path& file)
{
    std::error_code code;
    if (file.extension() != ".hair" || !fs::is_regular_file(sidecarOf(file), code))
        return std::nullopt;
    return contentOf(sidecarOf(file));
}

bool finite(const Vec3d& p)
{
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

/// Throws Error for a value that is not finite or negative.
void checkValues(const fs::path& file, const CurveSet& set)
{
    const auto bad = [](float x) { return !(x >= 0 && std::isfinite(x)); };
    for (const float width : set.widths.values)
        if (bad(width))
            throw fileError(file, "", "finite widths of at least 0", fmt::format("{}", width));
    for (const Vec3f& c : set.colours.values)
        if (bad(c[0]) || bad(c[1]) || bad(c[2]))
            throw fileError(file, "", "finite colours of at least 0",
                            fmt::format("[{}, {}, {}]", c[0], c[1], c[2]));
    for (const Vec2f& uv : set.root_uvs)
        if (!std::isfinite(uv[0]) || !std::isfinite(uv[1]))
            throw fileError(file, "", "finite texture coordinates", "NaN or infinity");
}

/// Takes the middle of the bounds off, so that floats keep the strands' shape.
void setPoints(const fs::path& file, const std::vector<Vec3d>& points, CurveSet& set)
{
    constexpr double kFarthest = 1e15; // beyond it differences of places mean nothing
    Vec3d low(kFarthest), high(-kFarthest);
    for (const Vec3d& p : points) {
        if (!finite(p) || p.length() > kFarthest)
            throw fileError(file, "", "finite places of points",
                            fmt::format("[{}, {}, {}]", p[0], p[1], p[2]));
        low = openvdb::math::minComponent(low, p);
        high = openvdb::math::maxComponent(high, p);
    }
    set.offset = (low + high) / 2;
    set.points.reserve(points.size());
    for (const Vec3d& p : points) set.points.emplace_back(p - set.offset);
}

/// Leaves the strands of a single point out.
void dropShort(const fs::path& file, CurveSet& set)
{
    const CurveSet all = std::move(set);
    set = CurveSet();
    set.offset = all.offset, set.unit = all.unit, set.up = all.up, set.says_up = all.says_up;
    set.widths.given = all.widths.given, set.colours.given = all.colours.given;
    const auto copy = [](const auto& from, auto& to, std::size_t first, std::size_t end) {
        to.insert(to.end(), from.begin() + std::ptrdiff_t(first),
                  from.begin() + std::ptrdiff_t(end));
    };
    const auto copyGiven = [&](const auto& from, auto& to, std::size_t s) {
        if (from.given == Given::per_point) copy(from.values, to.values, all.first(s), all.ends[s]);
        else if (from.given == Given::per_strand) copy(from.values, to.values, s, s + 1);
        else to.values = from.values;
    };
    for (std::size_t s = 0; s < all.size(); ++s) {
        if (all.ends[s] - all.first(s) < 2) continue;
        copy(all.points, set.points, all.first(s), all.ends[s]);
        set.ends.push_back(set.points.size());
        copyGiven(all.widths, set.widths, s);
        copyGiven(all.colours, set.colours, s);
        if (!all.root_uvs.empty()) set.root_uvs.push_back(all.root_uvs[s]);
        if (!all.groups.empty()) set.groups.push_back(all.groups[s]);
        if (!all.guides.empty()) set.guides.push_back(all.guides[s]);
    }
    set.warnings = all.warnings;
    set.warnings.push_back(fmt::format("{}: {} of {} strands have a single point and are left out.",
                                       file.string(), all.size() - set.size(), all.size()));
}

CurveSet read(const fs::path& file)
{
    const Reader reader = readerFor(file);
    const std::optional<std::string> sidecar = sidecarContent(file);
    ReadStrands read = reader(file, contentOf(file));
    CurveSet set = std::move(read.set);
    if (set.ends.empty())
        throw fileError(file, "", kExpected, "none", "Meshes are read by the keys of surfaces.");
    setPoints(file, read.points, set);
    if (sidecar) readSidecar(sidecarOf(file), *sidecar, set);
    checkValues(file, set);
    const auto is_short = [&](std::size_t s) { return set.ends[s] - set.first(s) < 2; };
    for (std::size_t s = 0; s < set.size(); ++s)
        if (is_short(s)) {
            dropShort(file, set);
            break;
        }
    if (set.ends.empty()) throw fileError(file, "", "strands of two points or more", "none");
    return set;
}

} // namespace

fs::path sidecarOf(const fs::path& file) { return fs::path(file) += ".json"; }

CurveSet readCurves(const fs::path& file)
{
    try {
        return read(file);
    } catch (const std::bad_alloc&) {
        throw Error(file.string() + ": the memory is not enough to read these strands.");
    } catch (const fs::filesystem_error& e) {
        throw fileError(file, "", kExpected, e.code().message());
    }
}

} // namespace volcomp
