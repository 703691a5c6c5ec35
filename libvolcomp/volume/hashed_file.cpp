// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/hashed_file.h"

#include <algorithm>
#include <cstring>

#include "volcomp/base/random.h"

namespace volcomp {

HashedFile::HashedFile(const std::filesystem::path& file)
{
    m_file.open(file, std::ios::out | std::ios::binary | std::ios::trunc);
}

/// Two sums of words, each multiplied and folded after each word.
void HashedFile::add(const char* bytes, std::size_t count)
{
    std::uint64_t a = m_hash[0] ^ count, b = m_hash[1];
    for (std::size_t i = 0; i < count; i += sizeof(std::uint64_t)) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes + i, std::min(count - i, sizeof(word)));
        a = (a ^ word) * 0x9fb21c651e98df25;
        a ^= a >> 32;
        b = (b + word) * 0xd6e8feb86659fd93;
        b ^= b >> 29;
    }
    m_hash = {mix64(a), mix64(b ^ a)};
}

HashedFile::int_type HashedFile::overflow(int_type c)
{
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    const char byte = traits_type::to_char_type(c);
    add(&byte, 1);
    return m_file.sputc(byte);
}

std::streamsize HashedFile::xsputn(const char* bytes, std::streamsize count)
{
    add(bytes, static_cast<std::size_t>(count));
    return m_file.sputn(bytes, count);
}

HashedFile::pos_type HashedFile::seekoff(off_type offset, std::ios::seekdir from,
                                         std::ios::openmode mode)
{
    return m_file.pubseekoff(offset, from, mode);
}

HashedFile::pos_type HashedFile::seekpos(pos_type to, std::ios::openmode mode)
{
    return m_file.pubseekpos(to, mode);
}

int HashedFile::sync() { return m_file.pubsync(); }

} // namespace volcomp
