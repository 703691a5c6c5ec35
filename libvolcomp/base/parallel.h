// SPDX-License-Identifier: Apache-2.0
// How many threads work. All threads are TBB's, those of OpenVDB as well.
#pragma once

#include <memory>

namespace volcomp {

/// While an object lives, at most `threads` threads of this process work at a time. With 0 or less
/// it sets no limit, and TBB's own holds: one thread for each core. Of several objects the lowest
/// limit holds. It can be neither copied nor moved.
class ThreadLimit {
public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace volcomp
