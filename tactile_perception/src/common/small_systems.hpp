// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Least squares with a few unknowns: normal equations, solved by Cholesky's method.
#pragma once

#include <cmath>

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
        for (int i = 0; i < N; ++i) {
            double value = right[i];
            for (int j = 0; j <= i; ++j) {
                double sum = matrix[i][j];
                for (int k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
                if (j == i && !(sum > 0)) return false;
                factor[i][j] = j == i ? std::sqrt(sum) : sum / factor[j][j];
            }
            for (int k = 0; k < i; ++k) value -= factor[i][k] * found[k];
            found[i] = value / factor[i][i];
        }
        for (int i = N - 1; i >= 0; --i) {
            for (int k = i + 1; k < N; ++k) found[i] -= factor[k][i] * found[k];
            found[i] /= factor[i][i];
        }
        return true;
    }
    double matrix[N][N] = {}, right[N] = {};
};

}  // namespace tactile
