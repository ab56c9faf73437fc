// One flight of light from block to block of smoke: from what blocks emit to the light that is in them.
#pragma once

#include "blocks.h"

#include "threads.h"

#include <algorithm>
#include <array>
#include <vector>

namespace smokelift {

// Where blocks lie in memory, [x][y][z] with z fastest: behind each row and behind each plane across x is a
// border, which nothing leaves. It is also what lies before the next, so that the neighbor in any direction
// is one offset away, and a whole plane is one loop.
struct Lattice {
    static constexpr int LANES = 8; // blocks that loops take at once, no row being shorter

    static constexpr int ROWS = 4; // rows that loops take at once

    Shape n{};

    int pitch() const { return std::max(n[2] + 1, LANES); }
    int plane() const { return (n[1] + 1) * pitch(); }
    std::size_t count() const { return std::max(std::size_t(n[0]) * plane(), std::size_t(ROWS) * pitch()); }
    std::size_t row(int x, int y) const { return std::size_t(x) * plane() + std::size_t(y) * pitch(); }
};

// G over blocks of one extinction each: it takes emission (W/m^3/sr, the same in all directions) to mean
// radiance over all directions (W/m^2/sr). Both are linear across a block: four fields one after the other,
// each over a lattice: the mean, and the slopes along x, y and z, which are the differences across a block.
class BlockTransport {
public:
    static constexpr int FIELDS = Blocks::FIELDS;
    static constexpr float SPREAD = 1.0f / 12; // mean of u^2, u from -1/2 to 1/2 (by definition)

    // Extinction in 1/m; `edge` is that of a block (m).
    BlockTransport(std::vector<float> extinction, const Lattice &lattice, float edge);

    void mean_radiance(const float *emission, float *mean, Workers &workers) const;

    // result += derivative of  <weights, G emission>  by the extinction.
    void add_extinction_gradient(const float *emission, const float *weights, float *result,
                                 Workers &workers) const;

private:
    using Fields = std::vector<float>;

    // What a block does to light that crosses it along a direction of the class, on a path of length l and
    // optical depth t = kappa l. The formulas (block_transport.cpp) and their names here:
    //
    //     T = exp(-t)      passed   fraction of what enters that leaves
    //     P = (1 - T) / t  escaped  fraction of the emission that leaves
    //     Q                slanted  fraction of the rise of the emission along the path that leaves
    //     B                kept     fraction of the emission that is the block's own mean
    //     C                tilted   fraction of the rise that is
    struct Crossing {
        float length, weight; // m; of a direction of the class in the mean over all
        float along, across;  // directions of the class: that a slope lies along, and across
        Fields passed, escaped, slanted;

        // The coefficients of neighboring blocks from one on.
        struct Row {
            const float *passed, *escaped, *slanted;
        };
        Row from(std::size_t first) const {
            return {passed.data() + first, escaped.data() + first, slanted.data() + first};
        }
    };
    // By the optical depth t: P' and Q'.
    struct DepthDerivatives {
        Fields escaped, slanted;
    };
    // Part of a block's emission that is its own mean radiance over all directions (m), for the mean and for
    // the slopes.
    using Own = std::array<Fields, 2>;

    void set_up(Crossing &crossing);
    void differentiate(const Crossing &crossing, DepthDerivatives &derivatives, Own &own_derivative) const;
    void clear_border(Fields &values) const;

    template <class Visit>
    void follow_rows(int axis, int way, const float *emission, const Visit &visit) const;
    template <class Visit> void follow_along_z(int way, const float *emission, const Visit &visit) const;
    template <class Visit>
    void follow_axis(int axis, int way, const float *emission, const Visit &visit) const;
    template <class Visit> void follow_diagonals(int way, const float *emission, const Visit &visit) const;

    void through_axis(int axis, const float *emission, float *mean) const;
    void through_diagonals(int way, const float *emission, float *sums) const;
    void gather(const float *emission, const float *parts, float *mean) const;

    void arriving_along_axis(int axis, int way, const float *emission, float *fields) const;
    void arriving_along_diagonals(int way, const float *emission, float *fields) const;
    void axis_gradient(int axis, const DepthDerivatives &derivatives, const float *emission,
                       const float *weights, float *result) const;
    void diagonal_gradient(const DepthDerivatives &derivatives, const float *emission, const float *weights,
                           float *result) const;

    Lattice lattice_;
    Fields extinction_;
    std::array<Crossing, 2> classes_; // axes, diagonals
    Own own_;
};

} // namespace smokelift
