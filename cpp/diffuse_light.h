// Light that has been scattered: its mean radiance on blocks of smoke.
#pragma once

#include "grid.h"

#include "threads.h"

#include <vector>

namespace smokelift {

// Smoke of one extinction and albedo a block. G takes emission (W/m^3/sr, the same in all directions) to mean
// radiance (W/m^2/sr), both the means of blocks.
class BlockTransport {
public:
    // Extinction in 1/m; `edge` is that of a block (m).
    BlockTransport(const float *extinction, float albedo, const Shape &n, float edge);

    // The mean radiance of all orders of scattering:  phi = G (emission + albedo extinction phi).
    void solve(const float *emission, float *phi, Workers &workers) const;

    // From the derivative by phi: that by the emission, and what to add to that by the extinction.
    void solve_adjoint(const float *emission, const float *phi, const float *of_phi, float *of_emission,
                       float *of_extinction, Workers &workers) const;

private:
    // What a block does to light that crosses it along a direction, on a path of length l: depth t = kappa l,
    // transmittance T = exp(-t), share (1 - T) / t of what it emits that leaves it, P, and the part (1 - P) /
    // t of the emission times l that is its own mean radiance, B. The derivatives of P and B are by t.
    struct Crossing {
        float length;
        std::vector<float> passed, escaped, own, of_escaped, of_own;
    };
    using Direction = std::array<int, 3>;

    static void cross(const float *extinction, std::size_t count, Crossing &crossing);
    const Crossing &crossing(const Direction &direction) const;
    template <class Visit> void sweep(const Direction &direction, const Visit &visit) const;
    template <class Work> void add_by_lines(float *result, Workers &workers, const Work &work) const;
    void add_mean(const Direction &direction, const float *emission, float *mean) const;
    void add_gradient(const Direction &direction, const float *emission, const float *weights,
                      float *arriving, float *result) const;
    void mean_radiance(const float *emission, float *mean, Workers &workers) const; // G
    // result += derivative of  weights^T G emission  by the extinction.
    void add_extinction_gradient(const float *emission, const float *weights, float *result,
                                 Workers &workers) const;

    Shape n_;
    float albedo_;
    std::vector<float> scattering_; // albedo x extinction
    Crossing axial_, diagonal_;
};

} // namespace smokelift
