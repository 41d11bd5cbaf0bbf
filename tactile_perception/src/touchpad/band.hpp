// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Symmetric positive definite systems whose matrix is a band, of double or, for a step of an iteration, float.
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// A symmetric matrix of order size with `width` diagonals below the main one: its lower part, column by column. Element (i, j), i >= j, is
// column(j)[i - j]. Zeros follow each column, so that loops may run over the longest of a few, and over whole groups of LANES rows; columns
// of the identity follow the last one, so that they may run over whole groups of TOGETHER columns.
template <class Number>
struct Band {
    static constexpr std::ptrdiff_t TOGETHER = 4, LANES = 8;  // columns that a loop handles at once; rows that an instruction does
    std::ptrdiff_t size, width, stride;
    std::vector<Number> values;
    Band(std::ptrdiff_t size_, std::ptrdiff_t width_)
        : size(size_), width(width_), stride(width + TOGETHER + LANES), values(columns() * stride) {
        for (std::ptrdiff_t j = size; j < columns(); ++j) column(j)[0] = 1;
    }
    std::ptrdiff_t columns() const { return (size + TOGETHER - 1) / TOGETHER * TOGETHER; }
    Number* column(std::ptrdiff_t j) { return values.data() + j * stride; }
    const Number* column(std::ptrdiff_t j) const { return values.data() + j * stride; }
};

// Replaces the matrix by its Cholesky factor. False where it is not positive definite.
bool factorise(Band<float>& matrix);
bool factorise(Band<double>& matrix);

// Replaces right (size) by the solution; factor: of factorise.
void solve(const Band<float>& factor, double* right);
void solve(const Band<double>& factor, double* right);

// The same of two right sides, in little more than the time of one.
void solve(const Band<float>& factor, double* one, double* other);

}  // namespace tactile
