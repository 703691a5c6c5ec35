// SPDX-License-Identifier: Apache-2.0
// Things by their names, which other keys of a scene use. Private to the reader.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace volcomp {

/// A list of things that have a member `name`, no two of one name. Looking for a name takes no time
/// that grows with the list. Copies of a list share the things.
template <class T>
class Known {
public:
    /// Appends a thing. Returns false, and appends nothing, if there is one of its name.
    bool add(std::shared_ptr<const T> thing)
    {
        if (!m_index.emplace(thing->name, thing.get()).second) return false;
        m_all.push_back(std::move(thing));
        return true;
    }
    bool add(T thing) { return add(std::make_shared<const T>(std::move(thing))); }

    /// Returns null if there is none of that name.
    const T* find(const std::string& name) const
    {
        const auto at = m_index.find(name);
        return at == m_index.end() ? nullptr : at->second;
    }

    const std::vector<std::shared_ptr<const T>>& all() const { return m_all; }

    /// Returns the names for a message, the first twenty of them.
    std::string names() const
    {
        std::string text;
        for (std::size_t i = 0; i < m_all.size() && i < 20; ++i)
            text += (i == 0 ? "" : ", ") + m_all[i]->name;
        if (m_all.size() > 20) text += ", ...";
        return text.empty() ? "there is none" : text;
    }

private:
    std::vector<std::shared_ptr<const T>> m_all;
    std::unordered_map<std::string_view, const T*> m_index; ///< the keys are the things' names
};

} // namespace volcomp
