// SPDX-License-Identifier: Apache-2.0
// What memory there is, and what of it the program has.
#pragma once

namespace volcomp {

double machineMegabytes(); ///< of the whole machine
/// Of this process now, as far as it is in memory; 0 if the system does not say.
double residentMegabytes();
/// The most that this process has had in memory.
double peakMegabytes();
/// Gives memory that the C library keeps for later back to the machine.
void giveBackFreeMemory();

} // namespace volcomp
