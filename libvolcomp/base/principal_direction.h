// SPDX-License-Identifier: Apache-2.0
// The direction that most of a voxel's fibres (or normals) share: the largest eigenvector of the
// sum of w t tᵀ (MODEL section 8).
#pragma once

#include <algorithm>
#include <cmath>

#include "volcomp/base/portable_math.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// A symmetric 3x3 matrix. For directions it is the sum of w t tᵀ, which is the same for t and -t
/// and has eigenvalues >= 0.
struct SymmetricTensor {
    double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

    void add(double w, const Vec3d& t)
    {
        xx += w * t[0] * t[0];
        yy += w * t[1] * t[1];
        zz += w * t[2] * t[2];
        xy += w * t[0] * t[1];
        xz += w * t[0] * t[2];
        yz += w * t[1] * t[2];
    }
    double trace() const { return xx + yy + zz; }
};

/// The largest eigenvector of a tensor with the eigenvalues l1 >= l2 >= l3, and how far directions
/// spread around it. A tensor of nothing has a zero direction and a spread of 1.
struct Principal {
    Vec3d direction{0.0}; ///< unit, its largest component positive
    double spread = 1;    ///< sqrt((l2 + l3) / (2 l1)), 0 to 1

    /// What a voxel stores, see VolumePart::direction.
    Vec3d stored() const { return direction * (1 - spread); }
};

/// Sets the eigenvalues, largest first, and their unit eigenvectors, by cyclic Jacobi rotations:
/// slower than the closed form, but exact also if eigenvalues are equal. OpenVDB's
/// diagonalizeSymmetricMatrix is no substitute: if all off-diagonal elements are between 1e-15 and
/// 1e-14 of the diagonal, it rotates an axis into itself and returns an eigenvector of length 0.7.
inline void jacobiEigen(const SymmetricTensor& s, double values[3], Vec3d vectors[3])
{
    double a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double tiny = 1e-32 * s.trace() * s.trace();
    for (int sweep = 0; sweep < 16; ++sweep) {
        if (a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2] <= tiny) break;
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0) continue;
                const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t =
                    (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), sine = t * c;
                for (int k = 0; k < 3; ++k) {
                    const double kp = a[k][p], kq = a[k][q];
                    a[k][p] = c * kp - sine * kq;
                    a[k][q] = sine * kp + c * kq;
                }
                for (int k = 0; k < 3; ++k) {
                    const double pk = a[p][k], qk = a[q][k];
                    a[p][k] = c * pk - sine * qk;
                    a[q][k] = sine * pk + c * qk;
                    const double vp = v[k][p], vq = v[k][q];
                    v[k][p] = c * vp - sine * vq;
                    v[k][q] = sine * vp + c * vq;
                }
            }
    }
    int order[3] = {0, 1, 2};
    if (a[order[0]][order[0]] < a[order[1]][order[1]]) std::swap(order[0], order[1]);
    if (a[order[1]][order[1]] < a[order[2]][order[2]]) std::swap(order[1], order[2]);
    if (a[order[0]][order[0]] < a[order[1]][order[1]]) std::swap(order[0], order[1]);
    for (int k = 0; k < 3; ++k) {
        values[k] = a[order[k]][order[k]];
        vectors[k] = Vec3d(v[0][order[k]], v[1][order[k]], v[2][order[k]]);
    }
}

/// Returns the principal direction of a tensor with eigenvalues >= 0. If the two largest
/// eigenvalues are equal (to 1e-6), the direction is the vector of their plane that is nearest to
/// `preferred`, provided that it is given and not perpendicular to the plane. Uses the closed form
/// (Smith, Eigenvalues of a symmetric 3x3 matrix, CACM 1961) if the largest eigenvalue stands
/// alone, Jacobi rotations otherwise.
inline Principal principalDirection(const SymmetricTensor& tensor, const Vec3d* preferred = nullptr)
{
    const double scale = std::max({tensor.xx, tensor.yy, tensor.zz});
    if (!(scale > 0) || !std::isfinite(tensor.trace())) return {};
    const double f = 1 / scale;
    if (!std::isfinite(f)) return {};
    const SymmetricTensor s{tensor.xx * f, tensor.yy * f, tensor.zz * f,
                            tensor.xy * f, tensor.xz * f, tensor.yz * f};
    const double trace = s.trace(), q = trace / 3;
    const double x = s.xx - q, y = s.yy - q, z = s.zz - q;
    const double off = s.xy * s.xy + s.xz * s.xz + s.yz * s.yz;
    const double p = std::sqrt((x * x + y * y + z * z + 2 * off) / 6);
    double largest = 0;
    Vec3d d(0.0);
    bool found = false;
    if (p > 1e-3 * q) {
        const double determinant = x * (y * z - s.yz * s.yz) - s.xy * (s.xy * z - s.yz * s.xz)
            + s.xz * (s.xy * s.yz - y * s.xz);
        const double r = determinant / (2 * p * p * p);
        if (r > -0.98) { // the two largest eigenvalues are apart
            largest = q + 2 * p * portable::cos(portable::acos(std::min(r, 1.0)) / 3);
            const Vec3d r0(s.xx - largest, s.xy, s.xz), r1(s.xy, s.yy - largest, s.yz),
                r2(s.xz, s.yz, s.zz - largest);
            const Vec3d c[3] = {r0.cross(r1), r0.cross(r2), r1.cross(r2)};
            const double n[3] = {c[0].lengthSqr(), c[1].lengthSqr(), c[2].lengthSqr()};
            const int best = n[0] >= n[1] ? (n[0] >= n[2] ? 0 : 2) : (n[1] >= n[2] ? 1 : 2);
            if (n[best] > 0) {
                d = c[best] / std::sqrt(n[best]);
                found = true;
            }
        }
    }
    if (!found) {
        double values[3];
        Vec3d vectors[3];
        jacobiEigen(s, values, vectors);
        largest = values[0];
        d = vectors[0];
        if (preferred && values[0] - values[1] <= 1e-6 * values[0]) {
            Vec3d in_plane = values[0] - values[2] <= 1e-6 * values[0]
                ? *preferred
                : *preferred - vectors[2] * vectors[2].dot(*preferred);
            if (const double length = in_plane.length(); length > 1e-6) d = in_plane / length;
        }
    }
    if (d[largestAxis(d)] < 0) d = -d;
    return {d, std::min(1.0, std::sqrt(std::max(0.0, trace - largest) / (2 * largest)))};
}

} // namespace volcomp
