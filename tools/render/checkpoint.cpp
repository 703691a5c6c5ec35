// SPDX-License-Identifier: Apache-2.0
#include "tools/render/checkpoint.h"

#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/random.h"
#include "tools/shared/settings.h"
#include "volcomp/scene/scene_recipe.h"
#include "volcomp/volume/vdb_io.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMagic = 0x316b6863706d6376; // the file begins with "vcmpchk1"

template <class T>
std::uint64_t hashOf(const std::vector<T>& values)
{
    std::uint64_t hash = values.size();
    for (const T value : values) {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof value);
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15ULL + (hash >> 29);
    }
    return mix64(hash);
}

/// Returns the value that a text stands for, null if it is not JSON or nested more deeply than any
/// fingerprint: comparing and writing values is recursive.
json parsed(const std::string& text)
{
    constexpr int kDeepest = 16;
    bool deep = false;
    json value = json::parse(
        text,
        [&](int depth, json::parse_event_t, json&) {
            deep = deep || depth > kDeepest;
            return depth <= kDeepest;
        },
        false);
    return deep || value.is_discarded() ? json() : value;
}

} // namespace

json fileIdentity(const std::filesystem::path& volume, const std::string& grid)
{
    return {{"file", volumeIdentifier(volume, grid)}};
}

json renderFingerprint(const Scene& scene, const json& volume)
{
    json print = {{"version", VOLCOMP_VERSION},
                  {"volume", volume},
                  {"settings", settingsOf(scene.render)},
                  {"camera", settingsOf(scene.camera)},
                  {"lights", json::array()},
                  {"materials", json::array()}};
    if (const Recipe skins = skinRecipe(scene); !skins.empty()) print["skins"] = skins.hash();
    if (const auto& dome = scene.render.dome; dome.kind == DomeKind::image) {
        Recipe image;
        image.addFile("dome.image content", dome.file);
        print["dome image"] = image.hash();
    }
    for (const Light& l : scene.lights) print["lights"].push_back(settingsOf(l));
    for (const Material& m : scene.materials) print["materials"].push_back(settingsOf(m));
    return print;
}

void writeCheckpoint(const std::filesystem::path& file, const json& fingerprint,
                     const RenderState& state)
{
    writeStreamAtomically(file, [&](std::ostream& stream) {
        const std::string text = fingerprint.dump();
        const std::uint64_t head[] = {kMagic, text.size(), state.sums.size(), state.samples.size(),
                                      hashOf(state.sums) ^ hashOf(state.samples)};
        stream.write(reinterpret_cast<const char*>(head), sizeof head);
        stream.write(text.data(), std::streamsize(text.size()));
        stream.write(reinterpret_cast<const char*>(state.sums.data()),
                     std::streamsize(state.sums.size() * sizeof(double)));
        stream.write(reinterpret_cast<const char*>(state.samples.data()),
                     std::streamsize(state.samples.size() * sizeof(std::int32_t)));
    });
}

RenderState readCheckpoint(const std::filesystem::path& file, const json& fingerprint)
{
    const auto damaged = [&] {
        return fileError(file, "", "the state of a stopped render", "a damaged or foreign file",
                         "Remove it and render without --resume.");
    };
    std::ifstream stream(file, std::ios::binary);
    std::uint64_t head[5] = {};
    stream.read(reinterpret_cast<char*>(head), sizeof head);
    std::error_code code;
    const std::uintmax_t size = std::filesystem::file_size(file, code);
    if (code || !stream || head[0] != kMagic || head[1] > size || head[2] > size || head[3] > size
        || sizeof head + head[1] + 8 * head[2] + 4 * head[3] != size)
        throw damaged();
    std::string text(head[1], ' ');
    RenderState state;
    state.sums.resize(head[2]);
    state.samples.resize(head[3]);
    stream.read(text.data(), std::streamsize(text.size()));
    stream.read(reinterpret_cast<char*>(state.sums.data()), std::streamsize(8 * head[2]));
    stream.read(reinterpret_cast<char*>(state.samples.data()), std::streamsize(4 * head[3]));
    const json known = parsed(text);
    if (!stream || !known.is_object() || (hashOf(state.sums) ^ hashOf(state.samples)) != head[4])
        throw damaged();
    const json wanted = json::parse(fingerprint.dump()); // as text keeps it, like the file's
    for (const auto& [key, value] : wanted.items()) {
        const json other = known.value(key, json());
        if (other == value) continue;
        std::string expected = "this scene's " + key, found = "another one's";
        if (key == "settings" && other.is_object())
            for (const auto& [name, setting] : value.items())
                if (other.value(name, json()) != setting) {
                    expected = fmt::format("{} = {}", name, setting.dump());
                    found = other.value(name, json()).dump();
                }
        throw fileError(
            file, "", "the state of this very render (" + expected + ")", found,
            "Go on with the settings and files it was begun with, or render without --resume.");
    }
    return state;
}

} // namespace volcomp
