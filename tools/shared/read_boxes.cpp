// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/read_boxes.h"

#include <utility>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// Adds what a box's file was baked from. Throws Error if the scene would bake it otherwise, unless
/// that is allowed.
void noteRecipe(const Tool& tool, const Scene& scene, const fs::path& file, Stale stale,
                UsedBox& used)
{
    const Recipe recipe = recipeOf(readVolumeMetadata(file));
    for (const GrowthRule& rule : scene.boxes)
        if (rule.name == used.name && rule.files.empty())
            requireFresh(tool, file, recipe, boxRecipe(scene, rule), stale,
                         "Bake it anew with volcomp-bake");
    const std::string hash = recipe.empty() ? Recipe::kUnknown : recipe.hash();
    used.hash = used.hash.empty() || used.hash == hash ? hash : "of several recipes";
}

} // namespace

fs::path boxFile(const fs::path& directory, const std::string& box, int variant)
{
    return directory / fmt::format("{}_{}.vdb", box, variant + 1);
}

fs::path boxFile(const Scene& scene, const fs::path& directory, const std::string& box, int variant)
{
    for (const GrowthRule& rule : scene.boxes)
        if (rule.name == box && !rule.files.empty()) return rule.files.at(std::size_t(variant));
    return boxFile(directory, box, variant);
}

std::vector<NamedFile> boxFiles(const Scene& scene, const fs::path& directory)
{
    std::vector<NamedFile> files;
    for (const BoxKind& kind : usedBoxes(scene))
        for (int variant = 0; variant < kind.variants; ++variant)
            files.push_back({"a box", boxFile(scene, directory, kind.name, variant)});
    return files;
}

ReadBoxes readBoxes(const Tool& tool, const Scene& scene, const fs::path& directory, Stale stale,
                    const Progress& progress)
{
    ReadBoxes read;
    read.used = readBoxes(
        tool, scene, directory, stale, [&](Box&& box) { read.boxes.push_back(std::move(box)); },
        progress);
    return read;
}

std::vector<UsedBox> readBoxes(const Tool& tool, const Scene& scene, const fs::path& directory,
                               Stale stale, const std::function<void(Box&&)>& take,
                               const Progress& progress)
{
    std::vector<UsedBox> used;
    const std::vector<BoxKind> kinds = usedBoxes(scene);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
        used.push_back({kinds[k].name, ""});
        for (int variant = 0; variant < kinds[k].variants; ++variant) {
            const fs::path file = boxFile(scene, directory, kinds[k].name, variant);
            if (!fs::exists(file))
                throw fileError(file, "",
                                "the box '" + kinds[k].name + "', variant "
                                    + std::to_string(variant + 1),
                                "no file", "Run volcomp-bake first, or check --boxes.");
            noteRecipe(tool, scene, file, stale, used.back());
            Box box{kinds[k].name, variant, readVolume(file)};
            for (const std::string& warning : box.volume.warnings) tool.warn(warning);
            take(std::move(box));
        }
        report(progress, double(k + 1) / double(kinds.size()));
    }
    return used;
}

Recipe volumeRecipe(const Scene& scene, const std::vector<UsedBox>& used,
                    const std::vector<std::string>& leave_out)
{
    Recipe recipe = placedRecipe(scene, used);
    for (const std::string& surface : leave_out)
        recipe.add(std::string(kOption) + "leave-out", surface);
    return recipe;
}

} // namespace volcomp
