// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/kept.h"

#include <fstream>
#include <iterator>
#include <system_error>

#include <fmt/format.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/hash.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

std::string hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

std::uint64_t hashOf(const fs::path& file)
{
    std::ifstream stream(file, std::ios::binary);
    return fnv1a(std::string(std::istreambuf_iterator<char>(stream), {}));
}

} // namespace

std::string contentHash(const fs::path& file) { return hex(hashOf(file)); }

std::string contentHash(const Scene& scene)
{
    std::uint64_t hash = 0;
    std::error_code code;
    for (const fs::path& file : usedFiles(scene))
        if (fs::is_regular_file(file, code)) hash = hashKey(hash, hashOf(file));
    return hex(hash);
}

fs::path keptFile(const fs::path& directory, const std::string& kind, const nlohmann::json& key,
                  const std::string& ending)
{
    return directory / (kind + "_" + hex(fnv1a(key.dump())) + ending);
}

void keep(const fs::path& file, const nlohmann::json& value)
{
    writeTextAtomically(file, value.dump(2) + '\n');
}

nlohmann::json readKept(const fs::path& file)
{
    std::ifstream stream(file);
    return stream ? nlohmann::json::parse(stream, nullptr, false) : nlohmann::json();
}

} // namespace volcomp
