// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/band.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t LANES = Band<double>::LANES, TOGETHER = Band<double>::TOGETHER;

// Groups of LANES rows that hold count rows.
std::ptrdiff_t groups(std::ptrdiff_t count) {
    return (count + LANES - 1) / LANES;
}

// Column by column: each loses what the columns before explain, four of them at a time, and is scaled by its pivot.
template <class Number>
[[gnu::always_inline]] inline bool take_columns(Band<Number>& matrix) {
    for (std::ptrdiff_t j = 0; j < matrix.size; ++j) {
        Number* __restrict column = matrix.column(j);
        std::ptrdiff_t k = std::max<std::ptrdiff_t>(j - matrix.width, 0);
        for (; k + TOGETHER <= j; k += TOGETHER) {
            const Number *a = matrix.column(k) + j - k, *b = matrix.column(k + 1) + j - k - 1;
            const Number *c = matrix.column(k + 2) + j - k - 2, *d = matrix.column(k + 3) + j - k - 3;
            const std::ptrdiff_t count = LANES * groups(matrix.width + TOGETHER - (j - k));
            const Number fa = a[0], fb = b[0], fc = c[0], fd = d[0];
            for (std::ptrdiff_t i = 0; i < count; ++i) column[i] -= fa * a[i] + fb * b[i] + (fc * c[i] + fd * d[i]);
        }
        for (; k < j; ++k) {
            const Number *a = matrix.column(k) + j - k, fa = a[0];
            const std::ptrdiff_t count = LANES * groups(matrix.width + 1 - (j - k));
            for (std::ptrdiff_t i = 0; i < count; ++i) column[i] -= fa * a[i];
        }
        if (!(column[0] > 0) || !std::isfinite(column[0])) return false;
        const Number scale = 1 / std::sqrt(column[0]);
        for (std::ptrdiff_t i = 0; i <= matrix.width; ++i) column[i] *= scale;
    }
    return true;
}

template <class Number>
Number sum_of(const Number (&lanes)[LANES]) {
    return ((lanes[0] + lanes[4]) + (lanes[1] + lanes[5])) + ((lanes[2] + lanes[6]) + (lanes[3] + lanes[7]));
}

// Down, then up, by four rows at a time: first what lies outside of the four, or after it, then their triangle. Several right sides go side
// by side: each waits for its last four rows.
template <std::ptrdiff_t SIDES, class Number>
[[gnu::always_inline]] inline void solve_both_ways(const Band<Number>& factor, double* const (&right)[SIDES]) {
    const std::ptrdiff_t length = factor.columns() + factor.stride;  // zeros follow, as in the columns
    std::vector<Number> found(SIDES * length);
    for (std::ptrdiff_t side = 0; side < SIDES; ++side) {
        for (std::ptrdiff_t j = 0; j < factor.size; ++j) found[side * length + j] = static_cast<Number>(right[side][j]);
    }
    const std::ptrdiff_t count = LANES * groups(factor.width);
    for (std::ptrdiff_t j = 0; j < factor.columns(); j += TOGETHER) {
        const Number *a = factor.column(j), *b = factor.column(j + 1) - 1, *c = factor.column(j + 2) - 2, *d = factor.column(j + 3) - 3;
        const Number* column[TOGETHER] = {a, b, c, d};
        for (std::ptrdiff_t k = 0; k < TOGETHER; ++k) {
            for (std::ptrdiff_t side = 0; side < SIDES; ++side) {
                Number* value = found.data() + side * length + j;
                for (std::ptrdiff_t i = 0; i < k; ++i) value[k] -= column[i][k] * value[i];
                value[k] /= column[k][k];
            }
        }
        a += TOGETHER, b += TOGETHER, c += TOGETHER, d += TOGETHER;
        for (std::ptrdiff_t side = 0; side < SIDES; ++side) {
            Number *value = found.data() + side * length + j, *__restrict below = value + TOGETHER;
            const Number fa = value[0], fb = value[1], fc = value[2], fd = value[3];
            for (std::ptrdiff_t i = 0; i < count; ++i) below[i] -= fa * a[i] + fb * b[i] + (fc * c[i] + fd * d[i]);
        }
    }
    for (std::ptrdiff_t side = 0; side < SIDES; ++side)
        std::fill_n(found.begin() + side * length + factor.size, length - factor.size, Number(0));
    for (std::ptrdiff_t j = factor.columns() - TOGETHER; j >= 0; j -= TOGETHER) {
        Number sums[SIDES][TOGETHER][LANES] = {};
        for (std::ptrdiff_t side = 0; side < SIDES; ++side) {
            const Number* below = found.data() + side * length + j + TOGETHER;
            for (std::ptrdiff_t k = 0; k < TOGETHER; ++k) {
                const Number* column = factor.column(j + k) + TOGETHER - k;
                for (std::ptrdiff_t i = 0; i < count; i += LANES) {
                    for (std::ptrdiff_t lane = 0; lane < LANES; ++lane) sums[side][k][lane] += column[i + lane] * below[i + lane];
                }
            }
        }
        for (std::ptrdiff_t k = TOGETHER - 1; k >= 0; --k) {
            const Number* column = factor.column(j + k) - k;
            for (std::ptrdiff_t side = 0; side < SIDES; ++side) {
                Number* value = found.data() + side * length + j;
                value[k] -= sum_of(sums[side][k]);
                for (std::ptrdiff_t i = k + 1; i < TOGETHER; ++i) value[k] -= column[i] * value[i];
                value[k] /= column[k];
            }
        }
    }
    for (std::ptrdiff_t side = 0; side < SIDES; ++side) std::copy_n(found.begin() + side * length, factor.size, right[side]);
}

}  // namespace

TACTILE_WIDE bool factorise(Band<float>& matrix) {
    return take_columns(matrix);
}

TACTILE_WIDE bool factorise(Band<double>& matrix) {
    return take_columns(matrix);
}

TACTILE_WIDE void solve(const Band<float>& factor, double* right) {
    solve_both_ways<1>(factor, {right});
}

TACTILE_WIDE void solve(const Band<float>& factor, double* one, double* other) {
    solve_both_ways<2>(factor, {one, other});
}

TACTILE_WIDE void solve(const Band<double>& factor, double* right) {
    solve_both_ways<1>(factor, {right});
}

}  // namespace tactile
