// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/dome_suns.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace volcomp {
namespace {

constexpr double kAboveMean = 50;                   ///< luminance of a sun, times
constexpr double kBelowPeak = 0.01;                 ///< of its greatest, at least
constexpr double kLargest = 25 * kDegree * kDegree; ///< solid angle
constexpr double kLeastShare = 0.05;                ///< of the image's light

double luminance(const Vec3f& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

class SunFinder {
public:
    explicit SunFinder(DomeImage& image) : m_image(image)
    {
        for (int y = 0; y < image.height; ++y) {
            double row = 0;
            for (int x = 0; x < image.width; ++x)
                row += luminance(image.texels[image.placeOf(x, y)]);
            m_light += row * image.solidAngle(y);
        }
        m_threshold = kAboveMean * m_light / (4 * kPi);
    }

    std::vector<DomeSun> find()
    {
        std::vector<std::size_t> bright;
        for (std::size_t i = 0; i < m_image.texels.size(); ++i)
            if (luminance(m_image.texels[i]) > m_threshold) bright.push_back(i);
        std::stable_sort(bright.begin(), bright.end(), [&](std::size_t a, std::size_t b) {
            return luminance(m_image.texels[a]) > luminance(m_image.texels[b]);
        });
        std::unordered_set<std::size_t> seen; // a patch gives one sun at most
        std::vector<DomeSun> suns;
        for (const std::size_t peak : bright) {
            if (seen.count(peak)) continue;
            const double above =
                std::max(m_threshold, kBelowPeak * luminance(m_image.texels[peak]));
            const std::vector<std::size_t> patch = grow(peak, m_threshold), sun = grow(peak, above);
            seen.insert(patch.begin(), patch.end());
            if (isSun(sun)) suns.push_back(take(withBorder(sun)));
        }
        std::sort(m_image.suns.begin(), m_image.suns.end(),
                  [](const auto& a, const auto& b) { return a.first < b.first; });
        return suns;
    }

private:
    int rowOf(std::size_t place) const { return int(place / m_image.width); }

    /// Calls f(place) for the texels around one.
    template <class F>
    void around(std::size_t place, const F& f) const
    {
        const int w = m_image.width, x = int(place % w), y = rowOf(place);
        for (int j = std::max(0, y - 1); j <= std::min(m_image.height - 1, y + 1); ++j)
            for (int i = -1; i <= 1; ++i)
                if (const std::size_t other = m_image.placeOf((x + i + w) % w, j); other != place)
                    f(other);
    }

    /// The texels above a luminance that hang together with `from`.
    std::vector<std::size_t> grow(std::size_t from, double above) const
    {
        std::vector<std::size_t> patch{from};
        std::unordered_set<std::size_t> known{from};
        for (std::size_t next = 0; next < patch.size(); ++next)
            around(patch[next], [&](std::size_t place) {
                if (luminance(m_image.texels[place]) > above && known.insert(place).second)
                    patch.push_back(place);
            });
        return patch;
    }

    bool isSun(const std::vector<std::size_t>& patch) const
    {
        double size = 0, light = 0;
        for (const std::size_t place : patch) {
            const double angle = m_image.solidAngle(rowOf(place));
            size += angle;
            light += angle * luminance(m_image.texels[place]);
        }
        return size <= kLargest && light >= kLeastShare * m_light;
    }

    /// Adds the texels around it: the sun covers a part of those.
    std::vector<std::size_t> withBorder(std::vector<std::size_t> patch) const
    {
        std::unordered_set<std::size_t> known(patch.begin(), patch.end());
        for (std::size_t next = 0, size = patch.size(); next < size; ++next)
            around(patch[next], [&](std::size_t place) {
                if (known.insert(place).second) patch.push_back(place);
            });
        return patch;
    }

    Vec3f meanAround(const std::vector<std::size_t>& patch) const
    {
        const std::unordered_set<std::size_t> inside(patch.begin(), patch.end());
        std::unordered_set<std::size_t> border;
        Vec3d sum(0.0);
        double weight = 0;
        for (const std::size_t place : patch)
            around(place, [&](std::size_t other) {
                if (inside.count(other) || !border.insert(other).second) return;
                const double angle = m_image.solidAngle(rowOf(other));
                sum += angle * Vec3d(m_image.texels[other]);
                weight += angle;
            });
        return weight > 0 ? Vec3f(sum / weight) : Vec3f(0.0f);
    }

    DomeSun take(const std::vector<std::size_t>& patch)
    {
        const Vec3f fill = meanAround(patch);
        DomeSun sun{Vec3d(0.0), Vec3d(0.0), 0};
        double light = 0, squares = 0;
        for (const std::size_t place : patch) {
            Vec3f& texel = m_image.texels[place];
            const int row = rowOf(place);
            const double angle = m_image.solidAngle(row);
            Vec3f rest;
            for (int c = 0; c < 3; ++c) rest[c] = std::min(fill[c], texel[c]);
            const Vec3f more = texel - rest;
            const double l = luminance(more);
            light += angle * l;
            squares += angle * l * l;
            sun.irradiance += angle * Vec3d(more);
            sun.direction +=
                angle * l * m_image.direction(double(place % m_image.width) + 0.5, row + 0.5);
            m_image.suns.emplace_back(place, texel);
            texel = rest;
        }
        sun.direction.normalize();
        sun.disc = 2 * std::acos(1 - std::min(1.0, light * light / squares / (2 * kPi)));
        return sun;
    }

    DomeImage& m_image;
    double m_light = 0, m_threshold = 0;
};

} // namespace

std::vector<DomeSun> takeSuns(DomeImage& image) { return SunFinder(image).find(); }

} // namespace volcomp
