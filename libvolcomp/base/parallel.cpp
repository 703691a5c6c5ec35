// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/parallel.h"

#include <tbb/global_control.h>

namespace volcomp {

struct ThreadLimit::Impl {
    tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads)
{
    if (threads > 0)
        m_impl = std::unique_ptr<Impl>(new Impl{tbb::global_control(
            tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads))});
}

ThreadLimit::~ThreadLimit() = default;

} // namespace volcomp
