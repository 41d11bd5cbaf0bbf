// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Symmetric positive definite systems whose matrix is a band.
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// A symmetric matrix of order size with `width` diagonals below the main one: its lower part, column by column. Element (i, j), i >= j, is
// column(j)[i - j]. Zeros follow each column, so that loops may run over the longest of a few.
struct Band {
    static constexpr std::ptrdiff_t TOGETHER = 4;  // columns that a loop handles at once
    std::ptrdiff_t size, width;
    std::vector<double> values;
    Band(std::ptrdiff_t size_, std::ptrdiff_t width_) : size(size_), width(width_), values(size * (width + TOGETHER)) {}
    double* column(std::ptrdiff_t j) { return values.data() + j * (width + TOGETHER); }
    const double* column(std::ptrdiff_t j) const { return values.data() + j * (width + TOGETHER); }
};

// Replaces the matrix by its Cholesky factor. False where it is not positive definite.
bool factorise(Band& matrix);

// Replaces right (size) by the solution; factor: of factorise.
void solve(const Band& factor, double* right);

}  // namespace tactile
