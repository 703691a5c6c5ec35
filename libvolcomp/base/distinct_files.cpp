// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/distinct_files.h"

#include <algorithm>

#include <sys/stat.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// What tells files apart.
struct Identity {
    const NamedFile* named;
    bool exists, regular;
    dev_t device;
    ino_t inode;
    fs::path path; ///< absolute and without links
};

std::vector<Identity> identitiesOf(const std::vector<NamedFile>& files)
{
    std::vector<Identity> all;
    for (const NamedFile& named : files) {
        if (named.file.empty()) continue;
        struct stat found { };
        const bool exists = ::stat(named.file.c_str(), &found) == 0;
        std::error_code code;
        fs::path path = fs::weakly_canonical(fs::absolute(linkTarget(named.file)), code);
        all.push_back({&named, exists, !exists || S_ISREG(found.st_mode), found.st_dev,
                       found.st_ino, std::move(path)});
    }
    return all;
}

bool same(const Identity& a, const Identity& b)
{
    if (!a.regular || !b.regular) return false;
    if (a.exists && b.exists) return a.device == b.device && a.inode == b.inode;
    return a.path == b.path;
}

/// Whether `b` lies below `a`, which is no directory.
bool isAbove(const Identity& a, const Identity& b)
{
    return a.regular && a.path.native().size() < b.path.native().size()
        && std::mismatch(a.path.begin(), a.path.end(), b.path.begin(), b.path.end()).first
        == a.path.end();
}

} // namespace

void requireDistinct(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs)
{
    const std::vector<Identity> in = identitiesOf(inputs), out = identitiesOf(outputs);
    const auto refuse = [](const Identity& output, const std::string& found) {
        throw fileError(output.named->file, output.named->name, "a file of its own to write", found,
                        "Choose another name.");
    };
    for (std::size_t o = 0; o < out.size(); ++o) {
        for (const Identity& input : in)
            if (same(out[o], input))
                refuse(out[o],
                       "the one that is read as " + input.named->name + " ("
                           + input.named->file.string() + ")");
        for (std::size_t p = 0; p < o; ++p) {
            if (same(out[o], out[p]))
                refuse(out[o],
                       "the one that is written as " + out[p].named->name + " ("
                           + out[p].named->file.string() + ")");
            if (isAbove(out[o], out[p]) || isAbove(out[p], out[o]))
                refuse(out[o],
                       "one that would be in, or above, " + out[p].named->name + " ("
                           + out[p].named->file.string() + ")");
        }
    }
}

} // namespace volcomp
