// SPDX-License-Identifier: Apache-2.0
// How a stage reports how much of its work is done.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <mutex>

namespace volcomp {

/// A stage calls it with the fraction done, 0 to 1, which never falls, from one thread at a time.
/// An empty function is allowed: call it through report(). It must be quick; the tools' progress
/// bar limits its own rate.
using Progress = std::function<void(double fraction)>;

inline void report(const Progress& progress, double fraction)
{
    if (progress) progress(fraction);
}

/// Counts work that several threads finish and reports the fraction of the total, which is above 0.
/// A thread that finds another one reporting does not wait, so the last fraction that is reported
/// may be below 1. Keeps a reference to the progress function, which must outlive it.
class SharedProgress {
public:
    SharedProgress(const Progress& progress, std::size_t total)
        : m_progress(progress), m_total(total)
    {
    }

    void add(std::size_t finished = 1)
    {
        m_done += finished;
        if (const std::unique_lock lock(m_reporting, std::try_to_lock); lock)
            report(m_progress, double(m_done) / double(m_total));
    }

private:
    const Progress& m_progress;
    std::size_t m_total;
    std::atomic<std::size_t> m_done{0};
    std::mutex m_reporting;
};

} // namespace volcomp
