// SPDX-License-Identifier: Apache-2.0
#include "volcomp/curves/curve_readers.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

using nlohmann::json;

class Sidecar {
public:
    Sidecar(const std::filesystem::path& file, const json& content, CurveSet& set)
        : m_file(file), m_content(content), m_set(set)
    {
    }

    void read()
    {
        if (!m_content.is_object()) throw fail("", "an object", m_content);
        if (const json* unit = find("unit")) {
            if (!unit->is_number() || !(unit->get<double>() > 0)
                || !std::isfinite(unit->get<double>()))
                throw fail("unit", "metres above 0", *unit);
            m_set.unit = unit->get<double>();
        }
        if (const json* up = find("up")) {
            if (*up == "x") m_set.up = UpAxis::x;
            else if (*up == "y") m_set.up = UpAxis::y;
            else if (*up == "z") m_set.up = UpAxis::z;
            else throw fail("up", "\"x\", \"y\" or \"z\"", *up);
            m_set.says_up = true;
        }
        forStrands("groups", [&](const json& value) {
            const double number = value.is_number_integer() ? value.get<double>() : 1e300;
            if (!(std::abs(number) <= 1e9)) throw fail("groups", "whole numbers up to 1e9", value);
            m_set.groups.push_back(value.get<std::int32_t>());
        });
        forStrands("guides", [&](const json& value) {
            if (!value.is_number_integer() && !value.is_boolean())
                throw fail("guides", "0 or 1", value);
            m_set.guides.push_back(value.is_boolean() ? value.get<bool>()
                                                      : value.get<std::int64_t>() != 0);
        });
        forStrands("root_uv", [&](const json& value) {
            if (!value.is_array() || value.size() != 2 || !value[0].is_number()
                || !value[1].is_number())
                throw fail("root_uv", "pairs [u, v]", value);
            m_set.root_uvs.emplace_back(value[0].get<float>(), value[1].get<float>());
        });
    }

private:
    const json* find(const char* key) const
    {
        const auto at = m_content.find(key);
        return at == m_content.end() ? nullptr : &*at;
    }
    Error fail(const char* place, const std::string& expected, const json& found) const
    {
        return fileError(m_file, place, expected,
                         found.dump(-1, ' ', true, json::error_handler_t::replace).substr(0, 60),
                         "Make it anew with volcomp-import.");
    }
    template <class F>
    void forStrands(const char* key, const F& take)
    {
        const json* const list = find(key);
        if (!list) return;
        if (!list->is_array() || list->size() != m_set.size())
            throw fileError(m_file, key,
                            fmt::format("one value for each of the {} strands", m_set.size()),
                            list->is_array() ? fmt::format("{}", list->size()) : "no list",
                            "Make it anew with volcomp-import.");
        if (std::string_view(key) == "root_uv") m_set.root_uvs.clear();
        for (const json& value : *list) take(value);
    }

    const std::filesystem::path& m_file;
    const json& m_content;
    CurveSet& m_set;
};

} // namespace

void readSidecar(const std::filesystem::path& file, std::string_view text, CurveSet& set)
{
    const json content = json::parse(text, nullptr, false);
    if (content.is_discarded())
        throw fileError(file, "", "JSON, as volcomp-import writes it", "something else",
                        "Make it anew with volcomp-import.");
    Sidecar(file, content, set).read();
}

} // namespace volcomp
