// How ShadowSweep's light is pushed through the volume: of use to shadow_sweep.cpp alone.
#pragma once

#include <memory>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "volcomp/render/shadow/shadow_sweep.h"

namespace volcomp {

/// Fills one field: what is asked for (shadow_sweeper.cpp), then, layer by layer, keeps it and
/// moves the light on (shadow_sweeper_push.cpp).
class ShadowSweep::Sweeper {
public:
    Sweeper(const ShadowSweep& sweep, Field& field, const Light& light,
            const std::vector<float>& seen)
        : m_sweep(sweep), m_tree(sweep.m_tree), m_field(field), m_lattice(field.lattice),
          m_light(light), m_seen(seen)
    {
    }

    /// False where nothing is asked for.
    bool run();

private:
    struct Cell { // a leaf where it stands: its lowest b and c
        int leaf, b, c;
        Rectangle under;   // the bundles whose rays pass it, or between whose rays its points lie
        bool asks = false; // for light
    };
    struct Bundle {
        std::unique_ptr<float[]>
            sums;       ///< density x slices along each ray; none before the first particle
        int stamp = -1; ///< layer it was last moved through
        bool dark = false;
        float least = 0; ///< of the sums
    };
    static constexpr int kMaxLeaves = 4; // under a bundle in a layer, along b or c
    static constexpr int kBlockDim3 = kMaxLeaves * kLeafDim,
                         kBlockSize = kBlockDim3 * kBlockDim3 * kLeafDim;
    static constexpr int kMargin =
        kBlockDim3 * kLeafDim + kLeafDim; // around the block, read with weight 0
    struct Scratch {
        std::vector<float> block = std::vector<float>(kBlockSize + 2 * kMargin);
    };

    static int floorDivide(int x, int y) { return x >= 0 ? x / y : -((y - 1 - x) / y); }
    double planeAt(int plane) const { return m_field.first_s + double(kLeafDim) * plane; }
    void sortLeaves();
    bool asks(const Cell& cell, int layer) const;
    void setSpacing();
    Rectangle under(const Cell& cell, int layer) const;
    void lookUnder();
    void markNeeded();
    void keep(int layer);
    double rayLength(int b, int c) const;
    void write(int b, int c, bool fine, std::uint8_t* codes) const;
    void advance(int layer);
    void makeEffective(const Cell& cell, int layer, float* to) const;
    void move(int bundle_b, int bundle_c, int layer, double s, double end, Scratch& scratch);
    struct Row;
    bool fill(int layer, const int* low, const int* count, int row_stride, int slice_stride,
              float* block) const;

    const ShadowSweep& m_sweep;
    const VoxelTree& m_tree;
    Field& m_field;
    LightLattice m_lattice;
    const Light& m_light;
    const std::vector<float>& m_seen;
    std::vector<std::vector<Cell>> m_cells; // by layer, as the light comes
    Rectangle m_all;
    std::vector<int> m_last;      // plane that asks for a bundle last
    std::vector<float> m_weights; // by patch: the greatest of the leaves behind it
    std::vector<Bundle> m_bundles;
    std::vector<int> m_effective_of; // of the layer's leaves under fibre extinction
    std::vector<float> m_effective;
    tbb::enumerable_thread_specific<Scratch> m_scratch;
};

} // namespace volcomp
