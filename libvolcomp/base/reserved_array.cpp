// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/reserved_array.h"

#include <algorithm>

#include <sys/mman.h>

namespace volcomp {

void* reservePages(std::size_t bytes)
{
    void* const pages = ::mmap(nullptr, std::max<std::size_t>(bytes, 1), PROT_READ | PROT_WRITE,
                               MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED) throw std::bad_alloc();
    return pages;
}

void releasePages(void* pages, std::size_t bytes)
{
    ::munmap(pages, std::max<std::size_t>(bytes, 1));
}

void emptyPages(void* pages, std::size_t bytes)
{
    if (bytes > 0) ::madvise(pages, bytes, MADV_DONTNEED);
}

} // namespace volcomp
