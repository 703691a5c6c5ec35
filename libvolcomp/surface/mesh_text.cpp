// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/mesh_text.h"

#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace volcomp {
namespace {

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
bool isLineEnd(char c) { return c == '\n' || c == '\r'; }

/// What std::from_chars calls out of range: true if the number is too small rather than too large.
bool isTiny(std::string_view word)
{
    if (const std::size_t e = word.find_first_of("eE"); e != word.npos)
        return word.substr(e + 1, 1) == "-";
    return word.find_first_of("123456789") > word.find('.');
}

} // namespace

std::string inQuotes(std::string_view word)
{
    std::string s = "'";
    for (const char c : word.substr(0, 40)) s += c >= ' ' && c <= '~' ? c : '?';
    return s + (word.size() > 40 ? "...'" : "'");
}

MeshText::MeshText(std::filesystem::path file, std::string_view text, Style style)
    : m_file(std::move(file)), m_text(text), m_style(style)
{
}

void MeshText::skipLineEnd()
{
    const bool two = m_text.substr(m_at, 2) == "\r\n";
    m_at += two ? 2 : 1;
    ++m_line;
}

void MeshText::skipBlanks()
{
    while (m_at < m_text.size()) {
        const char c = m_text[m_at];
        if (isBlank(c)) ++m_at;
        else if (c == '\\' && m_style == Style::obj && m_at + 1 < m_text.size()
                 && isLineEnd(m_text[m_at + 1]))
            ++m_at, skipLineEnd();
        else if (c == '#' && m_style != Style::plain)
            while (m_at < m_text.size() && !atLineEnd()) ++m_at;
        else return;
    }
}

std::string_view MeshText::word()
{
    skipBlanks();
    const std::size_t first = m_at;
    while (m_at < m_text.size() && !isBlank(m_text[m_at]) && !atLineEnd()) {
        if (m_text[m_at] == '#' && m_style != Style::plain) break;
        if (m_text[m_at] == '\\' && m_style == Style::obj && m_at + 1 < m_text.size()
            && isLineEnd(m_text[m_at + 1]))
            break;
        ++m_at;
    }
    return m_text.substr(first, m_at - first);
}

std::string_view MeshText::anyWord()
{
    for (;;)
        if (const std::string_view w = word(); !w.empty() || !nextLine()) return w;
}

std::string_view MeshText::restOfLine()
{
    while (m_at < m_text.size() && isBlank(m_text[m_at])) ++m_at;
    const std::size_t first = m_at;
    while (m_at < m_text.size() && !atLineEnd()) ++m_at;
    std::string_view rest = m_text.substr(first, m_at - first);
    if (m_style != Style::plain)
        for (std::size_t k = 0; k < rest.size(); ++k)
            if (rest[k] == '#' && (k == 0 || isBlank(rest[k - 1]))) rest = rest.substr(0, k);
    while (!rest.empty() && isBlank(rest.back())) rest.remove_suffix(1);
    return rest;
}

bool MeshText::nextLine()
{
    while (m_at < m_text.size() && !atLineEnd()) {
        if (m_text[m_at] == '\\' && m_style == Style::obj && m_at + 1 < m_text.size()
            && isLineEnd(m_text[m_at + 1])) {
            ++m_at;
            skipLineEnd();
        } else ++m_at;
    }
    if (m_at == m_text.size()) return false;
    skipLineEnd();
    return true;
}

double MeshText::finite(const char* what)
{
    const std::string_view w = word();
    const double x = number(w, what);
    if (!std::isfinite(x)) throw error(fmt::format("a finite {}", what), inQuotes(w));
    return x;
}

double MeshText::number(std::string_view word, const char* what) const
{
    std::string_view digits = word;
    if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
    double x = 0;
    const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
    if (code == std::errc::invalid_argument || end != digits.data() + digits.size())
        throw error(fmt::format("a number for {}", what),
                    word.empty() ? "the end of the line" : inQuotes(word));
    if (code == std::errc::result_out_of_range)
        return isTiny(digits) ? 0 : std::numeric_limits<double>::infinity();
    return x;
}

std::int64_t MeshText::whole(std::string_view word, const char* what) const
{
    std::string_view digits = word;
    if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
    std::int64_t x = 0;
    const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
    if (code != std::errc() || end != digits.data() + digits.size())
        throw error(fmt::format("a whole number for {}", what),
                    word.empty() ? "no more" : inQuotes(word));
    return x;
}

Error MeshText::error(const std::string& expected, const std::string& found,
                      const std::string& hint) const
{
    return fileError(m_file, fmt::format("line {}", m_line), expected, found, hint);
}

} // namespace volcomp
