// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Cholesky's method for a symmetric positive definite matrix of n unknowns, whose element (i, j) is matrix[i * stride + j]. Only the lower
// triangle is read and written.
#pragma once

#include <algorithm>
#include <cmath>

namespace tactile {

constexpr double LEAST_PIVOT = 1e-30;  // against a division by zero where hardly anything tells an unknown

// Replaces the matrix by its factor; a pivot below least counts as least. False where the matrix is not positive definite, or not finite.
inline bool factorise(double* matrix, int n, int stride, double least = 0) {
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j <= i; ++j) {
            double sum = matrix[i * stride + j];
            for (int k = 0; k < j; ++k) sum -= matrix[i * stride + k] * matrix[j * stride + k];
            if (i == j) sum = std::max(sum, least);
            if (i == j && !(sum > 0 && std::isfinite(sum))) return false;
            matrix[i * stride + j] = i == j ? std::sqrt(sum) : sum / matrix[j * stride + j];
        }
    }
    return true;
}

// Replaces the right side (n) by the solution, with the factor of the matrix.
inline void substitute(const double* factor, int n, int stride, double* right) {
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k < i; ++k) right[i] -= factor[i * stride + k] * right[k];
        right[i] /= factor[i * stride + i];
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k) right[i] -= factor[k * stride + i] * right[k];
        right[i] /= factor[i * stride + i];
    }
}

}  // namespace tactile
