// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/key_docs.h"

#include <map>

#include <fmt/format.h>

namespace volcomp {

std::string keysAsMarkdown(const std::vector<KeyDoc>& docs)
{
    std::string text;
    std::map<std::string, std::vector<const KeyDoc*>> rows;
    std::vector<std::string> order;
    std::map<std::string, const KeyDoc*> heads;
    for (const KeyDoc& d : docs) {
        if (!rows.count(d.table)) order.push_back(d.table);
        auto& list = rows[d.table];
        if (d.key.empty()) heads[d.table] = &d;
        else list.push_back(&d);
    }
    for (const std::string& name : order) {
        const auto head = heads.find(name);
        const bool array = head != heads.end() && head->second->type == "array of tables";
        text += name.empty() ? "### at the top\n\n"
                             : fmt::format(array ? "### `[[{}]]`\n\n" : "### `[{}]`\n\n", name);
        if (head != heads.end()) text += head->second->meaning + ".\n\n";
        if (rows[name].empty()) continue;
        text += "| key | type | default | range | unit | meaning |\n|---|---|---|---|---|---|\n";
        for (const KeyDoc* d : rows[name])
            text += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", d->key, d->type,
                                d->fallback == "required" ? d->fallback : "`" + d->fallback + "`",
                                d->range, d->unit, d->meaning);
        text += "\n";
    }
    return text;
}

} // namespace volcomp
