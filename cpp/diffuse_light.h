// Light that has been scattered: its mean radiance on blocks of smoke.
#pragma once

#include "blocks.h"

#include "threads.h"

#include <array>
#include <vector>

namespace smokelift {

// G over blocks of one extinction each: it takes emission (W/m^3/sr, the same in all directions) to mean
// radiance over all directions (W/m^2/sr). Both are linear across a block: four fields one after the other,
// each over all blocks: the mean, and the slopes along x, y and z, which are the differences across a block.
class BlockTransport {
public:
    static constexpr int FIELDS = Blocks::FIELDS;

    // Extinction in 1/m; `edge` is that of a block (m).
    BlockTransport(const float *extinction, const Shape &n, float edge);

    void mean_radiance(const float *emission, float *mean, Workers &workers) const;

    // result += derivative of  <weights, G emission>  by the extinction.
    void add_extinction_gradient(const float *emission, const float *weights, float *result,
                                 Workers &workers) const;

private:
    using Direction = std::array<int, 3>;

    // What a block does to light that crosses it along a direction of the class, on a path of length l: depth
    // t = kappa l, transmittance T = exp(-t), share P = (1 - T) / t of what it emits that leaves it, share Q
    // of the rise of the emission along the path; P' and Q' by t.
    struct Crossing {
        float length, weight; // m; of a direction of the class in the mean over all
        std::vector<float> passed, escaped, slanted, of_escaped, of_slanted;
    };
    static void cross(const float *extinction, Crossing &crossing, float along, float across,
                      std::array<std::vector<float>, 2> &own, std::array<std::vector<float>, 2> &of_own);
    template <class Visit>
    void follow(const Direction &direction, const float *passed, const float *source,
                const Visit &visit) const;
    const Crossing &crossing(int line) const;
    void sources_along(int line, const float *emission, float *along, float *against) const;
    void sources_across(int line, const float *slope, float *both) const;
    void arriving(int line, const float *along, const float *against, float *sum, float *difference) const;
    void arriving(int line, const float *both, float *sum) const;
    void gather(const float *emission, const float *sums, float *mean) const;
    void add_line_gradient(int line, const float *emission, const float *weights, float *result) const;

    Shape n_;
    std::array<Crossing, 2> classes_; // axes, diagonals
    // Part of a block's emission that is its own mean radiance over all directions, for the mean and for the
    // slopes, and the derivative by kappa.
    std::array<std::vector<float>, 2> own_, of_own_;
};

// Light of all orders of scattering in smoke of one extinction and albedo a block.
class DiffuseLight {
public:
    static constexpr int FIELDS = Blocks::FIELDS;

    DiffuseLight(const float *extinction, float albedo, const Shape &n, float edge);

    // Its mean radiance:  phi = G (emission + albedo extinction phi).  Blocks without extinction emit
    // nothing.
    void solve(const float *emission, float *phi, Workers &workers) const;

    // From the derivative by phi: that by the emission, and what to add to that by the extinction.
    void solve_adjoint(const float *emission, const float *phi, const float *of_phi, float *of_emission,
                       float *of_extinction, Workers &workers) const;

private:
    // A box of blocks.
    struct Part {
        Shape first, n;
    };
    static Part around_smoke(const float *extinction, const Shape &n);
    template <class Visit> void over_part(const Visit &visit) const;
    std::vector<float> cut(const float *values, int fields) const;
    std::vector<float> all_orders(std::vector<float> first, Workers &workers) const;
    void scatter(const std::vector<float> &in_smoke, const float *emission, float *phi,
                 std::vector<float> &source, Workers &workers) const;

    Shape n_;
    Part part_;
    float albedo_;
    std::vector<float> scattering_; // albedo x extinction, of the part
    BlockTransport everywhere_, smoke_;
};

} // namespace smokelift
