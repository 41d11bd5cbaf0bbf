// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// LU factors of a band matrix (Golub and Van Loan, Matrix Computations, algorithm 4.3.1), four pivots at a time.
#include "common/band_matrix.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {

bool BandMatrix::factor() {
    for (std::ptrdiff_t k = 0; k < size_; k += PIVOTS) {
        const std::ptrdiff_t pivots = std::min(PIVOTS, size_ - k), first = k + pivots;
        const std::ptrdiff_t last = std::min(size_, first + half_);  // of the rows and columns that these pivots change
        float* pivot[PIVOTS];
        for (std::ptrdiff_t p = 0; p < PIVOTS; ++p) pivot[p] = row(k + std::min(p, pivots - 1));
        for (std::ptrdiff_t p = 0; p < pivots; ++p) {
            if (!(std::abs(pivot[p][k + p]) > 0) || !std::isfinite(pivot[p][k + p])) return false;
            for (std::ptrdiff_t q = p + 1; q < pivots; ++q) {
                const float share = pivot[q][k + p] /= pivot[p][k + p];
                for (std::ptrdiff_t j = k + p + 1; j < last; ++j) pivot[q][j] -= share * pivot[p][j];
            }
        }
        const float *a = pivot[0], *b = pivot[1], *c = pivot[2], *d = pivot[3];
        for (std::ptrdiff_t i = first; i < last; ++i) {
            float *target = row(i), share[PIVOTS] = {};
            for (std::ptrdiff_t p = 0; p < pivots; ++p) {
                for (std::ptrdiff_t q = 0; q < p; ++q) target[k + p] -= share[q] * pivot[q][k + p];
                share[p] = target[k + p] /= pivot[p][k + p];
            }
            for (std::ptrdiff_t j = first; j < last; ++j)
                target[j] -= (share[0] * a[j] + share[1] * b[j]) + (share[2] * c[j] + share[3] * d[j]);
        }
    }
    return true;
}

void BandMatrix::solve(double* x) {
    for (std::ptrdiff_t i = 0; i < size_; ++i) {
        const float* from = row(i);
        for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, i - half_); j < i; ++j) x[i] -= from[j] * x[j];
    }
    for (std::ptrdiff_t i = size_ - 1; i >= 0; --i) {
        const float* from = row(i);
        for (std::ptrdiff_t j = i + 1; j < std::min(size_, i + half_ + 1); ++j) x[i] -= from[j] * x[j];
        x[i] /= from[i];
    }
}

}  // namespace tactile
