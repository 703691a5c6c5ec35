// SPDX-License-Identifier: Apache-2.0
// The programs run as processes on a small scene, each test in a folder of its own.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "tests/support/temporary_folder.h"

namespace volcomp {

/// A square of 1 m with tufts on it, more of them on its left half, seen from above its front edge.
/// Its skin is voxels: Embree, which traces meshes, is not instrumented (tests/steps.sh).
inline constexpr const char* kScene = R"(
[material.fur]
kind = "fibre"

[material.skin]
kind = "surface"

[box.tuft]
material = "fur"
variants = 2
voxel = 0.01

[[box.tuft.level]]
count = 12
spread = 0.05
length = 0.2
radius = 0.004
segments = 4
angle_degrees = [0, 20]

[surface.ground]
mesh = "ground.obj"
skin = "skin"
skin_as = "voxels"

[[layer]]
name = "fur"
box = "tuft"
density = 60

[[layer.where]]
image = "where.pgm"

[compose]
voxel = 0.02

[camera]
eye = [0, 1.5, 2.0]
target = [0, 0, 0]

[[light]]
direction = [-1, -2, -1]

[render]
width = 48
height = 32
)";

inline constexpr const char* kMesh =
    "v -0.5 0 0.5\nv 0.5 0 0.5\nv 0.5 0 -0.5\nv -0.5 0 -0.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

/// How a program ended and what it wrote to its standard output and standard error.
struct Outcome {
    int status;
    std::string output;
};

/// Begins with the files scene.toml (kScene), ground.obj (kMesh) and where.pgm in an empty folder,
/// in which the programs run.
class Programs : public testing::Test {
protected:
    void SetUp() override
    {
        write("scene.toml", kScene);
        write("ground.obj", kMesh);
        write("where.pgm", "P2\n2 1\n255\n255 128\n");
    }

    std::filesystem::path path(const std::string& name) const { return m_folder / name; }
    void write(const std::string& name, const std::string& text) { m_folder.write(name, text); }
    std::string read(const std::string& name) const { return m_folder.read(name); }
    /// Returns the bytes of a VDB file without its first 64, which hold an identifier of the whole.
    std::string readBody(const std::string& name) const { return read(name).substr(64); }
    bool exists(const std::string& name) const { return std::filesystem::exists(path(name)); }
    nlohmann::json readJson(const std::string& name) const
    {
        return nlohmann::json::parse(read(name));
    }

    /// Writes scene.toml as kScene with the first line that starts with `from` replaced by `to`.
    void writeSceneWith(const std::string& from, const std::string& to)
    {
        writeSceneWith({{from, to}});
    }
    /// Writes scene.toml as kScene with several such replacements, each made in what the one before
    /// has left.
    void writeSceneWith(
        std::initializer_list<std::pair<const std::string, const std::string>> replacements)
    {
        std::string text = kScene;
        for (const auto& [from, to] : replacements) {
            const auto at = text.find("\n" + from);
            ASSERT_NE(at, std::string::npos) << from;
            text.replace(at + 1, text.find('\n', at + 1) - at - 1, to);
        }
        write("scene.toml", text);
    }

    /// Runs volcomp-PROGRAM with these arguments, written as for a shell, and waits for its end.
    Outcome run(const std::string& program, const std::string& arguments)
    {
        return runFile("volcomp-" + program, arguments);
    }
    Outcome runFile(const std::string& program, const std::string& arguments)
    {
        const std::string command = "cd '" + m_folder.path().string() + "' && '" VOLCOMP_BIN "/"
            + program + "' " + arguments + " >log.txt 2>&1";
        const int status = std::system(command.c_str());
        const Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 128, read("log.txt")};
        std::filesystem::remove(path("log.txt"));
        return outcome;
    }
    /// The same for the program `volcomp` itself.
    Outcome volcomp(const std::string& arguments) { return runFile("volcomp", arguments); }
    Outcome bake() { return run("bake", "scene.toml -o boxes"); }
    Outcome compose(const std::string& more = "")
    {
        return run("compose", "scene.toml --boxes boxes -o volume.vdb " + more);
    }
    Outcome render(const std::string& more = "-o a.exr")
    {
        return run("render", "scene.toml --volume volume.vdb " + more);
    }
    void bakeAndCompose()
    {
        const Outcome baked = bake();
        ASSERT_EQ(baked.status, 0) << baked.output;
        const Outcome composed = compose();
        ASSERT_EQ(composed.status, 0) << composed.output;
    }

    /// Expects a failure: the status 1, a message with all `parts`, and no file `output`, also none
    /// under the temporary name of an unfinished file.
    void expectFailure(const Outcome& outcome, std::initializer_list<const char*> parts,
                       const std::string& output)
    {
        EXPECT_EQ(outcome.status, 1) << outcome.output;
        for (const char* part : parts)
            EXPECT_NE(outcome.output.find(part), std::string::npos)
                << "'" << part << "' is not in: " << outcome.output;
        EXPECT_FALSE(exists(output)) << output;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(m_folder.path()))
            EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
    }

private:
    TemporaryFolder m_folder;
};

} // namespace volcomp
