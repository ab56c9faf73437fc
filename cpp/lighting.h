// How light reaches the voxels, for one light: J = E p V, and the derivative of that. E is the energy of the
// light, p the phase function times albedo, V the transmittance from the light to the voxel: equations 4 and
// 5 of Cen, Zhang and Liang (2023).
#pragma once

#include "voxels.h"

#include "threads.h"

namespace smokelift {

// Henyey-Greenstein phase function times albedo towards a camera, 1/sr. `to_eye` maps the index of a voxel to
// the direction from there to the eye, of any length.
struct Phase {
    std::array<std::array<float, 4>, 3> to_eye{};
    float albedo = 1, anisotropy = 0;
};

// Parallel light. In the planes of voxels across its dominant axis a ray moves `slope` voxels per plane along
// the two other axes; `first` is the number of the first plane in the grid of which this one is a part.
struct ParallelLight {
    std::array<float, 3> direction{}; // of travel, unit length
    std::array<float, 3> energy{};    // irradiance by channel, W/m^2
    int axis = 0, travel = 1, first = 0;
    std::array<double, 2> slope{};
    float step = 0; // length of a ray between two planes, m
};

// Light from a point outside the grid.
struct PointLight {
    // A side of the cube around the light, and the planes of voxels in front of it, the nearest first.
    struct Face {
        int axis, travel;  // travel: +1 or -1
        int first, planes; // plane number n is first + travel n
        double far;        // distance of the plane where columns are one voxel apart, in voxels
        std::array<int, 2> columns_b, columns_c; // that meet the grid, along the two other axes: first, count
    };

    std::array<double, 3> position{}; // in grid coordinates, voxel centers at integers
    std::array<float, 3> energy{};    // intensity by channel over the voxel edge squared, W/m^2
    float voxel_size = 0;             // m
    std::vector<Face> faces;
};

// J of the voxels within the spans: that of this light, or with `add` that much more.
void shade(const Voxels &medium, const Spans &spans, const Phase &phase, const ParallelLight &light, bool add,
           Workers &workers);
void shade(const Voxels &medium, const Spans &spans, const Phase &phase, const PointLight &light, bool add,
           Workers &workers);

// Adds what J's derivative (the J channels of `gradient`) says of the extinction along the light's way to the
// extinction channel of `gradient`. `scratch` is one float per voxel. Parallel light that has made all of J
// needs none, and no sweep for it, but overwrites J's derivative.
void shade_adjoint(const Voxels &medium, const Voxels &gradient, const Voxels &scratch, const Spans &spans,
                   const Phase &phase, const ParallelLight &light, Workers &workers);
void shade_adjoint(const Voxels &medium, const Voxels &gradient, const Spans &spans, const Phase &phase,
                   const PointLight &light, Workers &workers);

} // namespace smokelift
