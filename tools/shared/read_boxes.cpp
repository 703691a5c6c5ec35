// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/read_boxes.h"

#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

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
        if (rule.name == used.name)
            requireFresh(tool, file, recipe, boxRecipe(scene, rule), stale,
                         "Bake it anew with volcomp-bake");
    const std::string hash = recipe.empty() ? Recipe::kUnknown : recipe.hash();
    used.hash = used.hash.empty() || used.hash == hash ? hash : "of several recipes";
}

struct BoxFile {
    fs::path file;
    std::string name;
    int variant;
};

struct FoundBoxes {
    std::vector<BoxFile> files;
    std::vector<UsedBox> used; ///< by kind
};

/// Finds the files of all boxes, and checks what they were baked from.
FoundBoxes findBoxes(const Tool& tool, const Scene& scene, const fs::path& directory, Stale stale)
{
    FoundBoxes found;
    for (const BoxKind& kind : usedBoxes(scene)) {
        found.used.push_back({kind.name, ""});
        for (int variant = 0; variant < kind.variants; ++variant) {
            const fs::path file = boxFile(directory, kind.name, variant);
            if (!fs::exists(file))
                throw fileError(file, "",
                                fmt::format("the box '{}', variant {}", kind.name, variant + 1),
                                "no file", "Run volcomp-bake first, or check --boxes.");
            noteRecipe(tool, scene, file, stale, found.used.back());
            found.files.push_back({file, kind.name, variant});
        }
    }
    return found;
}

Box readBox(const BoxFile& box) { return {box.name, box.variant, readVolume(box.file)}; }

} // namespace

fs::path boxFile(const fs::path& directory, const std::string& box, int variant)
{
    return directory / fmt::format("{}_{}.vdb", box, variant + 1);
}

std::vector<NamedFile> boxFiles(const Scene& scene, const fs::path& directory)
{
    std::vector<NamedFile> files;
    for (const BoxKind& kind : usedBoxes(scene))
        for (int variant = 0; variant < kind.variants; ++variant)
            files.push_back({"a box", boxFile(directory, kind.name, variant)});
    return files;
}

ReadBoxes readBoxes(const Tool& tool, const Scene& scene, const fs::path& directory, Stale stale,
                    const Progress& progress)
{
    const FoundBoxes found = findBoxes(tool, scene, directory, stale);
    ReadBoxes read;
    read.used = found.used;
    read.boxes.reserve(found.files.size());
    for (const BoxFile& box : found.files) {
        read.boxes.push_back(readBox(box));
        for (const std::string& warning : read.boxes.back().volume.warnings) tool.warn(warning);
        report(progress, double(read.boxes.size()) / double(found.files.size()));
    }
    return read;
}

ReadPackedBoxes readPackedBoxes(const Tool& tool, const Scene& scene, const fs::path& directory,
                                Stale stale, const Progress& progress)
{
    const FoundBoxes found = findBoxes(tool, scene, directory, stale);
    ReadPackedBoxes read;
    read.used = found.used;
    read.boxes.resize(found.files.size());
    std::vector<std::vector<std::string>> warnings(found.files.size());
    SharedProgress done(progress, found.files.size());
    tbb::parallel_for(std::size_t(0), found.files.size(), [&](std::size_t b) {
        // A thread that waits within must not begin another box.
        tbb::this_task_arena::isolate([&] {
            Box box = readBox(found.files[b]);
            warnings[b] = std::move(box.volume.warnings);
            read.boxes[b] = packBox(box);
        });
        done.add();
    });
    for (const std::vector<std::string>& of_box : warnings)
        for (const std::string& warning : of_box) tool.warn(warning);
    return read;
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
