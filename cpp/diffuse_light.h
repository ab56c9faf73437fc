// Light that has been scattered: its mean radiance on blocks of smoke.
#pragma once

#include "grid.h"

#include "threads.h"

#include <array>
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
    using Direction = std::array<int, 3>;

    // What a block does to light that crosses it along a direction of the class, on a path of length l: depth
    // t = kappa l, transmittance T = exp(-t), share P = (1 - T) / t of what it emits that leaves it, and P'
    // by t.
    struct Crossing {
        float length, weight; // m; of a direction of the class in the mean over all
        std::vector<float> passed, escaped, of_escaped;
    };
    // By class, the source P l e of the beams.
    using Sources = std::array<std::vector<float>, 2>;

    static void cross(const float *extinction, int directions, Crossing &crossing, std::vector<float> &own,
                      std::vector<float> &of_own);
    Sources sources(const float *emission) const;
    template <class Visit>
    void follow(const Direction &direction, const Sources &sources, const Visit &visit) const;
    void add_arriving(const Direction &direction, const Sources &sources, float *sum) const;
    void add_products(const Direction &direction, const Sources &forwards, const Sources &backwards,
                      float *kept, float *products) const;
    // Adds up, class by class, what work(direction, sum) adds for all directions, whatever the number of
    // threads.
    template <class Work> Sources sum_by_class(Workers &workers, const Work &work) const;
    void mean_radiance(const float *emission, float *mean, Workers &workers) const; // G
    // result += derivative of  weights^T G emission  by the extinction.
    void add_extinction_gradient(const float *emission, const float *weights, float *result,
                                 Workers &workers) const;

    Shape n_;
    float albedo_;
    std::vector<float> scattering_;   // albedo x extinction
    std::array<Crossing, 2> classes_; // axes, diagonals
    // Part of a block's emission that is its own mean radiance, over all directions, and the derivative by
    // kappa.
    std::vector<float> own_, of_own_;
};

} // namespace smokelift
