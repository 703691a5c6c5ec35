// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/plain_name.h"

#include <fcntl.h>
#include <unistd.h>

namespace volcomp {

PlainName::PlainName(const std::filesystem::path& file) : m_text(file.string())
{
    if (m_text.find('?') == std::string::npos) return;
    const std::string name = file.filename().string();
    const bool whole = name.find('?') != std::string::npos;
    const std::filesystem::path opened = whole ? file : file.parent_path();
    m_fd = ::open(opened.c_str(), O_PATH | O_CLOEXEC);
    if (m_fd < 0) return;
    m_text = "/proc/self/fd/" + std::to_string(m_fd);
    if (!whole) m_text += "/" + name;
}

PlainName::~PlainName()
{
    if (m_fd >= 0) ::close(m_fd);
}

} // namespace volcomp
