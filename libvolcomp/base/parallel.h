// SPDX-License-Identifier: Apache-2.0
// How many threads work. All threads are TBB's, those of OpenVDB as well.
#pragma once

#include <memory>

namespace volcomp {

/// While an object lives, at most `threads` threads of this process work at a time. With 0 there is
/// no limit beside TBB's own: one thread for each core.
class ThreadLimit {
public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace volcomp
