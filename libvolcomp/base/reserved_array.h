// SPDX-License-Identifier: Apache-2.0
// An array that several threads append to and that never moves: its addresses are reserved at once,
// its memory is taken as it is written.
#pragma once

#include <atomic>
#include <cstddef>
#include <new>
#include <type_traits>

namespace volcomp {

/// Addresses for `bytes` bytes, which read as zeros; memory is taken page by page when they are
/// first written. Throws std::bad_alloc. Free with releasePages().
void* reservePages(std::size_t bytes);
void releasePages(void* pages, std::size_t bytes);
/// Gives the memory of whole pages back; they read as zeros again.
void emptyPages(void* pages, std::size_t bytes);

/// Up to `capacity` elements, whose bytes are zeros until they are written.
template <class T>
class ReservedArray {
    static_assert(std::is_trivially_destructible_v<T>);

public:
    explicit ReservedArray(std::size_t capacity)
        : m_data(static_cast<T*>(reservePages(capacity * sizeof(T)))), m_capacity(capacity)
    {
    }
    ~ReservedArray() { releasePages(m_data, m_capacity * sizeof(T)); }
    ReservedArray(const ReservedArray&) = delete;
    ReservedArray& operator=(const ReservedArray&) = delete;

    T* data() const { return m_data; }
    std::size_t size() const { return m_size.load(std::memory_order_relaxed); }
    /// Appends `count` elements and returns the number of the first. For several threads at once.
    /// Throws std::bad_alloc if there is no room.
    std::size_t append(std::size_t count)
    {
        const std::size_t first = m_size.fetch_add(count, std::memory_order_relaxed);
        if (first + count > m_capacity) throw std::bad_alloc();
        return first;
    }
    /// Takes all elements out and gives their memory back. No other thread may use them.
    void clear()
    {
        emptyPages(m_data, m_capacity * sizeof(T));
        m_size = 0;
    }

private:
    T* const m_data;
    const std::size_t m_capacity;
    std::atomic<std::size_t> m_size{0};
};

} // namespace volcomp
