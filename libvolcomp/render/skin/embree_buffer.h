// SPDX-License-Identifier: Apache-2.0
// How lists become buffers of Embree's geometries.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <new>
#include <vector>

#include <embree3/rtcore.h>

namespace volcomp {

/// Copies the values into a new buffer of the geometry. Throws std::bad_alloc.
template <class T, std::size_t N>
void setBuffer(RTCGeometry g, RTCBufferType type, RTCFormat format,
               const std::vector<std::array<T, N>>& values)
{
    void* to = rtcSetNewGeometryBuffer(g, type, 0, format, sizeof(std::array<T, N>), values.size());
    if (!to) throw std::bad_alloc();
    std::copy(values.begin(), values.end(), static_cast<std::array<T, N>*>(to));
}

} // namespace volcomp
