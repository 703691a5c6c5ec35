// SPDX-License-Identifier: Apache-2.0
// `volcomp compare A B`: how far one picture is from another.
#pragma once

namespace volcomp {

/// The program for the arguments after `compare`; argv[0] is that word. Returns the exit status.
int compareMain(int argc, char** argv);

} // namespace volcomp
