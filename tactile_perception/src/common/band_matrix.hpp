// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A square band matrix, and its LU factors in place.
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// Entries (i, j) with |i - j| <= half, in single precision; a margin of zeros lets a block of pivots be taken at a time.
class BandMatrix {
 public:
    static constexpr std::ptrdiff_t PIVOTS = 4;

    BandMatrix(std::ptrdiff_t size, std::ptrdiff_t half)
        : size_(size), half_(half), width_(2 * (half + PIVOTS) + 1), value_(static_cast<std::size_t>(size * width_)) {}

    std::ptrdiff_t size() const { return size_; }
    float* row(std::ptrdiff_t i) { return value_.data() + i * width_ + half_ + PIVOTS - i; }  // row(i)[j] is entry (i, j)
    void clear() { value_.assign(value_.size(), 0.0f); }

    // Replaces the matrix by its LU factors, L with a unit diagonal; without pivoting. False where a pivot is 0 or not finite. symmetric:
    // whether the lower part equals the upper one, and is not read.
    bool factor(bool symmetric = false);

    // Solves for x (size,) in place, by the factors.
    void solve(double* x);

 private:
    std::ptrdiff_t size_, half_, width_;
    std::vector<float> value_;
};

}  // namespace tactile
