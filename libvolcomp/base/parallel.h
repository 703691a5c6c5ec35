// Threads are TBB's; a limit set once in the programs holds for OpenVDB as well.
#pragma once

#include <memory>

namespace volcomp {

/// While it lives, at most `threads` threads work at a time; 0: as many as the machine has.
class ThreadLimit {
public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace volcomp
