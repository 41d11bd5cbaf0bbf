// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A depth w moves a marker by slope w in the image; the rest of its displacement is strain in the plane. With the strain's energy S and the
// bending's B, (B + sum over axes of slope S slope) w = sum over axes of slope S shift. Solved by U^T D U (Golub and Van Loan, Matrix
// Computations, 4.1.2), a block of pivots at a time.
#include "press/sheet_depths.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/lanes.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t PIVOTS = 4;

TACTILE_INLINE double product(const double* a, const double* b, std::ptrdiff_t count) {
    Four sums[2];
    std::ptrdiff_t k = 0;
    for (; k + 2 * FOUR <= count; k += 2 * FOUR)
        for (std::ptrdiff_t part = 0; part < 2; ++part) sums[part] += Four(a + k + FOUR * part) * Four(b + k + FOUR * part);
    double part[FOUR], rest = 0;
    (sums[0] + sums[1]).store(part);
    for (; k < count; ++k) rest += a[k] * b[k];
    return ((part[0] + part[1]) + (part[2] + part[3])) + rest;
}

// Replaces the upper triangle of a matrix (size, size) by U, its rows times the pivots D; false where a pivot is not positive.
TACTILE_WIDE bool factor(double* matrix, std::ptrdiff_t size) {
    for (std::ptrdiff_t k = 0; k < size; k += PIVOTS) {
        const std::ptrdiff_t first = std::min(k + PIVOTS, size);
        const double* pivot[PIVOTS] = {};
        for (std::ptrdiff_t p = k; p < first; ++p) {
            const double* row = pivot[p - k] = matrix + p * size;
            if (!(row[p] > 0) || !std::isfinite(row[p])) return false;
            for (std::ptrdiff_t q = p + 1; q < first; ++q) {
                const double share = row[q] / row[p];
                for (std::ptrdiff_t j = q; j < size; ++j) matrix[q * size + j] -= share * row[j];
            }
        }
        for (std::ptrdiff_t i = first; i < size; ++i) {
            double *target = matrix + i * size, share[PIVOTS];
            for (std::ptrdiff_t p = 0; p < PIVOTS; ++p) share[p] = pivot[p][i] / pivot[p][k + p];
            std::ptrdiff_t j = i;
            for (; j + FOUR <= size; j += FOUR) {
                const Four left = (Four(share[0]) * Four(pivot[0] + j) + Four(share[1]) * Four(pivot[1] + j)) +
                                  (Four(share[2]) * Four(pivot[2] + j) + Four(share[3]) * Four(pivot[3] + j));
                (Four(target + j) - left).store(target + j);
            }
            for (; j < size; ++j)
                target[j] -= (share[0] * pivot[0][j] + share[1] * pivot[1][j]) + (share[2] * pivot[2][j] + share[3] * pivot[3][j]);
        }
    }
    return true;
}

// Solves for x (size,) in place, by the factors.
TACTILE_WIDE void solve(const double* matrix, std::ptrdiff_t size, double* x) {
    for (std::ptrdiff_t k = 0; k < size; ++k) {
        const double* row = matrix + k * size;
        x[k] /= row[k];
        for (std::ptrdiff_t j = k + 1; j < size; ++j) x[j] -= x[k] * row[j];
    }
    for (std::ptrdiff_t k = size - 1; k >= 0; --k) {
        const double* row = matrix + k * size;
        x[k] -= product(row + k + 1, x + k + 1, size - k - 1) / row[k];
    }
}

TACTILE_WIDE void assemble(const SheetEnergies& sheet, const double* x, const double* y, double* matrix) {
    for (std::ptrdiff_t i = 0; i < sheet.markers; ++i) {
        const double *bending = sheet.bending + i * sheet.markers, *strain = sheet.strain + i * sheet.markers;
        for (std::ptrdiff_t j = i; j < sheet.markers; ++j)
            matrix[i * sheet.markers + j] = bending[j] + strain[j] * (x[i] * x[j] + y[i] * y[j]);
    }
}

TACTILE_WIDE void load(const SheetEnergies& sheet, const double* slope, const double* shift, double* right) {
    for (std::ptrdiff_t i = 0; i < sheet.markers; ++i)
        right[i] += slope[i] * product(sheet.strain + i * sheet.markers, shift, sheet.markers);
}

}  // namespace

void sheet_depths(const SheetEnergies& sheet, const double* slope, const double* shifts, std::ptrdiff_t count, double* depths) {
    const std::ptrdiff_t size = sheet.markers;
    std::vector<double> matrix(size * size), slopes[2], shift(size);
    for (int axis = 0; axis < 2; ++axis)
        for (std::ptrdiff_t k = 0; k < size; ++k) slopes[axis].push_back(slope[2 * k + axis]);
    assemble(sheet, slopes[0].data(), slopes[1].data(), matrix.data());
    const bool solvable = factor(matrix.data(), size);
    std::fill(depths, depths + count * size, solvable ? 0.0 : std::numeric_limits<double>::quiet_NaN());
    for (std::ptrdiff_t n = 0; n < count && solvable; ++n) {
        for (int axis = 0; axis < 2; ++axis) {
            for (std::ptrdiff_t k = 0; k < size; ++k) shift[k] = shifts[2 * (n * size + k) + axis];
            load(sheet, slopes[axis].data(), shift.data(), depths + n * size);
        }
        solve(matrix.data(), size, depths + n * size);
    }
}

}  // namespace tactile
