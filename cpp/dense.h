// Transforms between the cells of a line and the eigenvectors of its Laplacian.
#pragma once

#include <vector>

namespace smokelift {

// The cosine and sine transforms of types I to IV for n intervals: cos or sin of
//     I  k pi i / n            II  k pi (i + 1/2) / n
//    III (k + 1/2) pi i / n    IV  (k + 1/2) pi (i + 1/2) / n
enum class Wave { cos1, sin1, cos2, sin2, cos3, sin3, cos4, sin4 };

// Each transform is split into two of half the size, with sums and differences of pairs of points before or
// rotations of pairs of modes after (as in Wang 1984), until what is left is small or odd; those are dense
// products.
class Basis {
public:
    Basis() = default;
    // Modes first ... first + count - 1 for n intervals, all that there are but for one that is zero or
    // constant, on lines of n cells (II, IV) or n + 1 faces (I, III).
    Basis(Wave wave, int n, int first, int count);

    // Lines are rows: `count` lines of `length` points one after the other, or as many of `modes`
    // coefficients. Input and output may be the same memory if length = modes.
    void rows_to_modes(const float *points, int count, float *modes, std::vector<float> &scratch) const;
    void rows_from_modes(const float *modes, int count, float *points, std::vector<float> &scratch) const;

    // Lines are columns: `count` neighbouring ones, their rows `stride` apart. Input and output may be the
    // same.
    void columns_to_modes(const float *points, int stride, int count, float *modes, int modes_stride,
                          std::vector<float> &scratch) const;
    void columns_from_modes(const float *modes, int modes_stride, int count, float *points, int stride,
                            std::vector<float> &scratch) const;

private:
    // Rows a and b of a line become aa a + ab b and ba a + bb b.
    struct Turn {
        int a, b;
        float aa, ab, ba, bb;
    };
    // A dense transform of the points start, start + stride, ... to the modes first, first + 1, ...
    struct Leaf {
        int start, stride, points, first, count;
        std::vector<float> analysis, synthesis; // count x points, points x count
    };

    std::vector<int> split(Wave wave, int n, const std::vector<int> &modes, int start, int stride);
    void analyse(float *points, float *modes) const;
    void synthesise(float *modes, float *points) const;

    int length_ = 0, modes_ = 0;
    std::vector<Turn> before_, after_;
    std::vector<Leaf> leaves_;
    std::vector<int> rows_, idle_; // where each mode is found; points that are zero in all
    std::vector<float> norms_;     // in the order of rows
};

} // namespace smokelift
