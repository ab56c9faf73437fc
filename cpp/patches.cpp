#include "patches.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace smokelift {
namespace {

struct Ranked {
    std::uint32_t key; // in the order of the values
    std::uint32_t place;
};

std::uint32_t key_of(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, 4);
    return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

// By key, equal ones in the order of their places: radix sort in three passes of eleven bits.
void sort_by_key(std::vector<Ranked> &values, std::vector<Ranked> &room) {
    constexpr int bits = 11, buckets = 1 << bits;
    room.resize(values.size());
    for (int shift = 0; shift < 32; shift += bits) {
        std::array<std::uint32_t, buckets> next{};
        for (const Ranked &value : values)
            ++next[value.key >> shift & (buckets - 1)];
        std::uint32_t begin = 0;
        for (std::uint32_t &count : next)
            begin += std::exchange(count, begin);
        for (const Ranked &value : values)
            room[next[value.key >> shift & (buckets - 1)]++] = value;
        values.swap(room);
    }
}

} // namespace

void unfold(const float *picture, int columns, const Patches &patches, float *pixels, Workers &workers) {
    const int reach = patches.size / 2;
    workers.run(patches.size, [&](int down) {
        for (int across = 0; across < patches.size; ++across) {
            float *const line = pixels + std::size_t(down * patches.size + across) * patches.count;
            for (std::size_t n = 0; n < patches.count; ++n)
                line[n] = picture[std::size_t(patches.rows[n] + down - reach) * columns + patches.columns[n] +
                                  across - reach];
        }
    });
}

void fold(const float *pixels, const Patches &patches, int rows, int columns, float *picture) {
    const int reach = patches.size / 2;
    const std::size_t size = std::size_t(rows) * columns;
    std::fill_n(picture, size, 0.0f);
    std::vector<float> covered(size);
    for (int down = 0; down < patches.size; ++down)
        for (int across = 0; across < patches.size; ++across) {
            const float *const line = pixels + std::size_t(down * patches.size + across) * patches.count;
            for (std::size_t n = 0; n < patches.count; ++n) {
                const std::size_t at = std::size_t(patches.rows[n] + down - reach) * columns +
                                       patches.columns[n] + across - reach;
                picture[at] += line[n];
                covered[at] += 1;
            }
        }
    for (std::size_t at = 0; at < size; ++at)
        picture[at] /= std::max(covered[at], 1.0f);
}

void to_quantiles(float *values, int lines, std::size_t count, const float *wanted, std::size_t known,
                  Workers &workers) {
    workers.run(lines, [&](int number) {
        thread_local std::vector<Ranked> ranked, room;
        float *const line = values + number * count;
        const float *const quantiles = wanted + number * known;
        ranked.resize(count);
        for (std::size_t n = 0; n < count; ++n)
            ranked[n] = {key_of(line[n]), std::uint32_t(n)};
        sort_by_key(ranked, room);
        for (std::size_t rank = 0; rank < count; ++rank) {
            const double at = std::clamp((rank + 0.5) / count * known - 0.5, 0.0, double(known - 1));
            const std::size_t below = std::min(std::size_t(at), known - 1),
                              above = std::min(below + 1, known - 1);
            const float fraction = float(at - below);
            float &value = line[ranked[rank].place];
            value = quantiles[below] + fraction * (quantiles[above] - quantiles[below]) - value;
        }
    });
}

} // namespace smokelift
