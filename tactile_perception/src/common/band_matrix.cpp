// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// LU factors of a band matrix (Golub and Van Loan, Matrix Computations, algorithm 4.3.1), a block of pivots at a time.
#include "common/band_matrix.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t PIVOTS = BandMatrix::PIVOTS;

// Row and column numbers as in the matrix: entry (i, j) is at value[i * (width - 1) + offset + j].
struct Rows {
    float* value;
    std::ptrdiff_t width, offset, size, half;
    bool symmetric = false;

    TACTILE_INLINE float* operator[](std::ptrdiff_t i) const { return value + i * (width - 1) + offset; }
};

// Factors the rows of one block of pivots, k to k + count, up to column last; false where a pivot is 0 or not finite.
TACTILE_INLINE bool factor_block(const Rows& row, std::ptrdiff_t k, std::ptrdiff_t count, std::ptrdiff_t last) {
    for (std::ptrdiff_t p = k; p < k + count; ++p) {
        const float* pivot = row[p];
        if (!(std::abs(pivot[p]) > 0) || !std::isfinite(pivot[p])) return false;
        for (std::ptrdiff_t q = p + 1; q < k + count; ++q) {
            float* target = row[q];
            const float share = target[p] = (row.symmetric ? pivot[q] : target[p]) / pivot[p];
            for (std::ptrdiff_t j = p + 1; j < last; ++j) target[j] -= share * pivot[j];
        }
    }
    return true;
}

// Each row below a block loses what its pivots explain, all of them in one pass over the row; of a symmetric matrix its upper part alone.
TACTILE_WIDE bool factor_rows(const Rows& row) {
    for (std::ptrdiff_t k = 0; k < row.size; k += PIVOTS) {
        const std::ptrdiff_t count = std::min(PIVOTS, row.size - k), first = k + count;
        const std::ptrdiff_t last = std::min(row.size, first + row.half);  // of the rows and columns that these pivots change
        if (!factor_block(row, k, count, last)) return false;
        for (std::ptrdiff_t i = first; i < last; ++i) {
            float* __restrict target = row[i], share[PIVOTS];
            for (std::ptrdiff_t p = 0; p < PIVOTS; ++p) {
                share[p] = row.symmetric ? row[k + p][i] : target[k + p];
                for (std::ptrdiff_t q = 0; q < p && !row.symmetric; ++q) share[p] -= share[q] * row[k + q][k + p];
                target[k + p] = share[p] /= row[k + p][k + p];
            }
            const float* __restrict a = row[k], * __restrict b = row[k + 1], * __restrict c = row[k + 2], * __restrict d = row[k + 3];
            for (std::ptrdiff_t j = row.symmetric ? i : first; j < last; ++j)
                target[j] -= share[0] * a[j] + share[1] * b[j] + (share[2] * c[j] + share[3] * d[j]);
        }
    }
    return true;
}

// Sum of products of entries (first to last) of a row and x.
TACTILE_INLINE double product(const float* row, const double* x, std::ptrdiff_t first, std::ptrdiff_t last) {
    double sums[PIVOTS] = {};
    std::ptrdiff_t j = first;
    for (; j + PIVOTS <= last; j += PIVOTS)
        for (std::ptrdiff_t k = 0; k < PIVOTS; ++k) sums[k] += row[j + k] * x[j + k];
    for (; j < last; ++j) sums[0] += row[j] * x[j];
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

TACTILE_WIDE void solve_rows(const Rows& row, double* x) {
    for (std::ptrdiff_t i = 0; i < row.size; ++i) x[i] -= product(row[i], x, std::max<std::ptrdiff_t>(0, i - row.half), i);
    for (std::ptrdiff_t i = row.size - 1; i >= 0; --i)
        x[i] = (x[i] - product(row[i], x, i + 1, std::min(row.size, i + row.half + 1))) / row[i][i];
}

}  // namespace

bool BandMatrix::factor(bool symmetric) {
    return factor_rows({value_.data(), width_, half_ + PIVOTS, size_, half_, symmetric});
}

void BandMatrix::solve(double* x) {
    solve_rows({value_.data(), width_, half_ + PIVOTS, size_, half_}, x);
}

}  // namespace tactile
