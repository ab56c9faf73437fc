// Light that has been scattered: its mean radiance on blocks of smoke.
#pragma once

#include "block_transport.h"

#include "threads.h"

#include <vector>

namespace smokelift {

// Light of all orders of scattering in smoke of one extinction and albedo a block.
class DiffuseLight {
public:
    static constexpr int FIELDS = Blocks::FIELDS;

    // Extinction in 1/m, [x][y][z]; `edge` is that of a block (m).
    DiffuseLight(const float *extinction, float albedo, const Shape &n, float edge);

    // Its mean radiance (W/m^2/sr), from what blocks emit (W/m^3/sr, the same in all directions):
    //     phi = G (emission + albedo extinction phi).
    // Blocks without extinction emit nothing. Arrays are [field][x][y][z], without a border.
    void solve(const float *emission, float *phi, Workers &workers) const;

    // From the derivative by phi: that by the emission, and what to add to that by the extinction.
    void solve_adjoint(const float *emission, const float *phi, const float *phi_gradient,
                       float *emission_gradient, float *extinction_gradient, Workers &workers) const;

private:
    using Fields = std::vector<float>;

    double product(const Fields &a, const Fields &b) const;
    Fields all_orders(Fields first, Workers &workers) const;
    Fields with_scattered(const Fields &phi, Fields emission) const;

    Lattice lattice_;
    float albedo_;
    Fields scattering_; // albedo x extinction
    BlockTransport transport_;
};

} // namespace smokelift
