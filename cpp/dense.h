// Transforms between the cells of a line and the eigenvectors of its Laplacian, as small dense products.
#pragma once

#include <vector>

namespace smokelift {

// c = a b for row-major matrices; c is m x n, a is m x k, b is k x n. Row lengths in memory are lda, ldb,
// ldc.
void multiply(int m, int n, int k, const float *a, int lda, const float *b, int ldb, float *c, int ldc);

// Sines or cosines on the points of a line, as rows of a matrix. Where the first ones are all symmetric about
// the middle of the line and the others antisymmetric, or the other way round, products cost half.
class Basis {
public:
    Basis() = default;
    // `vectors` holds the modes one after the other; the symmetry of the first `first` differs from that of
    // the rest. first = 0: no symmetry.
    Basis(int length, int first, const std::vector<double> &vectors);

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
    // The modes of one symmetry, on half of the points.
    struct Block {
        int start = 0, count = 0, points = 0;
        std::vector<float> analysis, synthesis; // count x points, points x count
    };
    int length_ = 0, modes_ = 0;
    bool folded_ = false;
    Block even_, odd_;
};

} // namespace smokelift
