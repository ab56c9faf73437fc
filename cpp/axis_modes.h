// Eigenvectors of the differences along one axis of the MAC grid, in units of one cell.
#pragma once

#include "trigonometric.h"

namespace smokelift {

// Cosines and sines that fit a line of n cells. A mode of the pressure is zero half a cell outside the last
// centre, that is, on an open end, and level on a closed one; its differences live on the faces and are the
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
