// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// LU factors of a band matrix (Golub and Van Loan, Matrix Computations, algorithm 4.3.1), a block of pivots at a time.
#include "common/band_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/lanes.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t PIVOTS = BandMatrix::PIVOTS;

// Eight floats, which one instruction handles.
struct EightFloats {
    typedef float Values __attribute__((vector_size(PIVOTS * sizeof(float))));
    Values values;

    TACTILE_INLINE EightFloats() : values{} {}
    TACTILE_INLINE explicit EightFloats(const float* from) { std::memcpy(&values, from, sizeof values); }
    TACTILE_INLINE void store(float* to) const { std::memcpy(to, &values, sizeof values); }
    TACTILE_INLINE EightFloats& operator+=(const EightFloats& other) { return values += other.values, *this; }
    TACTILE_INLINE EightFloats& operator-=(const EightFloats& other) { return values -= other.values, *this; }
    TACTILE_INLINE EightFloats& operator*=(float factor) { return values *= factor, *this; }
    TACTILE_INLINE friend EightFloats operator-(const EightFloats& a, const EightFloats& b) { return EightFloats(a) -= b; }
};

// Sum of rows (PIVOTS,), each times its factor.
TACTILE_INLINE EightFloats combined(const float* factor, const EightFloats (&rows)[PIVOTS]) {
    EightFloats sums[2];
    for (std::ptrdiff_t p = 0; p < PIVOTS; ++p) {
        EightFloats part = rows[p];
        part *= factor[p];
        sums[p % 2] += part;
    }
    sums[0] += sums[1];
    return sums[0];
}

// Row and column numbers as in the matrix: entry (i, j) is at value[i * (width - 1) + offset + j].
struct Rows {
    float* value;
    std::ptrdiff_t width, offset, size, half;

    TACTILE_INLINE float* operator[](std::ptrdiff_t i) const { return value + i * (width - 1) + offset; }
};

// Factors the rows of one block of pivots, k to k + count, up to column last; false where a pivot is 0 or not finite.
TACTILE_INLINE bool factor_block(const Rows& row, std::ptrdiff_t k, std::ptrdiff_t count, std::ptrdiff_t last) {
    for (std::ptrdiff_t p = k; p < k + count; ++p) {
        const float* pivot = row[p];
        if (!(std::abs(pivot[p]) > 0) || !std::isfinite(pivot[p])) return false;
        for (std::ptrdiff_t q = p + 1; q < k + count; ++q) {
            float* target = row[q];
            const float share = target[p] /= pivot[p];
            for (std::ptrdiff_t j = p + 1; j < last; ++j) target[j] -= share * pivot[j];
        }
    }
    return true;
}

// Inverse (PIVOTS, PIVOTS) of the upper triangle of the pivots from k on.
TACTILE_INLINE void invert_block(const Rows& row, std::ptrdiff_t k, EightFloats (&inverse)[PIVOTS]) {
    float values[PIVOTS][PIVOTS] = {};
    for (std::ptrdiff_t column = 0; column < PIVOTS; ++column) {
        for (std::ptrdiff_t i = column; i >= 0; --i) {
            const float* pivot = row[k + i] + k;
            float sum = i == column ? 1.0f : 0.0f;
            for (std::ptrdiff_t j = i + 1; j <= column; ++j) sum -= pivot[j] * values[j][column];
            values[i][column] = sum / pivot[i];
        }
    }
    for (std::ptrdiff_t i = 0; i < PIVOTS; ++i) inverse[i] = EightFloats(values[i]);
}

TACTILE_WIDE bool factor_rows(const Rows& row) {
    for (std::ptrdiff_t k = 0; k < row.size; k += PIVOTS) {
        const std::ptrdiff_t count = std::min(PIVOTS, row.size - k), first = k + count;
        const std::ptrdiff_t last = std::min(row.size, first + row.half);  // of the rows and columns that these pivots change
        if (!factor_block(row, k, count, last)) return false;
        if (first == row.size) break;
        EightFloats inverse[PIVOTS];
        invert_block(row, k, inverse);
        const float* pivot[PIVOTS];
        for (std::ptrdiff_t p = 0; p < PIVOTS; ++p) pivot[p] = row[k + p];
        for (std::ptrdiff_t i = first; i < last; ++i) {
            float *target = row[i], share[PIVOTS];
            combined(target + k, inverse).store(share);
            std::memcpy(target + k, share, sizeof share);
            std::ptrdiff_t j = first;
            for (; j + PIVOTS <= last; j += PIVOTS) {
                EightFloats at[PIVOTS];
                for (std::ptrdiff_t p = 0; p < PIVOTS; ++p) at[p] = EightFloats(pivot[p] + j);
                (EightFloats(target + j) - combined(share, at)).store(target + j);
            }
            for (; j < last; ++j)
                for (std::ptrdiff_t p = 0; p < PIVOTS; ++p) target[j] -= share[p] * pivot[p][j];
        }
    }
    return true;
}

// Sum of products of entries (first to last) of a row and x.
TACTILE_INLINE double product(const float* row, const double* x, std::ptrdiff_t first, std::ptrdiff_t last) {
    Four sums[2];
    std::ptrdiff_t j = first;
    for (; j + 2 * FOUR <= last; j += 2 * FOUR) {
        for (std::ptrdiff_t part = 0; part < 2; ++part) sums[part] += Four::of_floats(row + j + FOUR * part) * Four(x + j + FOUR * part);
    }
    double part[FOUR], rest = 0;
    (sums[0] + sums[1]).store(part);
    for (; j < last; ++j) rest += row[j] * x[j];
    return ((part[0] + part[1]) + (part[2] + part[3])) + rest;
}

TACTILE_WIDE void solve_rows(const Rows& row, double* x) {
    for (std::ptrdiff_t i = 0; i < row.size; ++i) x[i] -= product(row[i], x, std::max<std::ptrdiff_t>(0, i - row.half), i);
    for (std::ptrdiff_t i = row.size - 1; i >= 0; --i)
        x[i] = (x[i] - product(row[i], x, i + 1, std::min(row.size, i + row.half + 1))) / row[i][i];
}

}  // namespace

bool BandMatrix::factor() {
    return factor_rows({value_.data(), width_, half_ + PIVOTS, size_, half_});
}

void BandMatrix::solve(double* x) {
    solve_rows({value_.data(), width_, half_ + PIVOTS, size_, half_}, x);
}

}  // namespace tactile
