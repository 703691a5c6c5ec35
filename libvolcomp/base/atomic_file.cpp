// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/atomic_file.h"

#include <fstream>

#include <unistd.h>

#include "volcomp/base/error.h"

namespace volcomp {

namespace fs = std::filesystem;

void writeAtomically(const fs::path& file, const std::function<void(const fs::path&)>& write)
{
    std::error_code code;
    const fs::path directory = file.has_parent_path() ? file.parent_path() : fs::path(".");
    if (file.filename().empty() || fs::is_directory(file, code))
        throw fileError(file, "", "the name of a file to write", "a directory");
    fs::create_directories(directory, code);
    if (!fs::is_directory(directory, code))
        throw fileError(file, "", "a directory to write into", "none at " + directory.string(),
                        "It could not be made; check the path and your rights.");
    const fs::path temporary = directory
        / (file.stem().string() + "." + std::to_string(::getpid()) + ".part"
           + file.extension().string());
    try {
        write(temporary);
        fs::rename(temporary, file, code);
        if (code)
            throw Error(file.string() + ": could not be put in place: " + code.message() + ".");
    } catch (...) {
        fs::remove(temporary, code);
        throw;
    }
}

void writeStreamAtomically(const fs::path& file, const std::function<void(std::ostream&)>& write)
{
    writeAtomically(file, [&](const fs::path& temporary) {
        std::ofstream stream(temporary, std::ios::binary);
        write(stream);
        if (!stream.flush())
            throw fileError(file, "", "a file to write", "an error", "Is the disk full?");
    });
}

void writeTextAtomically(const fs::path& file, const std::string& text)
{
    writeStreamAtomically(file, [&](std::ostream& stream) { stream << text; });
}

} // namespace volcomp
