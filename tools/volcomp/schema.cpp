// SPDX-License-Identifier: Apache-2.0
#include "tools/volcomp/schema.h"

#include <cctype>
#include <map>
#include <sstream>

#include <nlohmann/json.hpp>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

using Json = nlohmann::ordered_json;

/// Parts of a text between separators.
std::vector<std::string> parts(const std::string& text, const std::string& separator)
{
    std::vector<std::string> result;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(separator, at), text.size());
        result.push_back(text.substr(at, end - at));
        at = end + separator.size();
    }
    return result;
}

double numberOf(const std::string& text)
{
    std::istringstream stream(text);
    stream.imbue(std::locale::classic());
    double number = 0;
    stream >> number;
    return number;
}

/// Adds the bounds that a range says: "0 to 1", ">= 0", "> 0" and "<= 2", some with commas between.
void addRange(Json& schema, const std::string& range)
{
    for (const std::string& bound : parts(range, ", ")) {
        if (const std::size_t to = bound.find(" to "); to != bound.npos) {
            schema["minimum"] = numberOf(bound.substr(0, to));
            schema["maximum"] = numberOf(bound.substr(to + 4));
        } else if (bound.rfind(">= ", 0) == 0) schema["minimum"] = numberOf(bound.substr(3));
        else if (bound.rfind("> ", 0) == 0) schema["exclusiveMinimum"] = numberOf(bound.substr(2));
        else if (bound.rfind("<= ", 0) == 0) schema["maximum"] = numberOf(bound.substr(3));
    }
}

/// A number or a whole number in a range.
Json numberType(const char* type, const std::string& range)
{
    Json schema{{"type", type}};
    addRange(schema, range);
    return schema;
}

/// An array of so many things; of any number of them if it is 0.
Json arrayOf(const Json& items, int count = 0)
{
    Json schema{{"type", "array"}, {"items", items}};
    if (count > 0) {
        schema["minItems"] = count;
        schema["maxItems"] = count;
    }
    return schema;
}

Json anyOf(std::initializer_list<Json> schemas) { return {{"anyOf", Json(schemas)}}; }

/// What a key of a type may be.
Json typeOf(const KeyDoc& d)
{
    Json number = numberType("number", d.range), text{{"type", "string"}};
    if (d.type == "number") return number;
    if (d.type == "integer") return numberType("integer", d.range);
    if (d.type == "boolean") return {{"type", "boolean"}};
    if (d.type == "string" || d.type == "path") return text;
    if (d.type == "paths") return anyOf({text, arrayOf(text)});
    if (d.type == "array of numbers") return arrayOf(number);
    if (d.type == "array of integers") return arrayOf(numberType("integer", d.range));
    if (d.type == "vector" || d.type == "direction") return arrayOf(number, 3);
    if (d.type == "span") return anyOf({number, arrayOf(number, 2)});
    if (d.type == "colour")
        return anyOf(
            {arrayOf(number, 3), number, {{"type", "string"}, {"pattern", "^#[0-9a-fA-F]{6}$"}}});
    if (d.type == "word") {
        Json words = Json::array();
        for (const std::string& word : parts(d.range, ", ")) words.push_back(word);
        return {{"enum", std::move(words)}};
    }
    return Json::object(); // of a type that is new: anything
}

Json keySchema(const KeyDoc& d)
{
    Json schema = typeOf(d);
    schema["description"] = d.meaning + (d.unit.empty() ? "" : " (" + d.unit + ")");
    const Json fallback = Json::parse(d.fallback, nullptr, false);
    if (!fallback.is_discarded()) schema["default"] = fallback;
    return schema;
}

/// A table of the scene file, while it is put together.
struct Table {
    std::string type, meaning; ///< type: of its heading
    Json properties = Json::object(), required = Json::array();
    std::map<std::string, Table> inner;
    std::vector<std::string> order; ///< of `inner`

    Table& at(const std::string& name)
    {
        if (!inner.count(name)) order.push_back(name);
        return inner[name];
    }
};

/// The table of a dotted name; NAME is the name that stands for any.
Table& tableAt(Table& root, const std::string& name)
{
    Table* table = &root;
    if (!name.empty())
        for (const std::string& part : parts(name, ".")) table = &table->at(part);
    return *table;
}

Json objectSchema(const Table& table)
{
    Json schema{{"type", "object"}};
    if (!table.meaning.empty()) schema["description"] = table.meaning;
    Json properties = table.properties;
    for (const std::string& name : table.order) {
        const Table& inner = table.inner.at(name);
        const Json object = objectSchema(inner);
        if (name == "NAME") schema["additionalProperties"] = object;
        else if (inner.type == "array of tables") properties[name] = arrayOf(object);
        else properties[name] = object;
    }
    if (!properties.empty()) schema["properties"] = std::move(properties);
    if (!table.required.empty()) schema["required"] = table.required;
    if (!schema.contains("additionalProperties")) schema["additionalProperties"] = false;
    return schema;
}

} // namespace

std::string keysAsSchema(const std::vector<KeyDoc>& docs)
{
    Table root;
    for (const KeyDoc& d : docs) {
        Table& table = tableAt(root, d.table);
        if (d.key.empty()) {
            table.type = d.type;
            table.meaning = d.meaning;
            continue;
        }
        table.properties[d.key] = keySchema(d);
        if (d.fallback == "required") table.required.push_back(d.key);
    }
    Table& level = tableAt(root, "box.NAME.level");
    level.required.clear();
    Table& preset = tableAt(root, "preset.NAME");
    const std::string meaning = preset.meaning;
    preset = level;
    preset.meaning = meaning;
    preset.properties.erase("use");
    Json schema{{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "volcomp scene"}};
    const Json object = objectSchema(root);
    for (const auto& [name, value] : object.items()) schema[name] = value;
    return schema.dump(2) + '\n';
}

} // namespace volcomp
