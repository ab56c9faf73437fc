// Sums, products and norms of long vectors.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

double dot(const float *a, const float *b, std::size_t n);
void axpy(float factor, const float *x, float *y, std::size_t n);  // y += factor x
void xpay(const float *x, float factor, float *y, std::size_t n);  // y = x + factor y
void scale(float factor, const float *x, float *y, std::size_t n); // y = factor x; x may be y
float largest_size(const float *x, std::size_t n);                 // NaN is the largest

// Of every row (i, j) the range from the first to the last number that is not zero.
void find_filled(In a, Span *spans, Workers &workers);

void axpy(float factor, const StaggeredIn &x, const StaggeredOut &y, Workers &workers);
void copy(const StaggeredIn &x, const StaggeredOut &y, Workers &workers); // y = x
float largest_size(const StaggeredIn &x, Workers &workers);

} // namespace smokelift
