// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/memory.h"

#include <fstream>

#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/resource.h>
#include <unistd.h>

namespace volcomp {
namespace {

constexpr double kMegabyte = 1048576;

} // namespace

double machineMegabytes()
{
    return double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE)) / kMegabyte;
}

double residentMegabytes()
{
    double all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return resident * double(sysconf(_SC_PAGE_SIZE)) / kMegabyte;
}

double peakMegabytes()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

void giveBackFreeMemory()
{
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

} // namespace volcomp
