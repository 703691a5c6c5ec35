// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene_files.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <unordered_map>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/scene/scene_settings.h"
#include "volcomp/scene/scene_text.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// The tables that a file takes over from those that it includes, one by one by their names.
constexpr std::string_view kSharedByName[] = {"material", "box", "light", "preset"};

constexpr std::size_t kMostFiles = 10'000, kMostIncludes = 100'000;

/// Opens files depth first, with a stack of its own: a chain of includes may be long.
class Opener {
public:
    std::vector<SceneFile> open(const fs::path& file)
    {
        push(file, keyOf(file));
        while (!m_stack.empty()) {
            Open& top = m_stack.back();
            if (top.next == top.paths.size()) close();
            else follow(top, top.paths[top.next++]);
        }
        return std::move(m_closed);
    }

private:
    /// A file whose includes are being opened.
    struct Open {
        SceneFile file;
        fs::path key;
        std::vector<fs::path> paths;  ///< of its includes
        std::size_t next = 0;         ///< the first of them that was not looked at
        std::set<std::size_t> listed; ///< those of file.includes
    };

    /// Returns what tells files apart, however they are named.
    static fs::path keyOf(const fs::path& file)
    {
        std::error_code code;
        const fs::path key = fs::canonical(file, code);
        return code || streamOf(file) >= 0 ? file : key;
    }

    void push(const fs::path& file, const fs::path& key)
    {
        TableReader table = TableReader::open(file, m_budget);
        std::vector<fs::path> paths = table.paths(kIncludeKey, {});
        m_includes += paths.size();
        table.require(m_includes <= kMostIncludes, "include",
                      fmt::format("at most {} includes in all files of a scene", kMostIncludes));
        m_place.emplace(key, std::nullopt);
        m_stack.push_back({{std::move(table), {}}, key, std::move(paths), 0, {}});
    }

    /// Returns the key of an included file. Each name is asked for once.
    const fs::path& includedKey(const TableReader& table, const fs::path& path)
    {
        const auto [at, is_new] = m_keys.emplace(path.native(), fs::path());
        if (!is_new) return at->second;
        std::error_code code;
        table.require(fs::is_regular_file(path, code), "include",
                      "files relative to this one (there is no file '" + path.string() + "')");
        return at->second = keyOf(path);
    }

    void follow(Open& from, const fs::path& path)
    {
        const TableReader& table = from.file.table;
        const fs::path key = includedKey(table, path);
        const auto known = m_place.find(key);
        if (known == m_place.end()) {
            table.require(m_place.size() < kMostFiles, "include",
                          fmt::format("a scene of at most {} files", kMostFiles));
            --from.next; // it is looked at again when the file is closed
            push(path, key);
        } else if (known->second) {
            if (from.listed.insert(*known->second).second)
                from.file.includes.push_back(*known->second);
        } else
            table.require(false, "include", "files that do not include each other" + circle(key));
    }

    /// Returns " (a includes b includes a)" for the files on the stack from that key on.
    std::string circle(const fs::path& key) const
    {
        std::string text;
        const auto from = std::find_if(m_stack.begin(), m_stack.end(),
                                       [&](const Open& open) { return open.key == key; });
        for (auto at = from; at != m_stack.end() && text.size() < 1000; ++at)
            text += at->file.table.file().string() + " includes ";
        return " (" + text + from->file.table.file().string() + ")";
    }

    void close()
    {
        m_place[m_stack.back().key] = m_closed.size();
        m_closed.push_back(std::move(m_stack.back().file));
        m_stack.pop_back();
    }

    ReadBudget m_budget;
    std::vector<Open> m_stack;
    std::vector<SceneFile> m_closed;
    std::map<fs::path, std::optional<std::size_t>> m_place; ///< in m_closed; none while it is open
    std::unordered_map<std::string, fs::path> m_keys;       ///< of the names of included files
    std::size_t m_includes = 0;
};

/// The file whose table of that name counts: the scene's own, or else that of the first file that
/// it includes, and so on. The scene itself if there is none, or if included files do not count
/// there.
std::size_t ownerOf(const std::vector<SceneFile>& files, const Setting& setting)
{
    const std::string table(setting.file->table.cbegin()->first.str());
    const std::size_t scene = files.size() - 1;
    if (std::find(std::begin(kSharedByName), std::end(kSharedByName), table)
        == std::end(kSharedByName))
        return scene;
    std::vector<bool> seen(files.size());
    std::vector<std::size_t> next{scene};
    while (!next.empty()) {
        const std::size_t file = next.back();
        next.pop_back();
        if (seen[file]) continue;
        seen[file] = true;
        if (files[file].table.holds(setting)) return file;
        next.insert(next.end(), files[file].includes.rbegin(), files[file].includes.rend());
    }
    return scene;
}

} // namespace

const Key kIncludeKey{
    "include", "",
    "scene files, relative to this one, whose materials, boxes, presets and lights are used here as well, and whose [camera], [compose], [render], [haze] and [picture] give the keys that this file leaves out; their [dome] counts if this file has none. This file's own win"};

std::vector<SceneFile> openSceneFiles(const fs::path& file,
                                      const std::vector<std::string>& settings)
{
    std::vector<SceneFile> files = Opener().open(file);
    for (const std::string& text : settings) {
        Setting setting = readSetting(text);
        files[ownerOf(files, setting)].table.set(setting);
    }
    return files;
}

} // namespace volcomp
