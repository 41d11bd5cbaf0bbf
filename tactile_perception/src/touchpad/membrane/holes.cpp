// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/membrane/holes.hpp"

#include <algorithm>
#include <vector>

#include "common/band.hpp"
#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

namespace {

constexpr double UNKNOWN_WEIGHT = 0.5;  // chosen; a known neighbour weighs 1

}  // namespace

void fill_holes(double* values, const bool* known, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t count) {
    std::vector<std::ptrdiff_t> holes, number(rows * columns);  // number: of a hole among the holes
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k) {
        number[k] = static_cast<std::ptrdiff_t>(holes.size());
        if (!known[k]) holes.push_back(k);
    }
    const auto size = static_cast<std::ptrdiff_t>(holes.size());
    for (const std::ptrdiff_t k : holes) std::fill_n(values + k * count, count, 0.0);
    if (size == 0 || size == rows * columns) return;
    // Neighbours are at most columns + 1 dots apart, so the matrix is a band.
    Band<double> matrix(size, std::min(size - 1, columns + 1));
    std::vector<double> right(size * count);  // one row for each of the values
    for (std::ptrdiff_t h = 0; h < size; ++h) {
        beside(Grid{rows, columns}, holes[h], [&](std::ptrdiff_t near) {
            matrix.column(h)[0] += known[near] ? 1.0 : UNKNOWN_WEIGHT;
            if (!known[near] && near > holes[h]) matrix.column(h)[number[near] - h] = -UNKNOWN_WEIGHT;
            for (std::ptrdiff_t i = 0; known[near] && i < count; ++i) right[i * size + h] += values[near * count + i];
        });
    }
    factorise(matrix);  // positive definite: each hole is linked to a known dot
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        solve(matrix, right.data() + i * size);
        for (std::ptrdiff_t h = 0; h < size; ++h) values[holes[h] * count + i] = right[i * size + h];
    }
}

}  // namespace tactile
