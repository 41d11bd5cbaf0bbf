// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Least squares with a few unknowns: normal equations, solved by Cholesky's method.
#pragma once

#include <algorithm>

#include "common/cholesky.hpp"

namespace tactile {

template <int N>
class SmallSystem {
 public:
    // ridge: what is added to the diagonal, so that unknowns that nothing tells are 0.
    explicit SmallSystem(double ridge) {
        for (int i = 0; i < N; ++i) matrix[i][i] = ridge;
    }
    // Adds weight (row . unknowns - value)^2 to the sum of squares.
    void add(const double* row, double value, double weight) {
        for (int i = 0; i < N; ++i) {
            const double part = weight * row[i];
            for (int j = 0; j <= i; ++j) matrix[i][j] += part * row[j];
            right[i] += part * value;
        }
    }
    // Writes the unknowns; false where the equations are singular.
    bool solve(double* found) const {
        double factor[N][N];
        std::copy(matrix[0], matrix[0] + N * N, factor[0]);
        if (!factorise(factor[0], N, N)) return false;
        std::copy(right, right + N, found);
        substitute(factor[0], N, N, found);
        return true;
    }
    double matrix[N][N] = {}, right[N] = {};
};

}  // namespace tactile
