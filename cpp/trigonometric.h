// Discrete cosine and sine transforms of lines (Strang 1999, SIAM Review 41, 135; Martucci 1994, IEEE Trans.
// Signal Processing 42, 1038). A solve takes half the time that it takes with a library's
// (docs/experiments/velocity-solver.md).
#pragma once

#include <cstddef>
#include <vector>

namespace smokelift {

// DCT-I ... DST-IV for n intervals: the expansion of the points i in the modes k, cos (DCT) or sin (DST) of
//     I  k pi i / n            II  k pi (i + 1/2) / n
//    III (k + 1/2) pi i / n    IV  (k + 1/2) pi (i + 1/2) / n
enum class Transform { dct1, dst1, dct2, dst2, dct3, dst3, dct4, dst4 };

// Lines whose elements are `along` from one to the next in memory, and those of neighboring lines `apart`:
// one of the two is 1.
template <class T> struct Lines {
    T *first;
    std::ptrdiff_t along, apart;

    T *at(int i, int line = 0) const { return first + i * along + line * apart; }
    Lines from(int line) const { return {at(0, line), along, apart}; }
};

// Each transform is split into two of half the size, with sums and differences of pairs of points before or
// rotations of pairs of modes after (Wang 1984, IEEE Trans. ASSP 32, 803), until what is left is small or
// odd. That is a dense product. Modes have unit length; those of types I and III do if points on their ends
// count half.
class LineTransform {
public:
    LineTransform() = default;
    // Modes first ... first + count - 1 for n intervals, all that there are but for one that is zero or
    // constant, on lines of n cells (II, IV) or n + 1 faces (I, III).
    LineTransform(Transform transform, int n, int first, int count);

    // `count` lines of points to as many of modes, and back. Both may be the same memory if lines lie alike.
    void to_modes(const Lines<const float> &points, int count, const Lines<float> &modes,
                  std::vector<float> &scratch) const;
    void from_modes(const Lines<const float> &modes, int count, const Lines<float> &points,
                    std::vector<float> &scratch) const;

private:
    // Rows a and b of a line become aa a + ab b and ba a + bb b.
    struct Butterfly {
        int a, b;
        float aa, ab, ba, bb;
    };
    // A dense transform of the points start, start + stride, ... to the modes first, first + 1, ...
    struct Leaf {
        int start, stride, points, first, count;
        std::vector<float> analysis, synthesis; // count x points, points x count
    };

    std::vector<int> split(Transform transform, int n, const std::vector<int> &modes, int start, int stride);
    std::vector<int> leave_dense(Transform transform, int n, const std::vector<int> &modes, int start,
                                 int stride);
    std::vector<int> split_parities(Transform transform, int n, const std::vector<int> &modes, int start,
                                    int stride);
    std::vector<int> split_pairs(Transform transform, int n, int start, int stride);
    void analyse(float *points, float *modes) const;
    void synthesize(float *modes, float *points) const;

    int length_ = 0, modes_ = 0;
    std::vector<Butterfly> before_, after_;
    std::vector<Leaf> leaves_;
    std::vector<int> rows_, idle_; // where each mode is found; points that are zero in all
    std::vector<float> norms_;     // in the order of rows
};

// Cosines and sines that fit a line of n cells. A mode of the pressure is zero half a cell outside the last
// center, that is, on an open end, and level on a closed one; its differences live on the faces and are the
// mode there.
//     differences of face mode k = difference[k] times cell mode k
// Between closed ends cells have the DCT-II and faces the DST-I, between open ends DST-II and DCT-I, with the
// low end closed DCT-IV and DST-III, with the high end closed DST-IV and DCT-III.
class AxisModes {
public:
    // The lowest `count` modes: n of them are complete on the cells; complete() are so on cells and faces,
    // and some are then zero on one of the two.
    AxisModes(int n, bool closed_low, bool closed_high, int count);

    static int complete(int n, bool closed_low, bool closed_high) {
        return closed_low == closed_high ? n + 1 : n;
    }

    LineTransform cells() const { return LineTransform(cells_, n_, first_, count_); }
    LineTransform faces() const { return LineTransform(faces_, n_, first_, count_); }

    std::vector<double> difference;

private:
    Transform cells_, faces_;
    int n_, first_, count_;
};

} // namespace smokelift
