// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Symmetric positive definite systems whose matrix is a band.
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// A symmetric matrix of order size with `width` diagonals below the main one, in single precision, which does for a step of an iteration:
// its lower part, column by column. Element (i, j), i >= j, is column(j)[i - j].
class Band {
 public:
    static constexpr std::ptrdiff_t TOGETHER = 4;  // columns taken in one pass; zeros follow each column, so that all four are as long

    Band(std::ptrdiff_t size, std::ptrdiff_t width) : size_(size), width_(width), values_(size * (width + TOGETHER)) {}
    std::ptrdiff_t size() const { return size_; }
    float* column(std::ptrdiff_t j) { return values_.data() + j * (width_ + TOGETHER); }
    const float* column(std::ptrdiff_t j) const { return values_.data() + j * (width_ + TOGETHER); }

    // Replaces the matrix by its Cholesky factor. False where it is not positive definite.
    bool factorise();

    // Replaces right (size) by the solution, by the factor.
    void solve(double* right) const;

 private:
    std::ptrdiff_t size_, width_;
    std::vector<float> values_;
};

}  // namespace tactile
