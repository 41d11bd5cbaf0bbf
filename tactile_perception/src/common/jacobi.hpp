// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Eigenvalues and eigenvectors of a small symmetric matrix by Jacobi's method.
#pragma once

#include <cmath>

namespace tactile {

constexpr int SWEEPS = 12;  // of Jacobi's method: four by four settles in half as many, seven by seven in eight

// Turns the plane of axes i and j so that the symmetric matrix is 0 at (i, j), and the axes (columns) with it.
template <int N>
void annihilate(double (&matrix)[N][N], double (&axes)[N][N], int i, int j) {
    if (matrix[i][j] == 0) return;
    const double theta = (matrix[j][j] - matrix[i][i]) / (2 * matrix[i][j]);
    const double tangent = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1));
    const double cosine = 1 / std::sqrt(tangent * tangent + 1), sine = tangent * cosine;
    const auto turn = [&](double& a, double& b) {
        const double before = a;
        a = cosine * before - sine * b;
        b = sine * before + cosine * b;
    };
    for (int k = 0; k < N; ++k) turn(matrix[k][i], matrix[k][j]);
    for (int k = 0; k < N; ++k) turn(matrix[i][k], matrix[j][k]);
    for (int k = 0; k < N; ++k) turn(axes[k][i], axes[k][j]);
}

// Leaves the eigenvalues of the symmetric matrix on its diagonal, and the eigenvectors in the columns of axes.
template <int N>
void diagonalise(double (&matrix)[N][N], double (&axes)[N][N]) {
    for (int i = 0; i < N; ++i) {
        for (int j = 0; j < N; ++j) axes[i][j] = i == j;
    }
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        for (int i = 0; i < N - 1; ++i) {
            for (int j = i + 1; j < N; ++j) annihilate(matrix, axes, i, j);
        }
    }
}

}  // namespace tactile
