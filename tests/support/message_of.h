// SPDX-License-Identifier: Apache-2.0
// The message of an expected failure.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"

namespace volcomp {

/// Calls f() and returns the message of the Error that it throws. If it throws none, the test fails
/// and the message is "no error".
template <class F>
std::string messageOf(F&& f)
{
    try {
        f();
    } catch (const Error& e) {
        return e.what();
    }
    ADD_FAILURE() << "expected an Error, nothing was thrown";
    return "no error";
}

} // namespace volcomp
