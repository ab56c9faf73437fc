#include "descent.h"

#include "compiler.h"

#include <algorithm>

namespace smokelift {
namespace {

constexpr std::size_t CHUNK = std::size_t(1) << 14;

SMOKELIFT_CLONES
void hold_range(const float *values, const float *gradient, const float *density, float bound,
                std::size_t begin, std::size_t end, float *held) {
    for (std::size_t n = begin; n < end; ++n) {
        const bool stays = (density[n] <= 0 && gradient[n] > 0) || (density[n] >= bound && gradient[n] < 0);
        held[n] = stays ? 0.0f : values[n];
    }
}

SMOKELIFT_CLONES
void descend_range(const DescentStep &step, std::size_t begin, std::size_t end, float *__restrict density,
                   float *__restrict moved) {
    for (std::size_t n = begin; n < end; ++n) {
        const float now = step.density[n];
        const float reach = step.max_change * (now + step.floor[n]);
        const float lowest = std::max(now - reach, 0.0f), highest = std::min(now + reach, step.bound);
        const float wanted = step.direction[n] * -step.length * step.scale[n] + now;
        density[n] = std::min(std::max(wanted, lowest), highest);
        moved[n] = (density[n] - now) / step.scale[n];
    }
}

} // namespace

void hold(const float *values, const float *gradient, const float *density, float bound, std::size_t count,
          float *held, Workers &workers) {
    workers.run_ranges(count, CHUNK, [&](std::size_t begin, std::size_t end) {
        hold_range(values, gradient, density, bound, begin, end, held);
    });
}

void descend(const DescentStep &step, std::size_t count, float *density, float *moved, Workers &workers) {
    workers.run_ranges(count, CHUNK, [&](std::size_t begin, std::size_t end) {
        descend_range(step, begin, end, density, moved);
    });
}

} // namespace smokelift
