// Eigenvectors of the differences along one axis of the MAC grid.
#pragma once

#include "dense.h"

namespace smokelift {

// Sines and cosines that fit a line of n cells: a wave in the pressure is zero half a cell outside the last
// centre, that is, on an open end, and level on a closed one; its differences live on the faces and are the
// wave there.
//     differences of face wave k = difference[k] times cell wave k
// Cell waves are orthonormal; so are face waves if faces on open ends count half.
class Waves {
public:
    // The lowest `count` waves: n of them are complete on the cells; modes() are so on cells and faces, and
    // some are then zero on one of the two.
    Waves(int n, bool closed_low, bool closed_high, int count);

    static int modes(int n, bool closed_low, bool closed_high) {
        return closed_low == closed_high ? n + 1 : n;
    }

    Basis cells() const { return Basis(cells_, n_, first_, count_); }
    Basis faces() const { return Basis(faces_, n_, first_, count_); }

    std::vector<double> difference;

private:
    Wave cells_, faces_;
    int n_, first_, count_;
};

} // namespace smokelift
