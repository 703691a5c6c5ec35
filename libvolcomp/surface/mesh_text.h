// SPDX-License-Identifier: Apache-2.0
// The text of a mesh file, word by word, with numbers that do not depend on the locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "volcomp/base/error.h"

namespace volcomp {

/// Walks over a text that outlives it. Lines end in LF, CR LF or CR. What it returns points into
/// the text. The errors it makes name the file and the line.
class MeshText {
public:
    enum class Style {
        plain,
        comments, ///< `#` begins a comment, up to the end of the line
        obj       ///< comments, and a line that ends in a backslash goes on in the next
    };
    MeshText(std::filesystem::path file, std::string_view text, Style style);

    /// The next word of this line; empty if the line has no more.
    std::string_view word();
    /// The next word of this line or, if it has no more, of those that follow; empty at the end.
    std::string_view anyWord();
    /// The rest of this line without blanks at both ends, as names of files need it. Here a comment
    /// begins with ` #`.
    std::string_view restOfLine();
    /// Goes to the start of the next line. Returns false at the end of the text.
    bool nextLine();

    /// word() as a finite number. `what` says which one, for the message.
    double finite(const char* what);
    /// A word as a number, which may be infinite or NaN. Too large is infinite, too small is 0.
    double number(std::string_view word, const char* what) const;
    /// A word as a whole number.
    std::int64_t whole(std::string_view word, const char* what) const;

    /// Counted from 1.
    std::size_t line() const { return m_line; }
    std::size_t position() const { return m_at; }
    std::size_t bytesLeft() const { return m_text.size() - m_at; }
    const std::filesystem::path& file() const { return m_file; }
    /// The error for this line.
    Error error(const std::string& expected, const std::string& found,
                const std::string& hint = {}) const;

private:
    bool atLineEnd() const { return m_text[m_at] == '\n' || m_text[m_at] == '\r'; }
    void skipLineEnd();
    void skipBlanks();

    std::filesystem::path m_file;
    std::string_view m_text;
    Style m_style;
    std::size_t m_at = 0, m_line = 1;
};

/// A word for a message: in quotes, without unprintable bytes, and not too long.
std::string inQuotes(std::string_view word);

} // namespace volcomp
