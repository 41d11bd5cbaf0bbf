// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "band.hpp"

#include <algorithm>
#include <cmath>

#include "wide.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t LANES = 8;  // sums side by side, which an instruction adds at once, in a fixed order

}  // namespace

// Column by column: each loses what the columns before explain, four of them at a time, and is scaled by its pivot.
TACTILE_WIDE bool factorise(Band& matrix) {
    for (std::ptrdiff_t j = 0; j < matrix.size; ++j) {
        double* __restrict column = matrix.column(j);
        std::ptrdiff_t k = std::max<std::ptrdiff_t>(j - matrix.width, 0);
        for (; k + Band::TOGETHER <= j; k += Band::TOGETHER) {
            const double *a = matrix.column(k) + j - k, *b = matrix.column(k + 1) + j - k - 1;
            const double *c = matrix.column(k + 2) + j - k - 2, *d = matrix.column(k + 3) + j - k - 3;
            const std::ptrdiff_t count = matrix.width + Band::TOGETHER - (j - k);
            const double fa = a[0], fb = b[0], fc = c[0], fd = d[0];
            for (std::ptrdiff_t i = 0; i < count; ++i) column[i] -= fa * a[i] + fb * b[i] + (fc * c[i] + fd * d[i]);
        }
        for (; k < j; ++k) {
            const double *a = matrix.column(k) + j - k, fa = a[0];
            for (std::ptrdiff_t i = 0; i <= matrix.width - (j - k); ++i) column[i] -= fa * a[i];
        }
        if (!(column[0] > 0) || !std::isfinite(column[0])) return false;
        const double scale = 1 / std::sqrt(column[0]);
        for (std::ptrdiff_t i = 0; i <= matrix.width; ++i) column[i] *= scale;
    }
    return true;
}

TACTILE_WIDE void solve(const Band& factor, double* right) {
    for (std::ptrdiff_t j = 0; j < factor.size; ++j) {
        const double* column = factor.column(j);
        const std::ptrdiff_t below = std::min(factor.width, factor.size - 1 - j);
        const double value = right[j] /= column[0];
        for (std::ptrdiff_t i = 1; i <= below; ++i) right[j + i] -= column[i] * value;
    }
    for (std::ptrdiff_t j = factor.size - 1; j >= 0; --j) {
        const double *column = factor.column(j), *found = right + j;
        const std::ptrdiff_t below = std::min(factor.width, factor.size - 1 - j);
        double sums[LANES] = {};  // several, so that none waits for another
        std::ptrdiff_t i = 1;
        for (; i + LANES <= below + 1; i += LANES) {
            for (std::ptrdiff_t lane = 0; lane < LANES; ++lane) sums[lane] += column[i + lane] * found[i + lane];
        }
        for (; i <= below; ++i) sums[0] += column[i] * found[i];
        right[j] = (right[j] - ((sums[0] + sums[4]) + (sums[1] + sums[5]) + ((sums[2] + sums[6]) + (sums[3] + sums[7])))) / column[0];
    }
}

}  // namespace tactile
