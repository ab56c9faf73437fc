// Steps of a projected descent: densities between 0 and a bound, each measured in units of its own scale.
#pragma once

#include "threads.h"

#include <cstddef>

namespace smokelift {

// The values, but 0 where the density is at a bound and the gradient leads beyond it. Both may be the same
// array.
void hold(const float *values, const float *gradient, const float *density, float bound, std::size_t count,
          float *held, Workers &workers);

// What a step starts from: the density, a direction and the unit that it is in, and the least room to move.
struct DescentStep {
    const float *density, *direction, *scale, *floor;
    float length;     // of the step against the direction
    float max_change; // of a density, as a share of it and its floor
    float bound;      // of the density
};

// The density where a step arrives, and the way there in units of the scale.
void descend(const DescentStep &step, std::size_t count, float *density, float *moved, Workers &workers);

} // namespace smokelift
