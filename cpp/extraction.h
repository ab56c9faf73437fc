// Extraction: the radiance S that smoke sends and its transmittance T in one picture I = S + T B + n before a
// plate B. Maximum a posteriori, with smoothness on all scales.
#pragma once

#include "memory.h"

#include <array>
#include <vector>

namespace smokelift {

// What is known of smoke before any picture, for each level of the pyramid from the finest: standard
// deviations of opacity, and of the brightness and of the two chroma components of ln J.
using ScaleDeviations = std::vector<std::array<float, 4>>;

// The mean over the pixels of a cell of B, B B' (upper triangle), D and D B', with D = I - B; the variance of
// the noise of each channel, of one pixel; and the probability that B is wrong there.
struct Moments {
    float plate[3], plates[6], change[3], products[9], noise[3], unknown;
};

struct ExtractionProblem {
    const Moments *moments; // [row][column]
    int rows, columns;
    std::array<float, 3> source; // J, if its fields are 0
    std::array<float, 6> errors; // covariance of a wrong plate (upper triangle), the same over a cell
    ScaleDeviations deviations;  // one for each level
    float outlier_freedom;       // degrees of freedom of the noise's Student t distribution; 0: normal noise
    float pixels;                // in a cell
};

// Number of levels of a pyramid over so many cells: the coarsest has two cells at most along its longer side.
int pyramid_levels(int rows, int columns);

// The opacity 1 - T and the three deviations of ln J of every cell, interleaved; the standard deviation of
// its T; and the weight of its data, less than 1 for an outlier.
void extract(const ExtractionProblem &problem, int rounds, int iterations, float *fields, float *deviation,
             float *weight);

} // namespace smokelift
