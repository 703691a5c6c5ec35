// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/picture_pyramid.h"

#include <algorithm>
#include <cmath>

namespace volcomp {

double widthOf(double area, double border)
{
    const double half = border / 2, square = half * half - 4 * area;
    return square > 0 ? (half - std::sqrt(square)) / 2 : std::sqrt(area);
}

PicturePyramid::PicturePyramid(const Texture& texture, int channel, double cutoff)
{
    Level finest{texture.width, texture.height, {}};
    finest.values.reserve(std::size_t(texture.width) * texture.height * 4);
    for (int y = 0; y < texture.height; ++y)
        for (int x = 0; x < texture.width; ++x) {
            const double u = (x + 0.5) / texture.width, v = 1 - (y + 0.5) / texture.height;
            const bool there = channel < 0 || texture.sample(u, v, channel, Wrap::repeat) >= cutoff;
            const Vec3f colour = texture.colour(u, v, Wrap::repeat);
            finest.values.push_back(there ? 1 : 0);
            for (int k = 0; k < 3; ++k) finest.values.push_back(there ? colour[k] : 0);
        }
    m_levels.push_back(std::move(finest));
    if (channel >= 0) measureWidth();
    while (m_levels.back().width > 1 || m_levels.back().height > 1) {
        const Level& fine = m_levels.back();
        Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
        coarse.values.assign(std::size_t(coarse.width) * coarse.height * 4, 0.0f);
        for (int y = 0; y < coarse.height; ++y)
            for (int x = 0; x < coarse.width; ++x) {
                const int columns = std::min(2, fine.width - 2 * x),
                          rows = std::min(2, fine.height - 2 * y);
                float* to = &coarse.values[(std::size_t(y) * coarse.width + x) * 4];
                for (int j = 0; j < rows; ++j)
                    for (int i = 0; i < columns; ++i)
                        for (int k = 0; k < 4; ++k)
                            to[k] +=
                                fine.values[(std::size_t(2 * y + j) * fine.width + 2 * x + i) * 4
                                            + std::size_t(k)]
                                / float(columns * rows);
            }
        m_levels.push_back(std::move(coarse));
    }
}

void PicturePyramid::measureWidth()
{
    const Level& l = m_levels[0];
    const auto there = [&](int x, int y) {
        return l.values[(std::size_t(y % l.height) * l.width + std::size_t(x % l.width)) * 4] > 0;
    };
    double area = 0, border = 0;
    for (int y = 0; y < l.height; ++y)
        for (int x = 0; x < l.width; ++x) {
            area += there(x, y);
            border += (there(x, y) != there(x + 1, y)) + (there(x, y) != there(x, y + 1));
        }
    // Stairs of texels are 4 / pi longer than the line that they follow, mean over its directions.
    if (area > 0 && border > 0) m_width = widthOf(area, border * kPi / 4);
}

Vec2d PicturePyramid::size() const
{
    return {double(m_levels[0].width), double(m_levels[0].height)};
}

PicturePyramid::Mean PicturePyramid::at(const Vec2d& uv, double texels) const
{
    std::size_t level = 0;
    for (double size = 1.5; size < texels && level + 1 < m_levels.size(); size *= 2) ++level;
    const Level& l = m_levels[level];
    if (!(std::abs(uv[0]) < 1e9 && std::abs(uv[1]) < 1e9)) return {};
    const double u = uv[0] - std::floor(uv[0]), v = 1 - (uv[1] - std::floor(uv[1]));
    const int x = std::clamp(int(u * l.width), 0, l.width - 1),
              y = std::clamp(int(v * l.height), 0, l.height - 1);
    const float* from = &l.values[(std::size_t(y) * l.width + x) * 4];
    if (!(from[0] > 0)) return {};
    return {from[0], Vec3f(from[1], from[2], from[3]) / from[0]};
}

} // namespace volcomp
