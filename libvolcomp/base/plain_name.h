// SPDX-License-Identifier: Apache-2.0
// Names of files for libraries that do not take every name.
#pragma once

#include <filesystem>
#include <string>

namespace volcomp {

/// A name without a question mark for a file of any name: OpenImageIO takes what follows one for
/// arguments, and refuses the rest. It is good while the object lives, in this process alone.
class PlainName {
public:
    /// If the path has no question mark, the name is the path. If the directory has one, it is
    /// opened and the name leads through /proc/self/fd. If the file's own name has one, the file is
    /// opened, and the name has no extension. If nothing can be opened, the name is the path.
    explicit PlainName(const std::filesystem::path& file);
    ~PlainName();
    PlainName(const PlainName&) = delete;
    PlainName& operator=(const PlainName&) = delete;

    const std::string& text() const { return m_text; }

private:
    int m_fd = -1;
    std::string m_text;
};

} // namespace volcomp
